"""Ranking and intervals, on cells whose answer is known beforehand."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from ranked_cells import LEVEL, made
from scipy import stats

from pneumo.physics.models import MODELS
from pneumo.selection.ranking import rank_models
from pneumo.statistics.intervals import student_interval


def order_of(cells, cylinder="mine"):
    return rank_models(cells, cylinder).table.index.tolist()


def test_order_n_and_numbers_of_a_row():
    assert order_of(made()) == sorted(LEVEL, key=lambda name: LEVEL[name])
    cells = made(experiments=("X", "Y"))
    table = rank_models(cells, "mine").table
    assert table["place"].tolist() == list(range(1, len(MODELS) + 1)) and np.isnan(table["best_n"]["M1"])
    row, errors = table.loc["M6"], cells["mse"].sel(model="M6", n=1.3)
    per_run = errors.mean(("experiment", "chamber")).values
    low, high = stats.t.interval(0.95, 3, loc=per_run.mean(), scale=stats.sem(per_run))
    found = row[["best_n", "best_mse", "best_mse_low", "best_mse_high"]].tolist()
    assert found == pytest.approx([1.3, per_run.mean(), low, high])
    assert row[["rms_A", "rms_B"]].tolist() == pytest.approx(errors.mean(("experiment", "run")).values ** 0.5)


def test_the_best_n_is_that_of_all_runs_and_experiments_together():
    cells = made(experiments=("X", "Y"), runs=4, noise=0.0)
    times = np.ones((2, 4, 3))
    times[0, 0] = 0.1, 3.0, 3.0  # the first run asks for 1.2, all others for 1.4
    times[0, 1:], times[1] = (3.0, 3.0, 0.5), (3.0, 3.0, 0.5)
    dims = ("experiment", "run", "n")
    ranking = rank_models(cells.assign(mse=cells["mse"] * xr.DataArray(times, dims=dims)), "mine")
    assert ranking.table["best_n"]["M6"] == 1.4


def test_paired_comparison_is_sharper_than_two_intervals():
    table = rank_models(made(noise=0.3, runs=6, level=LEVEL | {"M9": 2.0, "M10": 2.4}), "mine").table
    assert table.index[:2].tolist() == ["M9", "M10"]
    first, second = table.iloc[0], table.iloc[1]
    assert second["best_mse_low"] < first["best_mse_high"]  # one by one they overlap,
    assert second["over_best_low"] > 1  # run by run they don't
    assert second["over_best"] == pytest.approx(1.2, rel=0.05)
    cells = made(runs=3)
    cells["random"][:] = 0
    assert rank_models(cells, "mine").table["best_mse_high"].isna().all()  # one run has no error bars


def test_failed_full_order_run_is_left_out_and_reported():
    cells = made(runs=4)
    cells["mse"][0, 1] = np.nan
    cells["run_status"][0, 1] = 1
    cells["run_failure_time"][0, 1] = 0.25
    ranking = rank_models(cells, "mine")
    assert ranking.runs == 3 and ranking.left_out == ("X, seed 1: diverged at 0.25 s",)
    assert ranking.table["failed"]["M8"] == 0
    cells["run_status"][:] = 1
    nothing = rank_models(cells, "mine")
    assert nothing.runs == 0 and nothing.table.empty


@pytest.mark.parametrize("where", [{"run": 2}, {"run": 2, "experiment": "Y"}])
def test_failed_model_comes_last_and_an_n_that_failed_is_not_taken(where):
    cells = made(experiments=("X", "Y"))
    cells["mse"].loc[{"model": "M10", **where}] = np.nan
    cells["mse"].loc[{"model": "M8", "n": 1.3, "run": 0}] = np.nan
    table = rank_models(cells, "mine").table
    last = table.iloc[-1]
    assert last.name == "M10" and last["place"] == len(MODELS) and last["failed"] == 3 - len(where)
    assert last[["best_mse", "rms_A", "rms_B"]].isna().all()  # not the mean of the runs that it survived
    assert table["best_n"]["M8"] in (1.2, 1.4)


def test_cylinders_are_ranked_separately():
    cells = made(experiments=("X", "Y"))
    cells["mse"].loc[{"experiment": "Y", "model": "M1"}] = 1.0
    ranking = rank_models(cells, "mine")
    assert ranking.table.index[0] == "M10" and ranking.by_experiment["M1"]["Y"] == pytest.approx(1.0)
    separate = cells.assign_coords(cylinder=("experiment", ["mine", "other"]))
    assert order_of(separate, "other")[0] == "M1" and order_of(separate)[0] == "M10"


@given(st.lists(st.lists(st.floats(0.1, 1e3), min_size=3, max_size=3), min_size=1, max_size=5))
def test_interval_is_students(samples):
    samples = np.array(samples)
    mean, low, high = student_interval(samples)
    scale = np.maximum(stats.sem(samples, axis=1), 1e-300)
    expected = stats.t.interval(0.95, 2, samples.mean(1), scale)
    np.testing.assert_allclose(mean, samples.mean(1))
    np.testing.assert_allclose([low, high], expected, rtol=1e-9, atol=1e-9)
