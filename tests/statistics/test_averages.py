"""Statistics over experiments against direct computations: eqs (14) to (16), percentiles, best n, levels."""

import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from pneumo.configuration.parameters import load, study
from pneumo.statistics.averages import OVERALL, best_n, concatenated, statistics

STUDY = study(load(Path(__file__).parents[2] / "config" / "paper.yaml"))
EPS = np.finfo(float).eps
WITHOUT_SHRINKING = [Phase.explicit, Phase.reuse, Phase.generate]  # one seed is as simple as another
MODELS = [f"M{i}" for i in range(1, 11)]
LEVELS = STUDY.experiments_by_level


def random_errors(seed, experiments=16, models=10, n=9, samples=11):
    """Errors, Pa, by (experiment, model, n, chamber, sample), of sizes that vary by experiment and model."""
    rng = np.random.default_rng(seed)
    size = 10 ** rng.uniform(1, 4, (experiments, models, 1, 1, 1))
    shape = (experiments, models, n, 2, samples)
    return size * (rng.normal(size=shape) + rng.normal(size=shape[:-1])[..., np.newaxis])


def grid_of(errors):
    """What `open_grid` gives for these errors."""
    dims = ("experiment", "model", "n", "chamber")
    return xr.Dataset(
        {
            "mean_error": (dims, errors.mean(-1), {"units": "Pa", "long_name": "mean"}),
            "variance": (dims, errors.var(-1), {"units": "Pa2"}),
            "mse": (dims, (errors**2).mean(-1), {"units": "Pa2", "long_name": "mean square"}),
            "status": (dims, np.zeros(errors.shape[:-1], np.int8)),
            "failure_time": (dims, np.full(errors.shape[:-1], np.nan)),
        },
        {
            "experiment": list(STUDY.experiments)[: errors.shape[0]],
            "model": MODELS[: errors.shape[1]],
            "n": list(STUDY.n)[: errors.shape[2]],
            "chamber": ["A", "B"],
        },
    )


def prctile(values, percent):
    """MATLAB's prctile, from its documentation: sorted value i stands at 100 (i - 0.5)/N per cent."""
    ordered = np.sort(values)
    places = 100 * (np.arange(1, len(ordered) + 1) - 0.5) / len(ordered)
    return np.interp(percent, places, ordered)


def direct(joined):
    """Eqs (14), (15), (16) and percentiles of error vectors by (experiment, sample), by loops."""
    mu = [vector.mean() for vector in joined]
    N = len(mu)
    average = sum(mu) / N
    squares = [(vector**2).mean() for vector in joined]
    within = sum(vector.var() for vector in joined) / N
    between = sum((one - average) ** 2 for one in mu) / (N - 1)
    return {
        "mean_error": average,
        "std": np.sqrt(within + between),
        "mse": sum(squares) / N,
        "p10": prctile(squares, 10),
        "p90": prctile(squares, 90),
    }


def matches(table, joined):
    """Whether a row of the tables is that of these error vectors, to some roundings of their size."""
    for name, value in direct(joined).items():
        size = np.sqrt((joined**2).mean()) if name in ("mean_error", "std") else (joined**2).mean()
        # A variance of 22 samples cancels: 100 EPS of the square; in std it stands below a square root.
        assert float(table[name]) == pytest.approx(value, rel=1e-12, abs=1e3 * EPS * size)


