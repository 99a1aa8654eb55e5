"""Assumptions toggled one at a time, on two experiments of a second."""

import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
import yaml
from typer.testing import CliRunner

from pneumo.cli.commands import app
from pneumo.configuration.parameters import load, study
from pneumo.configuration.study_json import to_json
from pneumo.errors import ResultError
from pneumo.evidence import toggles
from pneumo.evidence.alternatives import IN_WORDS, OTHER_TRANSPORTS, Alternative, ledger_alternatives
from pneumo.evidence.amplitudes import tried_transports
from pneumo.evidence.other_runs import first_draw_skipped, keeps_changed_sign, largest_excursions
from pneumo.evidence.toggle_effects import toggle_effects
from pneumo.evidence.toggles import TOGGLED_TABLES, toggled_tables
from pneumo.papers.paper_2006.paper import PAPER_2006
from pneumo.physics.cylinder import motion
from pneumo.publish.figures.toggles_figure import tornado
from pneumo.publish.text.markdown_tables import assumptions_table
from pneumo.simulation.excitation import command, reference_series
from pneumo.simulation.full_order import record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.simulation.settling import Settling, settle
from pneumo.simulation.signals import study_transport
from pneumo.statistics.averages import statistics
from pneumo.statistics.settling_times import settling_table
from pneumo.storage.files import open_grid, read, write, write_json
from pneumo.storage.grid_layout import replay_dataset
from pneumo.storage.layout import settling_dataset
from pneumo.verdict import PaperError
from pneumo.verdict.assumptions import AS_TAKEN, read_assumptions
from pneumo.verdict.claims import read_claims
from pneumo.verdict.judging import Judge
from pneumo.verdict.sources import MissingEvidence, PrintedTables

pytestmark = pytest.mark.xdist_group("printed")
ROOT = Path(__file__).parents[2]
CONFIG = yaml.safe_load((ROOT / "config/paper.yaml").read_text(encoding="utf-8"))
TINY = CONFIG | {"run": {"experiments": ["E06", "E12"], "duration_limit_s": 1.0}}
PAPER = study(load(ROOT / "config/paper.yaml"))
CLAIMS = read_claims()


@pytest.fixture
def paper(tmp_path) -> Path:
    """A ledger that a test may spoil."""
    (tmp_path / "paper").mkdir()
    return Path(shutil.copy(ROOT / "paper/2006/assumptions.yaml", tmp_path / "paper")).parent


def edit(file: Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")


@pytest.fixture(scope="module")
def tiny() -> xr.DataArray:
    chosen = (AS_TAKEN, "mass_D.mass_D_1", "settling_change.largest_excursion", "transport.exact_transport")
    chosen += ("error_sign.reduced_minus_full", "variance_of_means.population", "hold.hold_shorter")
    every = ledger_alternatives(TINY)
    return toggled_tables({name: every[name] for name in chosen}, CLAIMS.items, 2)["reproduced"]


# The ledger


def test_every_alternative_runs_or_carries_a_reason():
    found = ledger_alternatives(CONFIG)
    ledger = read_assumptions()
    named = {f"{name}.{alternative}" for name, entry in ledger.items() for alternative in entry.alternatives}
    assert set(found) == {AS_TAKEN, *named}
    assert set(IN_WORDS) <= named
    for name, entry in ledger.items():
        assert not set(entry.left_out) & set(entry.alternatives), name
        assert all(len(reason.split()) > 5 for reason in entry.left_out.values()), name
    nameless = {
        name: case._replace(study=case.study._replace(config_sha256="")) for name, case in found.items()
    }
    for name, case in nameless.items():
        assert name == AS_TAKEN or case != nameless[AS_TAKEN], name


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "{cylinders.D.mass_kg: 1.0}",
            "{cylinders.D.mass_g: 1.0}",
            "assumptions.yaml: mass_D.mass_D_1: cylinders.D.mass_g = 1.0: unknown key",
        ),
        (
            "{cylinders.D.mass_kg: 1.0}",
            "{cylinders.D.mass_kg: -1.0}",
            "assumptions.yaml: mass_D.mass_D_1: cylinders.D.mass_kg = -1.0: must be a number greater than 0",
        ),
        ("    population: N\n", "    unheard_of: N\n", "variance_of_means.unheard_of: no code for 'N'"),
        ("  left_out:", "  left_off:", "assumptions.yaml: step.left_off: Extra inputs are not permitted"),
    ],
)
def test_what_cannot_be_run_is_one_line(paper, old, new, words):
    edit(paper / "assumptions.yaml", old, new)
    with pytest.raises(PaperError, match=re.escape(words)) as raised:
        ledger_alternatives(CONFIG, paper)
    assert "\n" not in str(raised.value)


