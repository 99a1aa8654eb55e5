"""Ranking and intervals, on cells whose answer is known beforehand."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from ranked_cells import LEVEL, made
from scipy import stats

from pneumo.physics.models import MODELS
from pneumo.statistics.intervals import Interval, paired_ratio, student_interval
from pneumo.statistics.ranking import cost, rank_models


def test_order_n_and_numbers_of_a_row():
    ranking = rank_models(made(), "mine")
    assert [row.model for row in ranking.rows] == sorted(LEVEL, key=lambda name: LEVEL[name])
    assert [row.place for row in ranking.rows] == list(range(1, len(MODELS) + 1))
    assert ranking.row("M8").n == 1.3 and np.isnan(ranking.row("M1").n)
    cells = made(experiments=("X", "Y"))
    row = rank_models(cells, "mine").row("M6")
    errors = cells["mse"].sel(model="M6", n=1.3)
    per_run = errors.mean(("experiment", "chamber")).values
    assert row.mse.value == pytest.approx(per_run.mean())
    low, high = stats.t.interval(0.95, 3, loc=per_run.mean(), scale=stats.sem(per_run))
    assert (row.mse.low, row.mse.high) == pytest.approx((low, high))
    assert row.rms == pytest.approx(tuple(errors.mean(("experiment", "run")).values ** 0.5))


def test_the_best_n_is_that_of_all_runs_and_experiments_together():
    cells = made(experiments=("X", "Y"), runs=4, noise=0.0)
    times = np.ones((2, 4, 3))
    times[0, 0] = 0.1, 3.0, 3.0  # the first run asks for 1.2, all others for 1.4
    times[0, 1:], times[1] = (3.0, 3.0, 0.5), (3.0, 3.0, 0.5)
    dims = ("experiment", "run", "n")
    ranking = rank_models(cells.assign(mse=cells["mse"] * xr.DataArray(times, dims=dims)), "mine")
    assert ranking.row("M6").n == 1.4


def test_paired_comparison_is_sharper_than_two_intervals():
    ranking = rank_models(made(noise=0.3, runs=6, level=LEVEL | {"M9": 2.0, "M10": 2.4}), "mine")
    first, second = ranking.rows[:2]
    assert first.model == "M9" and second.model == "M10"
    assert second.mse.low < first.mse.high  # one by one they overlap,
    assert second.over_best.low > 1  # run by run they don't
    assert second.over_best.value == pytest.approx(1.2, rel=0.05)


def test_the_arithmetic_of_a_step_is_the_cost():
    order = sorted(MODELS, key=lambda name: cost(MODELS[name]))
    assert order.index("M6") < order.index("M7") < order.index("M8") < order.index("M9") < order.index("M10")
    assert cost(MODELS["M2"]) < cost(MODELS["M5"]) < cost(MODELS["M6"])


def test_one_run_has_no_error_bars():
    cells = made(runs=3)
    cells["random"][:] = 0
    ranking = rank_models(cells, "mine")
    assert ranking.runs == 1 and not ranking.rows[0].mse.known


def test_failed_full_order_run_is_left_out_and_told():
    cells = made(runs=4)
    cells["mse"][0, 1] = np.nan
    cells["run_status"][0, 1] = 1
    cells["run_failure_time"][0, 1] = 0.25
    ranking = rank_models(cells, "mine")
    assert ranking.runs == 3 and ranking.left_out == ("X, seed 1: diverged at 0.25 s",)
    assert ranking.row("M8").failed == 0
    cells["run_status"][:] = 1
    nothing = rank_models(cells, "mine")
    assert (nothing.runs, nothing.rows) == (0, ())


def test_failed_model_comes_last_and_an_n_that_failed_is_not_taken():
    cells = made()
    cells["mse"].loc[{"model": "M10", "run": 2}] = np.nan
    ranking = rank_models(cells, "mine")
    assert ranking.rows[-1].model == "M10" and ranking.rows[-1].place == len(MODELS)
    assert np.isnan(ranking.rows[-1].mse.value) and ranking.rows[-1].failed == 1
    assert np.isnan(ranking.rows[-1].rms).all()  # not the mean of the runs that it survived
    cells = made()
    cells["mse"].loc[{"model": "M8", "n": 1.3, "run": 0}] = np.nan
    assert rank_models(cells, "mine").row("M8").n in (1.2, 1.4)
    cells = made(experiments=("X", "Y"))
    cells["mse"].loc[{"model": "M10", "run": 2, "experiment": "Y"}] = np.nan
    assert rank_models(cells, "mine").rows[-1].model == "M10"  # in one experiment of two


def test_cylinders_are_ranked_apart():
    cells = made(experiments=("X", "Y"))
    cells["mse"].loc[{"experiment": "Y", "model": "M1"}] = 1.0
    ranking = rank_models(cells, "mine")
    assert ranking.rows[0].model == "M10" and ranking.by_experiment["Y"]["M1"] == pytest.approx(1.0)
    apart = cells.assign_coords(cylinder=("experiment", ["mine", "other"]))
    other = rank_models(apart, "other")
    assert other.rows[0].model == "M1" and other.experiments == ("Y",)
    assert rank_models(apart, "mine").rows[0].model == "M10"


@given(st.lists(st.floats(0.1, 1e3), min_size=2, max_size=20))
def test_interval_is_students(samples):
    interval = student_interval(np.array(samples))
    if np.ptp(samples) == 0:
        low = high = samples[0]
    else:
        low, high = stats.t.interval(0.95, len(samples) - 1, np.mean(samples), stats.sem(samples))
    assert interval == pytest.approx(Interval(float(np.mean(samples)), low, high))


@given(st.lists(st.tuples(st.floats(0.1, 1e3), st.floats(0.1, 1e3)), min_size=2, max_size=20))
def test_ratio_of_exchanged_samples_is_the_reciprocal(pairs):
    upper, lower = np.array(pairs).T
    one, other = paired_ratio(upper, lower), paired_ratio(lower, upper)
    assert one.value == pytest.approx(1 / other.value)
    assert (one.low, one.high) == pytest.approx((1 / other.high, 1 / other.low))
