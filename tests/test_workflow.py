"""The workflow on the smoke configuration: two experiments of three seconds, not the study."""

import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import xarray as xr

from pneumo.selection.cylinder_template import write_table_template
from tests.checkout import ROOT, edit
from tests.torture.study import Study
from workflow.jobs.checksums import unlike_sums

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]


def planned(study: Study) -> dict[str, int]:
    """Jobs that a dry run would start, by rule."""
    text = study.run("-n").output
    if "Nothing to be done" in text:
        return {}
    table = re.search(r"^job\s+count\n-+\s+-+\n(.*?)\n\n", text, re.MULTILINE | re.DOTALL)
    assert table, text
    jobs = dict(row.rsplit(maxsplit=1) for row in table.group(1).splitlines())
    return {rule: int(count) for rule, count in jobs.items() if rule not in ("all", "total")}


@contextmanager
def replaced(file: Path, old: str, new: str) -> Iterator[None]:
    """Replace part of a file's text for a while."""
    original = edit(file, old, new)
    try:
        yield
    finally:
        file.write_text(original)


def test_a_study_is_made_up_to_verdict_and_report(judged_smoke_study):
    made = set(judged_smoke_study.hashes())
    for experiment in ("E06", "E12"):
        assert {f"settling/{experiment}.nc", f"datum/{experiment}.nc"} <= made
        assert {f"{transport}/replay/{experiment}.nc" for transport in ("published", "exact")} <= made
    assert {"published/statistics.nc", "exact/statistics.nc", "settling.nc"} <= made
    assert {"parameters.json", "verdict.json", "verdict.html", "report.html"} <= made
    assert not [name for name in made if name.endswith(".part")]
    # The paper's own results would be beside them.
    assert judged_smoke_study.results.name == "results-smoke"
    assert [file.name for file in (judged_smoke_study.folder / "results").iterdir()] == ["README.md"]


@pytest.mark.slow
def test_so_are_figures_and_the_paper_of_2007(smoke_study):
    made = set(smoke_study.hashes())
    assert {"2007/verdict.json", "2007/verdict.html"} <= made
    assert {f"figures/fig{number:02}.svg" for number in range(1, 13)} <= made
    assert {f"figures/fig{number:02}.png" for number in range(7, 12)} <= made  # the others are kept by hand
    assert unlike_sums(smoke_study.results) == (len(made), [])
    assert not [name for name in made if name.endswith(".part")]


MODEL = "pneumo/physics/models.py", '("M4",  1.2,', '("M4",  1.25,'
FIGURE = "paper/study/figures/traces_figure.py", "import xarray as xr", "import xarray as xr\n\nEDITED = 1"
DURATION = "config/smoke.yaml", "duration_limit_s: 3.0", "duration_limit_s: 2.0"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("edit", "rerun", "kept"),
    [
        (MODEL, {"settling", "datum", "replay", "statistics", "verdict"}, {"schemes"}),
        (FIGURE, {"figures"}, {"settling", "datum", "replay", "statistics", "schemes"}),
        (DURATION, {"settling", "datum", "replay", "statistics"}, {"schemes", "simulated_example"}),
    ],
)
def test_an_edit_reruns_what_depends_on_it_only(smoke_study, edit, rerun, kept):
    file, old, new = edit
    with replaced(smoke_study.folder / file, old, new):
        jobs = planned(smoke_study)
    assert rerun <= set(jobs) and not kept & set(jobs)


def test_bad_configuration_is_one_line_exit_2_and_nothing_written_without_a_home_too(tmp_path):
    without_home = {"HOME": "/dev/null/home", "XDG_CACHE_HOME": ""}  # where Snakemake has a cache by default
    study = Study(tmp_path / "checkout", "bad.yaml", without_home)
    (study.folder / "bad.yaml").write_text("cylinders: {D: {bore_mm: -20}}")
    done = study.run()
    assert done.code == 2
    assert done.output.count("pneumo: ") == 1 and "Traceback" not in done.output
    assert all(word in done.refusal for word in ("bad.yaml", "cylinders.D.bore_mm", "-20", "greater than 0"))
    assert not study.hashes()


