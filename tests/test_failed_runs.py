"""Runs that fail: a status with time and state, left out of averages, named by table and page."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from paper_study import STUDY
from printed_study import save

from paper.study.averages import statistics
from paper.study.figures.paper_figures import fig07
from paper.study.settling_run import settle, settling_dataset
from paper.study.stored_runs import datum_dataset, failure_text
from paper.study.text.explain import cell_text
from pneumo.configuration.sampling import EXACT_SAMPLING
from pneumo.simulation.full_order import DIVERGED, NOT_POSITIVE, failure, record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import NO_RUN, replay
from pneumo.storage.files import open_grid, read
from pneumo.storage.layout import replay_dataset

pytestmark = pytest.mark.xdist_group("printed")
E06 = STUDY.experiments["E06"]._replace(steps=300)
CHANGES = {  # what makes a step of 1 ms too long: of cylinder and valve
    "tiny volume": ({"V_d_A": 1e-12, "V_d_B": 1e-12}, {"k_xu": 1e-5}),
    "huge flow": ({}, {"k_xu": 1e-4}),
    "no mass": ({"M": 1e-4}, {}),
}
STATUSES = {"tiny volume": DIVERGED, "huge flow": DIVERGED, "no mass": NOT_POSITIVE}


def broken(name):
    plant, (cylinder, valve) = E06.plant, CHANGES[name]
    changed = {"cylinder": plant.cylinder._replace(**cylinder), "valve": plant.valve._replace(**valve)}
    return E06._replace(plant=plant._replace(**changed))


@pytest.mark.parametrize("name", CHANGES)
def test_a_run_that_fails_has_status_time_and_state(name):
    recording = record(broken(name))
    status, step = failure(recording.states)
    assert status == STATUSES[name]
    assert step > 0
    assert np.isnan(recording.states[step + 1 :]).all()
    datum = datum_dataset(broken(name), recording)
    assert datum["status"].attrs["flag_values"][int(datum["status"])] == status
    assert datum["failure_time"] == step * E06.h
    np.testing.assert_array_equal(datum["status"].attrs["last_state"], recording.states[step - 1])
    assert f"failed at t = {step * E06.h:g} s: " in failure_text(datum)


@pytest.mark.parametrize("name", CHANGES)
def test_a_settling_run_that_fails_has_no_settling_times(name):
    run = settle(broken(name))
    assert (run.status, run.failure_step) == failure(run.states)
    assert np.isnan(run.times).all() and run.failure_step > 0
    assert np.isnan(run.states[run.failure_step + 1 :]).all()
    dataset, seconds = settling_dataset(E06, run), run.failure_step * E06.h
    assert dataset["failure_time"] == seconds
    assert f"E06: settling run failed at t = {seconds:g} s: " in fig07(dataset, {}).texts[0].get_text()


def replays_of(experiment, recording):
    lanes, index = grid_lanes(STUDY.n, 1.4)
    cells = replay(recording, lanes, EXACT_SAMPLING, experiment.pressure_stride)
    return replay_dataset(experiment, STUDY.n, index, cells)


@pytest.fixture(scope="module")
def folder(printed_once, tmp_path_factory):
    """The printed study, but E06 failed."""
    folder = Path(shutil.copytree(printed_once, tmp_path_factory.mktemp("failed") / "results"))
    experiment = broken("no mass")
    recording = record(experiment)
    save(datum_dataset(experiment, recording), folder / "datum" / "E06.nc")
    for transport in ("published", "exact"):
        save(replays_of(experiment, recording), folder / transport / "replay" / "E06.nc")
        grid = open_grid(folder / transport)
        save(statistics(grid, STUDY.experiments_by_level), folder / transport / "statistics.nc")
    return folder


def test_no_replays_of_a_run_that_failed(folder):
    cells = read(folder / "exact" / "replay" / "E06.nc")
    assert bool((cells["status"] == NO_RUN).all())
    assert cells["status"].attrs["flag_meanings"].split()[NO_RUN] == "no_full-order_run"
    assert bool((cells["failure_time"] == E06.h).all())
    assert bool(cells[["mse", "mean_error", "variance"]].isnull().all().to_array().all())
    text = cell_text(folder, "E06", "M8", 1.35)
    assert text.count("failed at t = 0.001 s: no full-order run") == 4
    assert "best n" not in text


def test_averages_leave_a_failed_run_out_and_count_the_others(folder):
    table = read(folder / "published" / "statistics.nc")
    counts = {"overall": 15, "adiabatic": 7, "typical": 7, "isothermal": 8}
    assert table["experiments"].to_series().to_dict() == counts
    others = open_grid(folder / "published").drop_sel(experiment="E06")
    expected = statistics(others, STUDY.experiments_by_level)
    for name in ("mse", "mean_error", "std", "p10", "p90", "constant_n"):
        np.testing.assert_array_equal(table[name], expected[name])
    assert bool(table["best_n"].sel(experiment="E06").isnull().all())
    time = table["failure_time"]
    assert time.dropna("experiment").to_series().to_dict() == {"E06": E06.h}
