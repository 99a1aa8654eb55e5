"""Statistics over experiments against direct computations: eqs (14) to (16), percentiles, best n, levels."""

import warnings

import numpy as np
import pytest
import xarray as xr
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from invented_cells import cells_of
from paper_study import STUDY

from paper.study.averages import OVERALL, statistics
from paper.study.paper_2006.paper_models import PAPER_MODELS
from pneumo.statistics.best_n import best_n

EPS = np.finfo(float).eps
WITHOUT_SHRINKING = [Phase.explicit, Phase.reuse, Phase.generate]  # one seed is as simple as another
MODELS = list(PAPER_MODELS)
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
    labels = (list(STUDY.experiments), MODELS, list(STUDY.n), ["A", "B"])
    coords = {dim: names[:size] for dim, names, size in zip(dims, labels, errors.shape, strict=False)}
    grid = cells_of((errors**2).mean(-1), coords).assign(mean_error=(dims, errors.mean(-1)))
    return grid.assign(variance=(dims, errors.var(-1)))


def percentile(values, percent):
    """A spreadsheet's PERCENTILE: sorted value i of N stands at 100 (i - 1)/(N - 1) per cent."""
    ordered = np.sort(values)
    return np.interp(percent, np.linspace(0, 100, len(ordered)), ordered)


def direct(joined):
    """Eqs (14), (15), (16) and percentiles of error vectors by (experiment, sample), by loops."""
    mu = [vector.mean() for vector in joined]
    N = len(mu)
    average = sum(mu) / N
    squares = [(vector**2).mean() for vector in joined]
    within = sum(vector.var() for vector in joined) / N
    between = sum((mean - average) ** 2 for mean in mu) / (N - 1)
    row = {"mean_error": average, "std": np.sqrt(within + between), "mse": sum(squares) / N}
    return row | {f"p{percent}": percentile(squares, percent) for percent in (10, 90)}


def matches(table, joined):
    """Whether a row of the tables is that of these error vectors, to some roundings of their size."""
    for name, value in direct(joined).items():
        size = np.sqrt((joined**2).mean()) if name in ("mean_error", "std") else (joined**2).mean()
        # A variance of 22 samples cancels: 100 EPS of the square; in std it stands below a square root.
        assert float(table[name]) == pytest.approx(value, rel=1e-12, abs=1e3 * EPS * size)


@given(st.integers(0, 2**32 - 1), st.integers(2, 16))
@settings(max_examples=10, phases=WITHOUT_SHRINKING)
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


@pytest.mark.parametrize(("rule", "p10", "p90"), [("hazen", 2.1, 14.9), ("linear", 2.5, 14.5)])
def test_percentiles_follow_the_rule(rule, p10, p90):
    # MATLAB's prctile(1:16, [10 90]), and a spreadsheet's PERCENTILE(1..16; 0.1).
    errors = np.sqrt(np.arange(1, 17.0))[::-1].reshape(16, 1, 1, 1, 1) * np.array([1.0, -1.0])
    errors = np.broadcast_to(errors, (16, 1, 1, 2, 2))
    row = statistics(grid_of(errors), {}, percentile_rule=rule).sel(level=OVERALL, model="M1")
    assert [float(row[name]) for name in ("p10", "p90")] == pytest.approx([p10, p90], rel=1e-14)


def test_best_n_is_the_lowest_of_equal_ones():
    values = [[3.0, 2.0, 4.0], [2.0, 2.0, 2.0], [3.0, 2.0, 2.0], [np.inf, 5.0, 6.0]]
    mse = xr.DataArray(values, dims=("model", "n"), coords={"n": [1.0, 1.1, 1.2]})
    assert best_n(mse).values.tolist() == [1.1, 1.0, 1.1, 1.1]


def failing(grid, **where):
    """The grid with some of its cells failed."""
    failed = grid.copy(deep=True)
    for name in ("mean_error", "variance", "mse"):
        failed[name].loc[where] = np.nan
    return failed


@pytest.fixture
def grid():
    return grid_of(random_errors(7))


def test_what_failed_has_no_best_n_no_constant_n_and_no_average_and_leaves_the_rest(grid):
    sound = statistics(grid, LEVELS)
    best = sound["best_n"].sel(experiment="E06", model="M7").item()
    table = statistics(failing(grid, experiment="E06", model="M7", n=best, chamber="B"), LEVELS)
    assert table["best_n"].sel(experiment="E06", model="M7").isnull()
    assert table["mse"].sel(model="M7", level="overall").isnull()
    # Everything else is as it was.
    xr.testing.assert_equal(table.drop_sel(model="M7"), sound.drop_sel(model="M7"))
    apart = {"experiment": "E06"}
    assert table["best_n"].drop_sel(apart).equals(sound["best_n"].drop_sel(apart))
    # Averages in which a failed model counts are lost.
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


def test_a_level_of_one_experiment_has_no_deviation_and_a_level_of_none_has_nothing():
    errors = random_errors(3, experiments=2)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        table = statistics(grid_of(errors), {"one": ["E02"], "none": ["E09"]})
    row = table.sel(level="one")
    assert row["std"].isnull().all() and (row["experiments"] == 1).all()
    for name in ("mean_error", "mse", "p10", "p90", "constant_n"):
        assert row[name].notnull().all()
    assert np.array_equal(row["p10"], row["mse"]) and np.array_equal(row["p90"], row["mse"])
    none = table.sel(level="none")
    assert all(none[name].isnull().all() for name in ("mean_error", "std", "mse", "p10", "p90", "constant_n"))
    assert none["experiments"] == 0