@given(st.integers(0, 2**32 - 1), st.integers(2, 16))
@settings(deadline=None, max_examples=10, phases=WITHOUT_SHRINKING)
def test_tables_are_those_of_the_error_vectors(seed, experiments):
    errors = random_errors(seed, experiments, models=3, n=4)
    names = np.array(list(STUDY.experiments)[:experiments])
    draw = np.random.default_rng(seed).choice
    levels = {level: list(draw(names, draw(experiments), replace=False)) for level in LEVELS}
    joined = np.concatenate([errors[..., 0, :], errors[..., 1, :]], axis=-1)  # chambers A and B in one vector
    square = (joined**2).mean(-1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        table = statistics(grid_of(errors), levels)
    assert table["level"].values.tolist() == [OVERALL, *levels]
    for i, model in enumerate(MODELS[:3]):
        best = square[:, i].argmin(axis=1)
        assert np.array_equal(table["best_n"].sel(model=model), np.array(STUDY.n)[best])
        at_best = np.array([joined[j, i, best[j]] for j in range(experiments)])
        matches(table.sel(level=OVERALL, model=model), at_best)
        assert np.isnan(table["constant_n"].sel(level=OVERALL, model=model))
        for level, members in levels.items():
            chosen = np.isin(names, members)
            row = table.sel(level=level, model=model)
            assert row["experiments"] == chosen.sum()
            if chosen.sum() >= 2:
                constant = square[chosen, i].mean(axis=0).argmin()
                assert row["constant_n"] == STUDY.n[constant]
                matches(row, joined[chosen, i, constant])


@given(st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=20, phases=WITHOUT_SHRINKING)
def test_two_chambers_make_one_vector(seed):
    errors = random_errors(seed, experiments=2, models=2, n=2)
    cells = concatenated(grid_of(errors))
    joined = np.concatenate([errors[..., 0, :], errors[..., 1, :]], axis=-1)
    scale = (joined**2).mean(-1)
    np.testing.assert_allclose(cells["mse"], scale, rtol=1e-13)
    assert (abs(cells["mean_error"] - joined.mean(-1)) < 1e-13 * np.sqrt(scale)).all()
    assert (abs(cells["variance"] - joined.var(-1)) < 1e-12 * scale).all()
    assert (abs(cells["mean_error"] ** 2 + cells["variance"] - cells["mse"]) < 4 * EPS * scale).all()


@pytest.mark.parametrize(
    ("count", "p10", "p90"), [(16, 2.1, 14.9), (8, 1.3, 7.7), (5, 1.0, 5.0), (2, 1.0, 2.0)]
)
def test_percentiles_are_matlabs(count, p10, p90):
    # prctile(1:16, [10 90]) and so on; below the first and above the last place it gives the extremes.
    errors = np.sqrt(np.arange(1, count + 1.0))[::-1].reshape(count, 1, 1, 1, 1) * np.array([1.0, -1.0])
    errors = np.broadcast_to(errors, (count, 1, 1, 2, 2))
    row = statistics(grid_of(errors), {}).sel(level=OVERALL, model="M1")
    assert float(row["p10"]) == pytest.approx(p10, rel=1e-14)
    assert float(row["p90"]) == pytest.approx(p90, rel=1e-14)
    assert p10 == pytest.approx(prctile(np.arange(1, count + 1.0), 10))


# Best n


def mse_of(values, n=(1.0, 1.1, 1.2)):
    return xr.DataArray(np.atleast_2d(values), dims=("model", "n"), coords={"n": list(n)})


@pytest.mark.parametrize(
    ("values", "best"),
    [
        ([3.0, 2.0, 4.0], 1.1),
        ([2.0, 2.0, 2.0], 1.0),  # a model without n
        ([3.0, 2.0, 2.0], 1.1),
        ([np.nan, 5.0, 4.0], 1.2),
        ([np.nan, 5.0, np.nan], 1.1),
        ([4.0, np.nan, 4.0], 1.0),
        ([np.inf, 5.0, 6.0], 1.1),
        ([0.0, -0.0, 0.0], 1.0),
    ],
)
def test_best_n(values, best):
    assert best_n(mse_of(values)).item() == best


def test_there_is_no_best_n_where_all_failed():
    found = best_n(mse_of([[np.nan] * 3, [1.0, 2.0, 3.0]]))
    assert np.isnan(found[0]) and found[1] == 1.0


def failing(grid, **where):
    """The grid with some of its cells failed."""
    selected = xr.ones_like(grid["mse"], dtype=bool)
    for dim, value in where.items():
        selected = selected & (grid[dim] == value)
    for name in ("mean_error", "variance", "mse"):
        grid = grid.assign({name: grid[name].where(~selected)})
    return grid


@pytest.fixture
def grid():
    return grid_of(random_errors(7))


def test_one_failed_chamber_takes_its_cell_out(grid):
    sound = statistics(grid, LEVELS)
    best = sound["best_n"].sel(experiment="E06", model="M7").item()
    table = statistics(failing(grid, experiment="E06", model="M7", n=best, chamber="B"), LEVELS)
    other = table["best_n"].sel(experiment="E06", model="M7").item()
    assert other != best
    remaining = concatenated(grid)["mse"].sel(experiment="E06", model="M7").drop_sel(n=best)
    assert other == remaining.idxmin("n")
    assert table["mse"].notnull().all()
    # Everything else is as it was.
    xr.testing.assert_equal(table.drop_sel(model="M7"), sound.drop_sel(model="M7"))
    apart = {"experiment": "E06"}
    assert table["best_n"].drop_sel(apart).equals(sound["best_n"].drop_sel(apart))


def test_an_n_that_failed_anywhere_in_a_level_is_not_its_constant_n(grid):
    sound = statistics(grid, LEVELS)
    constant = sound["constant_n"].sel(level="typical", model="M5").item()
    table = statistics(failing(grid, experiment="E05", model="M5", n=constant), LEVELS)  # k_0 = 0.1
    assert table["constant_n"].sel(level="typical", model="M5") != constant
    assert table["mse"].sel(level="typical", model="M5") > sound["mse"].sel(level="typical", model="M5")
    row = {"level": "isothermal", "model": "M5"}
    xr.testing.assert_equal(table.sel(row), sound.sel(row))


def test_a_model_that_failed_throughout_an_experiment_poisons_the_averages_it_counts_in(grid):
    sound = statistics(grid, LEVELS)
    table = statistics(failing(grid, experiment="E01", model="M9"), LEVELS)  # k_0 = 0.02
    assert np.isnan(table["best_n"].sel(experiment="E01", model="M9"))
    for name in ("mean_error", "std", "mse", "p10", "p90"):
        lost = table[name].isnull()
        assert lost.sel(level=[OVERALL, "adiabatic"], model="M9").all()
        assert lost.sum() == 2
        kept = table[name].where(~lost)
        assert kept.equals(sound[name].where(~lost))
    assert np.isnan(table["constant_n"].sel(level="adiabatic", model="M9"))
    assert (table["experiments"] == [16, 8, 8, 8]).all()


# Levels


def test_levels_of_the_study_take_eight_experiments_each(grid):
    table = statistics(grid, LEVELS)
    assert dict(zip(table["level"].values, table["experiments"].values, strict=True)) == {
        OVERALL: 16,
        "adiabatic": 8,
        "typical": 8,
        "isothermal": 8,
    }
    # Model by model, adiabatic and isothermal make up the sixteen; at its best n each is lower.
    halves = table["mse"].sel(level=["adiabatic", "isothermal"]).mean("level")
    assert (halves >= table["mse"].sel(level=OVERALL) * (1 - 8 * EPS)).all()
    assert dict(table["mse"].sizes) == {"level": 4, "model": 10}
    assert dict(table["best_n"].sizes) == {"experiment": 16, "model": 10}


def test_a_level_of_one_experiment_has_no_deviation_and_a_level_of_none_has_nothing():
    errors = random_errors(3, experiments=2)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        table = statistics(grid_of(errors), {"one": ["E02"], "none": ["E09"]})
    one = table.sel(level="one")
    assert one["std"].isnull().all() and (one["experiments"] == 1).all()
    for name in ("mean_error", "mse", "p10", "p90", "constant_n"):
        assert one[name].notnull().all()
    assert np.array_equal(one["p10"], one["mse"]) and np.array_equal(one["p90"], one["mse"])
    none = table.sel(level="none")
    assert all(none[name].isnull().all() for name in ("mean_error", "std", "mse", "p10", "p90", "constant_n"))
    assert none["experiments"] == 0


def test_units_are_those_of_what_is_stored_and_not_of_what_it_came_from(grid):
    # The notation list gives the rest; a percentile or an n must not inherit "mean square" and Pa2.
    table = statistics(grid, LEVELS)
    for name in ("mean_error", "std", "mse", "p10", "p90", "best_n"):
        assert table[name].attrs == {}
    assert table["constant_n"].attrs["units"] == "1" and "n of" in table["constant_n"].attrs["long_name"]
    assert table["experiments"].attrs["units"] == "1"
