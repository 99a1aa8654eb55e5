"""Setups of the open loops: reversals that are recorded late, the study's own cells, and the choice."""

import io

import numpy as np
import pytest
import xarray as xr
from paper_study import STUDY
from rich.console import Console

from pneumo.errors import ResultError
from pneumo.evidence.identification.open_loop import (
    CRITERIA,
    PairErrors,
    choose_open_loop,
    penalty,
)
from pneumo.evidence.identification.open_loop_cells import (
    OPTIONS,
    SETUPS,
    OpenLoopSetup,
    configured_setup,
    draws_of,
    joined_cells,
    open_loop_cells,
    reversals,
    reversed_late,
    setup_coordinates,
    with_setup,
)
from pneumo.evidence.seeds.seed_sets import read_seed_sets
from pneumo.papers.paper_2006.numbers_of_tables import TABLES
from pneumo.papers.paper_2006.paper_models import PAPER_MODELS
from pneumo.papers.paper_2006.table_likelihood import TableLikelihood, numbers_of_seed_sets
from pneumo.publish.text.terminal_tables import open_loop_tables
from pneumo.simulation.full_order import record
from pneumo.storage.grid_layout import replayed_grid
from pneumo.storage.kept_evidence import KEPT

OPEN = [name for name, e in STUDY.experiments.items() if not e.drive.closed_loop]
SEEDS = read_seed_sets(KEPT / "seed_sets.nc")


def test_a_late_reversal_by_hand():
    draws = np.array([0.8, 0.8, 0.8, -0.8, -0.8])
    u = np.array([0.8, 0.8, -0.8, 0.8, -0.8])  # reversed from the third sample to the fourth; a draw between
    assert reversed_late(u, draws, 0.0).tolist() == u.tolist()
    assert reversed_late(u, draws, 1.0).tolist() == [0.8, 0.8, 0.8, 0.8, 0.8]
    assert reversed_late(u, draws, 0.5).tolist() == pytest.approx([0.8, 0.8, 0.0, 0.8, 0.0])
    assert reversed_late(u, draws, 0.25) == pytest.approx([0.8, 0.8, -0.4, 0.8, -0.4])
    assert reversed_late(u[2:], draws[2:], 1.0).tolist() == [
        -0.8,
        0.8,
        0.8,
    ]  # the first sample has none before
    assert reversed_late(draws, draws, 1.0).tolist() == draws.tolist()  # a draw alone is on time


def test_there_are_144_setups_and_todays_is_one_of_each_cylinders():
    assert len(set(SETUPS)) == 144 and len(SETUPS) ** 2 == 20_736
    assert configured_setup(STUDY, "D") == (1.0, "toggled", "each step", "linear", 0.8)
    assert configured_setup(STUDY, "E") == (1.0, "forced", "each step", "linear", 0.3**0.5)
    for cylinder in ("D", "E"):
        assert configured_setup(STUDY, cylinder) in SETUPS
    coordinates = setup_coordinates()
    for position in (0, 77, 143):
        assert tuple(coordinates[key].values[position] for key in OpenLoopSetup._fields) == SETUPS[position]


@pytest.mark.parametrize("name", OPEN)
def test_todays_setup_gives_the_studys_own_cells(name):
    experiment = STUDY.experiments[name]._replace(steps=3000)
    setup = configured_setup(STUDY, experiment.cylinder)
    e = with_setup(
        experiment._replace(drive=experiment.drive._replace(toggles=not experiment.drive.toggles, late=0.0)),
        setup,
    )
    assert e == experiment
    on_time = record(with_setup(experiment, setup._replace(late=0.0)))
    recorded = on_time._replace(u=reversed_late(on_time.u, draws_of(e), setup.late))
    np.testing.assert_array_equal(recorded.u, record(e).u)
    expected = replayed_grid(experiment, STUDY.n, record(experiment), experiment.sampling, experiment.steps)
    for values, quantity in zip(joined_cells(STUDY, e, recorded), ("mean_error", "mse"), strict=True):
        np.testing.assert_array_equal(values, expected[quantity].mean("chamber").transpose("model", "n"))