# The run


def test_baseline_is_what_the_verdict_finds(tiny, tmp_path):
    two = ledger_alternatives(TINY)[AS_TAKEN].study
    (tmp_path / "published/replay").mkdir(parents=True)
    write_json(to_json(two), tmp_path / "parameters.json")
    for name, e in two.experiments.items():
        lanes, index = grid_lanes(two.n, e.plant.gas.gamma)
        cells = replay(record(e), lanes, study_transport("published", two.lag, e.h))
        write(replay_dataset(e, two.n, index, cells), tmp_path / f"published/replay/{name}.nc", {})
    found = statistics(open_grid(tmp_path / "published"), two.experiments_by_level)
    write(found, tmp_path / "published/statistics.nc", {})
    parts = {name: settling_dataset(e, settle(e)) for name, e in two.experiments.items()}
    write(settling_table(parts, dict.fromkeys(parts, 1.0)), tmp_path / "settling.nc", {})

    judge = Judge(tmp_path, PAPER_2006)
    numbers = 0
    for name in tiny["item"].values.tolist():
        found = tiny.sel(alternative=AS_TAKEN, item=name).item()
        try:
            assert judge.finding(CLAIMS.items[name], "published").value == pytest.approx(found, rel=1e-12)
            numbers += 1
        except MissingEvidence:
            assert np.isnan(found), name
    assert numbers == 120


def test_items_are_the_cells_of_the_four_tables(tiny):
    assert {CLAIMS.items[name].table for name in tiny["item"].values.tolist()} == set(TOGGLED_TABLES)
    assert tiny.sizes["item"] == 64 + 30 + 96 + 90


def test_an_alternative_changes_what_it_touches_only(tiny):
    def changed(alternative: str) -> set[tuple[int, str]]:
        here, taken = tiny.sel(alternative=alternative), tiny.sel(alternative=AS_TAKEN)
        names = tiny["item"].values[((here != taken) & (here.notnull() | taken.notnull())).values]
        return {(CLAIMS.items[name].table, CLAIMS.items[name].column) for name in names.tolist()}

    assert {table for table, _ in changed("mass_D.mass_D_1")} >= {5, 7, 9}
    assert {column for _, column in changed("settling_change.largest_excursion")} == {"P_A"}
    assert {table for table, _ in changed("hold.hold_shorter")} == {5}
    assert {table for table, _ in changed("transport.exact_transport")} >= {7, 9}
    assert not [table for table, _ in changed("transport.exact_transport") if table == 5]
    assert changed("error_sign.reduced_minus_full") == {(7, "mu"), (9, "mu")}
    assert changed("variance_of_means.population") == {(7, "sigma"), (9, "sigma")}
    signs = [
        tiny.sel(alternative=name, item="T7.M5.mu").item()
        for name in (AS_TAKEN, "error_sign.reduced_minus_full")
    ]
    assert signs[0] == -signs[1] != 0


def test_a_run_that_does_not_settle_has_no_number(monkeypatch):
    monkeypatch.setattr(toggles, "LONGEST_SETTLING", 5.0)
    found = toggled_tables({AS_TAKEN: ledger_alternatives(TINY)[AS_TAKEN]}, CLAIMS.items)["reproduced"][0]
    assert found.sel(item=["T5.E06.P_A", "T5.E12.T_B"]).isnull().all()
    assert found.sel(item="T7.M8.mse").notnull()


def test_the_same_call_gives_the_same_numbers():
    one = {AS_TAKEN: ledger_alternatives(TINY)[AS_TAKEN]}
    first, second = (toggled_tables(one, CLAIMS.items, threads) for threads in (1, 2))
    xr.testing.assert_identical(first, second)


# The variants


def test_a_rod_takes_its_own_section_from_both_areas():
    change = IN_WORDS["rod.rod_40_percent"](Alternative(PAPER))
    for name, experiment in PAPER.experiments.items():
        cylinder, other = experiment.plant.cylinder, change.study.experiments[name].plant.cylinder
        rod = np.pi / 4 * (0.4 * cylinder.bore) ** 2
        np.testing.assert_allclose([other.A_A, other.A_B], [cylinder.A_A - rod, cylinder.A_B - rod])


@pytest.mark.parametrize(
    ("toggled", "tried"),
    [
        ("hold", "hold"),
        ("command_late", "linear, u a sample late"),
        ("last_stage_late", "linear, last stage held"),
        ("exact_transport", "exact"),
    ],
)
def test_other_transports_are_those_of_the_identification(toggled, tried):
    ours, theirs = OTHER_TRANSPORTS[toggled].reading, tried_transports(1e-3)[tried].reading
    assert (ours.exact, ours.held, ours.every) == (theirs.exact, theirs.held, theirs.every)
    np.testing.assert_array_equal(ours.late, theirs.late)


