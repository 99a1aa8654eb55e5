"""The workflow on the smoke configuration: two experiments of three seconds, not the study."""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
import xarray as xr

ROOT = Path(__file__).parents[1]
SMOKE = ("--configfile", "config/smoke.yaml")

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]


def checkout(folder: Path) -> Path:
    """Copy what the workflow needs, without results."""
    folder.mkdir(parents=True)
    for name in ("pneumo", "workflow", "config", "paper", "profiles"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "Snakefile", folder)
    return folder


def snakemake(folder: Path, *arguments: str, code: Path | None = None) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": str(code or folder)}  # the copy's pneumo, not the installed one
    command = [sys.executable, "-m", "snakemake", *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)


def hashes(folder: Path) -> dict[str, str]:
    files = [file for file in folder.rglob("*") if file.is_file() and "logs" not in file.parts]
    return {str(file.relative_to(folder)): hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


def planned(folder: Path) -> dict[str, int]:
    """Jobs that a dry run would start, by rule."""
    text = snakemake(folder, "-n", *SMOKE).stdout
    if "Nothing to be done" in text:
        return {}
    table = re.search(r"^job\s+count\n-+\s+-+\n(.*?)\n\n", text, re.MULTILINE | re.DOTALL)
    assert table, text
    jobs = dict(row.rsplit(maxsplit=1) for row in table.group(1).splitlines())
    return {rule: int(count) for rule, count in jobs.items() if rule not in ("all", "total")}


@pytest.fixture(scope="module")
def smoke(smoke_study) -> Path:
    return smoke_study[0].folder


@pytest.fixture(scope="module")
def bare(tmp_path_factory) -> Path:
    """A checkout in which nothing ran."""
    return checkout(tmp_path_factory.mktemp("bare") / "checkout")


def test_every_planned_file_is_there(smoke):
    made = set(hashes(smoke / "results"))
    for experiment in ("E06", "E12"):
        assert {f"settling/{experiment}.nc", f"datum/{experiment}.nc"} <= made
        assert {f"{transport}/replay/{experiment}.nc" for transport in ("published", "exact")} <= made
    assert {"published/statistics.nc", "exact/statistics.nc", "settling.nc", "table7.md"} <= made
    assert {"verdict.html", "report.html"} <= made
    assert {f"figures/fig{number:02}.{kind}" for number in range(1, 13) for kind in ("svg", "png")} <= made
    assert not [name for name in made if name.endswith(".part")]


def test_second_call_does_nothing(smoke):
    assert planned(smoke) == {}


def test_editing_a_model_reruns_replays_and_what_follows_only(smoke):
    models = smoke / "pneumo/physics/models.py"
    original = models.read_text()
    edited = original.replace('("M4",  1.2,', '("M4",  1.25,')
    assert edited != original
    models.write_text(edited)
    try:
        jobs = planned(smoke)
    finally:
        models.write_text(original)
    assert jobs["replay"] == 1
    assert jobs["statistics"] == 1
    assert not {"parameters", "settling", "datum", "schemes"} & set(jobs)


def test_editing_a_figure_reruns_figures_only(smoke):
    figures = smoke / "pneumo/publish/figures/settling_figure.py"
    original = figures.read_text()
    figures.write_text(original + "\n# edited\n")
    try:
        assert planned(smoke) == {"figures": 1}
    finally:
        figures.write_text(original)


def test_editing_the_configuration_reruns_everything_that_depends_on_it(smoke):
    config = smoke / "config/smoke.yaml"
    original = config.read_text()
    config.write_text(original.replace("duration_limit_s: 3.0", "duration_limit_s: 2.0"))
    try:
        jobs = planned(smoke)
    finally:
        config.write_text(original)
    assert {"parameters", "datum", "replay", "statistics"} <= set(jobs)


def test_evidence_once_there_is_judged_anew(smoke):
    evidence = smoke / "results/assumptions.nc"
    assert not evidence.exists()  # it is no part of the study
    evidence.touch()
    try:
        assert planned(smoke) == {"verdict": 1, "verdict_page": 1, "report": 1}
    finally:
        evidence.unlink()


def test_findings_once_there_are_on_the_report(smoke):
    parameters = json.loads((smoke / "results/parameters.json").read_text())
    findings = smoke / "results/findings.json"
    findings.write_text(json.dumps({"config_sha256": "another", "claims": [], "note": ""}))
    try:
        assert planned(smoke) == {}
        findings.write_text(json.dumps({"config_sha256": parameters["config_sha256"]}))
        assert planned(smoke) == {"report": 1}  # and not the ensemble
    finally:
        findings.unlink()
    manuscript = smoke / "results/paper.pdf"
    manuscript.touch()
    try:
        assert planned(smoke) == {"report": 1}
    finally:
        manuscript.unlink()


def test_snakemakes_own_report(smoke, tmp_path):
    done = snakemake(smoke, "--report", str(tmp_path / "report.zip"), *SMOKE)
    assert done.returncode == 0, done.stderr
    with zipfile.ZipFile(tmp_path / "report.zip") as found:
        names = {Path(name).name for name in found.namelist()}
    assert {"report.html", "verdict.html", "traces.svg", "fig01.svg"} <= names


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("cylinders: {D: {bore_mm: -20}}", ["bad.yaml", "cylinders.D.bore_mm", "-20", "greater than 0"]),
        ("cylinders: {D: {bore_cm: 2}}", ["bad.yaml", "cylinders.D.bore_cm", "unknown key"]),
        ("run: {experiments: [E17]}", ["bad.yaml", "run.experiments", "E17", "E16"]),
    ],
)
def test_bad_configuration_is_one_line_exit_2_and_nothing_written(bare, text, words):
    (bare / "bad.yaml").write_text(text)
    done = snakemake(bare, "-j1", "--configfile", "bad.yaml")
    lines = [line for line in done.stderr.splitlines() if line.startswith("pneumo: ")]
    assert done.returncode == 2
    assert len(lines) == 1
    assert "Traceback" not in done.stderr
    assert all(word in lines[0] for word in words), lines[0]
    assert not (bare / "results").exists()


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