def test_reversals_of_a_run_are_counted():
    e = STUDY.experiments["E15"]._replace(steps=2000)
    recording, draws = record(e), draws_of(e)
    assert reversals(recording._replace(u=draws), draws) == 0
    for_a_while = np.where(np.arange(len(draws)) // 500 == 1, -draws, draws)
    assert reversals(recording._replace(u=for_a_while), draws) == 2
    once = np.where(np.arange(len(draws)) < 700, draws, -draws)
    assert reversals(recording._replace(u=once), draws) == 1


def test_penalties_by_hand():
    same = OpenLoopSetup(1.0, "forced", "each step", "linear", 0.5)
    assert penalty((same, same)) == pytest.approx(2 * np.log(3 * 2 * 2 * 3 * 4))
    other = same._replace(amplitude=0.8, late=0.5)
    assert penalty((same, other)) - penalty((same, same)) == pytest.approx(2 * np.log(4 * 3))


@pytest.fixture(scope="module")
def invented() -> xr.Dataset:
    """Cells in which one setup of D and one of E give the study's errors, and all others larger ones."""
    cells = (
        SEEDS.sel(transport="published", model=list(PAPER_MODELS)).isel(seeds=0).squeeze("chamber", drop=True)
    )
    cells = cells.transpose("experiment", "model", "n")
    factor = np.full((len(OPEN), 1, 1, len(SETUPS)), 1.3)
    for i, name in enumerate(OPEN):
        factor[i, ..., GOOD[STUDY.experiments[name].cylinder]] = 1.0
    closed = [name for name in STUDY.experiments if name not in OPEN]
    by_setup, by_run = ("open_loop", "model", "n", "setup"), ("closed_loop", "model", "n")
    data = {"reversals": (("open_loop", "setup"), np.zeros((len(OPEN), len(SETUPS)), dtype=np.int32))}
    for name in ("mean_error", "mse"):
        larger = factor if name == "mse" else factor**0.5
        data[name] = (by_setup, cells[name].sel(experiment=OPEN).values[..., np.newaxis] * larger)
        data[f"closed_{name}"] = (by_run, cells[name].sel(experiment=closed).values)
    coords = {"model": list(PAPER_MODELS), "n": list(STUDY.n), "open_loop": OPEN, "closed_loop": closed}
    return xr.Dataset(data, coords | setup_coordinates())


GOOD = {"D": 17, "E": 101}


def test_the_pair_that_meets_the_tables_is_chosen(invented):
    choice = choose_open_loop(STUDY, invented, SEEDS, lambda text: None)
    first = choice.sel(pair="1")
    assert first["setup_number"].values.tolist() == [17, 101]
    assert int(np.argmin(choice["score"].values)) == 17 * 144 + 101
    over_seeds = numbers_of_seed_sets(STUDY, SEEDS)
    likelihood = TableLikelihood(over_seeds)
    expected = likelihood.chi_square(over_seeds[0], TABLES) + penalty((SETUPS[17], SETUPS[101]))
    assert first["scores"].values[0] == pytest.approx(expected) == choice["score"].min().item()
    today = choice.sel(pair="today")
    assert today["scores"].values[0] > expected and today["place"] > 1
    assert choice["pair"].values[:20].tolist() == [str(k + 1) for k in range(20)]
    assert (np.diff(choice["scores"].isel(pair=slice(20), criterion=0)) >= 0).all()
    for k, name in enumerate(CRITERIA[1:], start=1):
        best = choice["scores"].sel(pair=f"best by {name}").values[k]
        assert best <= choice["scores"].isel(criterion=k).min().item()
    np.testing.assert_array_equal(
        choice["mse"].sel(experiment=OPEN[0]), PairErrors(STUDY, invented)(17, 101)[1, 0]
    )
    assert all(values.attrs["long_name"] for values in choice.data_vars.values())
    console = Console(width=160, file=io.StringIO())
    for table in open_loop_tables(choice):
        console.print(table)
    assert "20736 pairs tried" in console.file.getvalue()


@pytest.mark.slow
def test_a_pair_with_a_failed_cell_comes_last(invented):
    failed = invented.copy(deep=True)
    failed["mse"].loc[{"open_loop": "E13", "model": "M8", "setup": GOOD["D"]}] = np.nan
    choice = choose_open_loop(STUDY, failed, SEEDS, lambda text: None)
    assert np.isinf(choice["score"].values[17]).all() and np.isfinite(choice["score"].values[16]).all()
    assert choice["setup_number"].sel(pair="1").values[0] != 17


def test_a_part_of_the_study_has_no_tables(invented):
    part = STUDY._replace(experiments={name: STUDY.experiments[name] for name in OPEN})
    with pytest.raises(ResultError, match="Tables 7 and 9 need all 16 experiments"):
        choose_open_loop(part, invented, SEEDS, lambda text: None)


def test_the_papers_own_seeds_are_nearest_to_its_tables():
    over_seeds = numbers_of_seed_sets(STUDY, SEEDS)
    likelihood = TableLikelihood(over_seeds)
    assert likelihood.shrinkage == pytest.approx(0.0727, abs=1e-4)
    expected = {"T7": (30.1, 1), "T9": (386.9, 1), "T8": (105.4, 3), "p10": (32.0, 1), "p90": (61.5, 1)}
    for table, (own, place) in expected.items():
        values = likelihood.chi_square(over_seeds, (table,), "printed")
        assert values[0] == pytest.approx(own, abs=0.05), table
        assert 1 + np.count_nonzero(values < values[0]) == place, table
    assert likelihood.chi_square(over_seeds, TABLES, "printed")[0] == pytest.approx(738.0, abs=0.1)


@pytest.mark.slow
def test_a_short_search_has_each_run_once_and_replays_it_with_every_setup(monkeypatch):
    names = ("E13", "E15", "E16")
    brief = {name: STUDY.experiments[name]._replace(steps=400) for name in names}
    part, said = STUDY._replace(experiments=brief, n=(1.2, 1.4)), []
    cells = open_loop_cells(part, 2, said.append)
    assert len(said) == 2 and cells["mse"].notnull().all() and cells["closed_mse"].notnull().all()
    for name in names[:2]:
        setup = configured_setup(STUDY, brief[name].cylinder)
        e = with_setup(brief[name], setup)
        values = joined_cells(part, e, record(e))
        stored = cells.sel(open_loop=name).isel(setup=SETUPS.index(setup))
        np.testing.assert_array_equal(stored["mean_error"], values[0])
        np.testing.assert_array_equal(stored["mse"], values[1])
    by_amplitude = (
        cells["mse"]
        .sel(model="M8", n=1.4, open_loop="E13")
        .values.reshape(*(len(options) for options in OPTIONS.values()))
    )
    assert len(np.unique(by_amplitude[0, 0, 0, 0])) == len(OPTIONS["amplitude"])