def test_the_toggled_sequence_changes_sign_at_every_crossing():
    e = PAPER.experiments["E11"]
    e = e._replace(steps=20_000, drive=e.drive._replace(x_reverse=0.3 * e.plant.cylinder.x_max))
    plain = reference_series(e.drive, e.excitation, e.steps)
    run = keeps_changed_sign(e)
    flipped = np.flatnonzero(np.diff(run.reference * plain))
    assert len(flipped) > 3
    assert np.array_equal(np.abs(run.reference), np.abs(plain))
    x = run.states[:, 0]
    assert np.all(np.abs(x[flipped + 1]) >= e.drive.x_reverse)  # only there does it change
    outside = np.abs(x[:-1]) >= e.drive.x_reverse
    assert np.all(run.reference[:-1][outside] * x[:-1][outside] <= 0)
    assert all(command(run.reference[k], x[k], e.drive) == run.u[k] for k in range(0, e.steps, 97))


@pytest.mark.parametrize("name", ["E05", "E06"])
def test_without_a_crossing_the_toggled_sequence_is_the_plain_one(name):
    e = PAPER.experiments[name]._replace(steps=300)
    for toggled, plain in zip(keeps_changed_sign(e)[:3], record(e)[:3], strict=True):
        assert np.array_equal(toggled, plain)


def test_the_first_draw_is_skipped():
    e = PAPER.experiments["E06"]._replace(steps=1000)
    every = e.excitation.every
    skipped, plain = first_draw_skipped(e).reference, record(e).reference
    assert len(skipped) == len(plain)
    assert np.array_equal(skipped[:-every], plain[every:])


def test_largest_excursions_of_both_quantities():
    # From 0 to rest at 1, up to 4: 1 % of the largest excursion from rest is 0.03, of the change 0.01.
    overshoot = np.array([0.0, 2.0, 4.0, 3.0, 2.0, 1.5, 1.035, 1.025, 1.0, 1.0])
    settling = Settling(np.zeros(4), np.outer(np.r_[9.0, overshoot], np.ones(6)), 1)
    np.testing.assert_allclose(largest_excursions(settling, 0.1), 0.7)


def test_without_the_rest_rule_a_stop_only_clips():
    cylinder = PAPER.experiments["E06"].plant.cylinder
    assert motion(cylinder.x_min, 0.0, -1.0, cylinder) == (0.0, 0.0)
    assert motion(cylinder.x_min, 0.0, -1.0, cylinder._replace(rests=False)) == (0.0, -1.0)


# The effects


@pytest.fixture
def invented(tmp_path) -> xr.DataArray:
    """The print as the study, and alternatives that are off by a known factor."""
    printed = PrintedTables(tmp_path)
    items = {name: claim for name, claim in CLAIMS.items.items() if claim.table in TOGGLED_TABLES}
    values = np.array([np.nan if claim.unreadable else claim.value for claim in items.values()])
    mse = np.array([claim.column == "mse" for claim in items.values()])
    table_8 = np.array([claim.table == 8 for claim in items.values()])
    rows = {
        AS_TAKEN: values,
        "step.step_2_ms": values * np.where(mse, 1.2, 1.0),
        "friction.friction_80": values + 0.05 * table_8,
    }
    assert printed.statistics is not None
    coords = {"alternative": list(rows), "item": list(items)}
    return xr.DataArray(list(rows.values()), coords, ("alternative", "item"))


def test_effects_of_known_changes(invented):
    found = toggle_effects(invented, CLAIMS)
    assert (
        found.loc[AS_TAKEN, ["misfit_5", "misfit_7", "misfit_9", "changed_8", "no_number"]].tolist()
        == [0] * 5
    )
    assert found.loc[AS_TAKEN, ["exact_8", "within_5", "inside"]].tolist() == [96, 61, 277]
    larger = found.loc["step.step_2_ms"]
    assert larger[["largest_7", "rms_9", "misfit_7", "worse_9"]].tolist() == pytest.approx([np.log(1.2)] * 4)
    assert larger[["largest_5", "changed_8"]].tolist() == [0, 0]
    assert larger["inside"] == 277 - 40
    shifted = found.loc["friction.friction_80"]
    assert shifted[["changed_8", "exact_8", "rms_7"]].tolist() == [96, 0, 0]