def test_cylinders_of_ones_own(tmp_path):
    folder = checkout(tmp_path / "own")
    shutil.copy(folder / "pneumo/apply/templates/cylinder.yaml", folder / "my.yaml")
    (folder / "more.yaml").write_text(OWN)
    done = snakemake(folder, "-j2", "--configfile", "my.yaml", "more.yaml", code=ROOT)  # compiled already
    assert done.returncode == 0, done.stderr
    made = {name for name in hashes(folder / "results") if not name.endswith(".log")}
    experiments = ("open", "other")
    cells = {f"{t}/replay/{name}.nc" for t in ("published", "exact") for name in experiments}
    cells |= {"datum/open.nc", "datum/other.nc", "study/mine.nc", "study/second.nc"}
    statistics = {"exact/statistics.nc", "published/statistics.nc"}
    assert made == cells | statistics | {"parameters.json", "report.html", "study.html"}
    page = (folder / "results/report.html").read_text()
    assert ": reduced models beside" in page and "verdict.html" not in page and "paper of 2006" not in page
    page = (folder / "results/study.html").read_text()
    assert "Cylinder mine: open, 2 runs each" in page and "Cylinder second: other, 1 run each" in page
    own, grid = (folder / "results" / name for name in ("study/mine.nc", "exact/replay/open.nc"))
    with xr.open_dataset(own) as mine, xr.open_dataset(grid) as cell:
        assert (mine["mse"].isel(experiment=0, run=0).values == cell["mse"].values).all()


def test_truncated_datum_is_named_and_not_used(smoke, tmp_path):
    folder = tmp_path / "truncated"
    shutil.copytree(smoke, folder)
    datum = folder / "results/datum/E06.nc"
    datum.write_bytes(datum.read_bytes()[:1000])
    replay = folder / "results/exact/replay/E06.nc"
    replay.unlink()
    done = snakemake(folder, "-j1", "--rerun-triggers", "mtime", *SMOKE)
    assert done.returncode != 0
    assert not replay.exists()
    report = done.stderr + "".join(file.read_text() for file in (folder / "results/logs").rglob("*.log"))
    assert "results/datum/E06.nc: does not end with its SHA-256" in report