OWN = """
n: [1.2, 1.3]
cylinders:
  second:
    {bore_mm: 40, stroke_mm: 200, mass_kg: 8, friction_Ns_per_m: 100, k_x_k_u_m2_per_V: 1.0e-6, u_max_V: 10,
     seed: 3, sample_time_s: 0.05, open_loop: {amplitude_V: 0.8, reverse_at: 0.9}}
experiments:
  other:
    {cylinder: second, loop: open, lambda_0_W_per_m2K: 30, duration_s: 5,
     signal: {kind: steps, levels: [1, -1], hold_s: 0.1}}
run: {experiments: [open, other], seeds: 2, duration_limit_s: 0.3}
"""
RUNS = ("open", "other")


@pytest.mark.slow
def test_cylinders_of_ones_own(tmp_path):
    compiled_already = {"PYTHONPATH": str(ROOT)}
    study = Study(tmp_path / "own", "my.yaml more.yaml", compiled_already)
    shutil.copy(study.folder / "pneumo/selection/templates/cylinder.yaml", study.folder / "my.yaml")
    (study.folder / "more.yaml").write_text(OWN)
    done = study.run()
    assert done.code == 0, done.output
    assert [file.name for file in (study.folder / "results").iterdir()] == ["README.md"]
    names = [
        (t, kind, name) for t in ("published", "exact") for kind in ("replay", "traces") for name in RUNS
    ]
    cells = {f"{transport}/{kind}/{name}.nc" for transport, kind, name in names}
    cells |= {"datum/open.nc", "datum/other.nc", "study/mine.nc", "study/second.nc"}
    statistics = {"exact/statistics.nc", "published/statistics.nc"}
    assert set(study.hashes()) == cells | statistics | {"parameters.json", "report.html", "study.html"}
    page = (study.results / "report.html").read_text()
    assert "is off by" in page and "verdict.html" not in page and "paper of 2006" not in page
    page = (study.results / "study.html").read_text()
    assert all(re.search(rf"<h2[^>]*>[^<]*\b{name}\b", page) for name in ("mine", "second"))
    own, grid = (study.results / name for name in ("study/mine.nc", "exact/replay/open.nc"))
    with xr.open_dataset(own) as mine, xr.open_dataset(grid) as cell:
        assert (mine["mse"].isel(experiment=0, run=0).values == cell["mse"].values).all()


@pytest.mark.slow
def test_a_table_of_cylinders_runs_in_blocks(tmp_path):
    compiled_already = {"PYTHONPATH": str(ROOT)}
    fleet = Study(tmp_path / "fleet", "fleet.yaml quick.yaml", compiled_already)
    write_table_template(fleet.folder / "fleet.yaml")
    table = fleet.folder / "fleet.csv"
    head, first, second = table.read_text().splitlines()
    table.write_text("\n".join([head, first, second, first.replace("first", "third")]))
    quick = "run: {seeds: 2, duration_limit_s: 0.3, block_size: 2}\nn: [1.2, 1.3]\n"
    (fleet.folder / "quick.yaml").write_text(quick)
    assert planned(fleet) == {"fleet_block": 2, "fleet_index": 1}
    done = fleet.run()
    assert done.code == 0, done.output
    assert set(fleet.hashes()) == {"fleet/000000.nc", "fleet/000002.nc", "fleet.nc", "fleet.html"}
    assert planned(fleet) == {}
    with replaced(table, "third,25.0", "third,20.0"):  # its block alone
        assert planned(fleet) == {"fleet_block": 1, "fleet_index": 1}
    with replaced(table, "third,25.0", "third,2000.0"):
        done = fleet.run()
    assert (done.code, done.output.count("pneumo: ")) == (2, 1)
    assert done.refusal.startswith("fleet.csv: row 4, column bore_mm = 2000: must be")
    # The same cells as of its own study, in four bytes.
    alone = fleet.pneumo("study", "fleet.yaml", "quick.yaml", "--cylinder", "third", "-o", "alone")
    assert alone.code == 0 and "third: Take " in alone.output, alone.output
    blocks = xr.open_dataset(fleet.results / "fleet" / "000002.nc")
    with blocks as stored, xr.open_dataset(fleet.folder / "alone" / "study.nc") as computed:
        assert (stored["mse"].sel(cylinder="third").values == computed["mse"].values.astype("float32")).all()