def test_effects_are_told_against_the_study_and_misfits_against_the_print(invented):
    mse = np.array([CLAIMS.items[name].column == "mse" for name in invented["item"].values.tolist()])
    table_8 = np.array([CLAIMS.items[name].table == 8 for name in invented["item"].values.tolist()])
    off = invented * np.where(mse, 1.1, 1.0) + 0.05 * table_8  # all, the study too
    nearer = off.sel(alternative=AS_TAKEN) / np.where(mse, 1.05, 1.0)
    found = toggle_effects(
        xr.concat([off, nearer.assign_coords(alternative="hold.nearer")], "alternative"), CLAIMS
    )
    larger = found.loc["step.step_2_ms"]
    assert larger[["largest_7", "misfit_7", "worse_7"]].tolist() == pytest.approx(np.log([1.2, 1.32, 1.2]))
    assert found.loc["hold.nearer", ["rms_9", "worse_9"]].tolist() == pytest.approx(
        [np.log(1.05), -np.log(1.05)]
    )
    assert (
        found.loc[["step.step_2_ms", "hold.nearer"], ["changed_8", "exact_8"]].values.tolist() == [[0, 0]] * 2
    )
    figure = tornado(found)
    assert [tick.get_text() for tick in figure.axes[0].get_yticklabels()] == ["nearer", "step 2 ms"]
    colours = {patch.get_width() < 0: patch.get_facecolor() for patch in figure.axes[0].patches}
    nearer, farther = figure.legends[0].get_patches()
    assert [nearer.get_label(), farther.get_label()] == ["nearer to the print", "farther from it"]
    assert [nearer.get_facecolor(), farther.get_facecolor()] == [colours[True], colours[False]]


def test_a_run_that_does_not_rest_is_marked(invented):
    restless = invented.copy()
    restless.loc["step.step_2_ms", "T5.E06.P_A"] = np.nan
    found = toggle_effects(restless, CLAIMS)
    assert found.loc["step.step_2_ms", "no_number"] == 1
    figure = tornado(found)
    assert [tick.get_text() for tick in figure.axes[0].get_yticklabels()] == ["step 2 ms *"]
    assert "* some settling runs do not come to rest" in figure.texts[-1].get_text() + str(
        figure._supxlabel.get_text()
    )


def test_table_and_tornado(invented):
    found = toggle_effects(invented, CLAIMS)
    text = assumptions_table(found)
    assert "| step | step_2_ms | 0.000, 0.000 | 0.182, 0.182 | 0.182, 0.182 | 0 |" in text
    figure = tornado(found)
    assert [tick.get_text() for tick in figure.axes[0].get_yticklabels()] == ["step 2 ms"]
    assert figure.axes[0].patches[0].get_width() == pytest.approx(np.log(1.2))
    nothing = tornado(pd.DataFrame(found.loc[[AS_TAKEN]]))
    assert not nothing.axes[0].patches


def test_command_line_prints_the_table(invented, tmp_path):
    write(invented.to_dataset(name="reproduced"), tmp_path / "assumptions.nc", {})
    done = CliRunner().invoke(app, ["paper", "assumptions", "--results", str(tmp_path)])
    assert done.stdout == assumptions_table(toggle_effects(invented, CLAIMS))
    with pytest.raises(ResultError, match="`snakemake -j2 evidence` makes it"):
        CliRunner().invoke(
            app, ["paper", "assumptions", "--results", str(tmp_path / "x")], catch_exceptions=False
        )


@pytest.mark.results
def test_the_recorded_baseline_is_the_study(results):
    if not (results / "assumptions.nc").exists():
        pytest.skip("results/assumptions.nc is not there: `snakemake -j2 evidence` makes it")
    toggled = read(results / "assumptions.nc")["reproduced"].sel(alternative=AS_TAKEN)
    judge = Judge(results, PAPER_2006)
    found = [judge.finding(judge.claims.items[name], "published").value for name in toggled["item"].values]
    np.testing.assert_allclose(toggled, found, rtol=1e-9)


def test_an_alternative_that_nobody_ran_explains_nothing(printed_once):
    judge = Judge(printed_once, PAPER_2006)
    assert judge.alternatives is None
    claim = CLAIMS.items["T5.E14.P_A"].model_copy(
        update={"assumption": "hold.hold_longer", "printed": "9.99"}
    )
    assert judge.judge(claim)["status"] == "missed"
    labels = {"alternative": ["hold.hold_shorter"], "item": ["T5.E14.P_A"]}
    judge.alternatives = xr.DataArray([[9.99]], labels)
    assert judge.judge(claim)["status"] == "missed"
    judge.alternatives = judge.alternatives.assign_coords(alternative=["hold.hold_longer"])
    assert judge.judge(claim)["status"] == "explained"
