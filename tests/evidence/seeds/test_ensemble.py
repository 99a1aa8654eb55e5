"""Other seeds: seed sets, tables with their spread, comparisons of models."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from invented_cells import cells_of
from paper_study import STUDY
from scipy import stats

from pneumo.evidence.seeds import ensemble as e
from pneumo.evidence.seeds.seed_sets import seed_sets, with_seeds
from pneumo.papers.paper_2006.paper_models import PAPER_MODELS
from pneumo.simulation.full_order import record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.simulation.signals import study_sampling
from pneumo.statistics.averages import concatenated
from pneumo.statistics.model_pairs import CRITERIA

CONFIG = Path(__file__).parents[3] / "config"
LEVELS = {"low": ["E00", "E03"], "high": ["E01", "E02"]}


def short(steps, *names):
    return STUDY._replace(experiments={name: STUDY.experiments[name]._replace(steps=steps) for name in names})


def test_the_papers_seeds_come_first_no_set_twice_and_each_cylinder_has_its_own():
    sets = seed_sets(STUDY, 100)
    assert sets[0] == {"D": 666, "E": 777}
    assert len(sets) == 100
    assert len({tuple(seeds.items()) for seeds in sets}) == 100
    assert seed_sets(STUDY, 10) == sets[:10]  # a larger ensemble goes on with what a smaller one has
    small = short(300, "E06", "E16")
    first, other = (with_seeds(small, {"D": 666, "E": seed}, 1)["mse"] for seed in (777, 778))
    assert first.sel(experiment="E06").equals(other.sel(experiment="E06"))
    assert not np.isclose(first.sel(experiment="E16"), other.sel(experiment="E16"), rtol=1e-3).any()


def test_the_papers_seeds_give_the_studys_cells_whatever_the_threads():
    small = short(300, "E06", "E16", "E05")
    one, two = (with_seeds(small, {"D": 666, "E": 777}, threads) for threads in (1, 2))
    xr.testing.assert_identical(one, two)
    lanes, index = grid_lanes(STUDY.n, 1.4)
    for name, e_ in small.experiments.items():
        for transport in ("published", "exact"):
            cells = replay(record(e_), lanes, study_sampling(transport, e_))
            joined = one["mse"].sel(experiment=name, transport=transport)
            np.testing.assert_array_equal(joined, cells.mse[index])


def test_a_run_that_fails_leaves_its_cells_empty():
    small = short(300, "E06", "E05")
    broken = small.experiments["E06"]
    plant = broken.plant._replace(cylinder=broken.plant.cylinder._replace(M=1e-4))
    small.experiments["E06"] = broken._replace(plant=plant)
    assert not np.isfinite(record(small.experiments["E06"]).states).all()
    errors = with_seeds(small, {"D": 1}, 1)
    assert errors["mse"].sel(experiment="E06").isnull().all()
    assert errors["failure_time"].sel(experiment="E06").notnull().all()
    assert errors["mse"].sel(experiment="E05").notnull().all()


def invented(mse):
    """Ensemble by (seeds, experiment) with models whose errors are given by (seeds, experiment, model)."""
    seeds, experiments, _ = mse.shape
    names = [f"E{i:02}" for i in range(experiments)]
    coords = {"seeds": range(seeds), "transport": ["exact"], "experiment": names, "model": list(PAPER_MODELS)}
    cells = np.stack([mse, 2 * mse], axis=-1)[:, np.newaxis, ..., np.newaxis] * np.ones(2)
    cells = cells_of(cells, coords | {"n": [1.2, 1.4], "chamber": ["A", "B"]})
    return cells.assign_coords(k_0=("experiment", np.resize([0.1, 0.5, 2.5], experiments)))


def random_errors(seeds=8, experiments=4, sigma=0.3):
    logs = np.random.default_rng(1).normal(0, sigma, (seeds, experiments, len(PAPER_MODELS)))
    return 1e6 * np.exp(logs + 0.1 * np.arange(len(PAPER_MODELS)))


def test_spread_is_students_probability_and_sign_test():
    values = xr.DataArray([1.0, 2.0, 4.0, 9.0], dims="seeds")
    spread = e.spread_over_seeds(values)
    low, high = stats.ttest_1samp(values, 0).confidence_interval(0.95)
    assert spread.values == pytest.approx([4.0, np.std(values.values, ddof=1), low, high])
    errors = random_errors(seeds=10)
    errors[:, :, 7] = 0.5 * errors[:, :, 6]  # M8 beats M7 in all ten
    errors[:3, :, 9] = 2 * errors[:3, :, 7]  # M10 loses to M8 three times
    errors[3:, :, 9] = 0.5 * errors[3:, :, 7]
    scores = e.scores_by_criterion(concatenated(invented(errors))["mse"], LEVELS)
    wins = e.beats(scores).sel(criterion="mean", level="overall", transport="exact")
    p = wins["probability"]
    assert p.sel(model="M8", other="M7") == 1
    assert p.sel(model="M10", other="M8") == 0.7
    np.testing.assert_allclose(p + p.transpose("other", "model").values, 1)
    assert wins["resolved"].sel(model="M8", other="M7") in (0, 1)
    raw = stats.binomtest(10, 10).pvalue
    assert raw <= wins["p_value"].sel(model="M8", other="M7") <= 45 * raw
    assert wins["p_value"].sel(model="M10", other="M8") == 1


def test_scores_by_hand():
    errors = np.ones((1, 3, len(PAPER_MODELS))) * np.arange(1, 11)
    errors[0, 2] = 1000 * np.arange(10, 0, -1)  # one violent experiment turns the order round
    mse = concatenated(invented(errors))["mse"]
    scores = e.scores_by_criterion(mse, LEVELS).sel(seeds=0, transport="exact")
    overall = scores.sel(level="overall")
    order = {name: overall.sel(criterion=name).argmin("model").item() for name in CRITERIA}
    assert order == {"mean": 9, "geometric": 0, "rank": 0}
    expected = (np.arange(1, 11) ** 2 * 1000 * np.arange(10, 0, -1)) ** (1 / 3)
    np.testing.assert_allclose(overall.sel(criterion="geometric"), expected)
    np.testing.assert_allclose(scores.sel(level="low", criterion="mean"), np.arange(1, 11))
    both = (np.arange(1, 11) + 1000 * np.arange(10, 0, -1)) / 2
    np.testing.assert_allclose(scores.sel(level="high", criterion="mean"), both)
    np.testing.assert_allclose(scores.sel(level="low", criterion="rank"), np.arange(1, 11))


@settings(max_examples=50)
@given(arrays(float, 10, elements=st.floats(1e-6, 1.0)))
def test_holm_is_that_of_the_definition(values):
    p = np.ones((5, 5))
    rows, columns = np.triu_indices(5, 1)
    p[rows, columns] = p[columns, rows] = values
    corrected = e.holm(p)
    order = np.argsort(values)
    expected, running = np.empty(10), 0.0
    for i, k in enumerate(order):
        running = max(running, min(1.0, (10 - i) * values[k]))
        expected[k] = running
    np.testing.assert_allclose(corrected[rows, columns], expected)
    np.testing.assert_array_equal(corrected, corrected.T)


def test_ratios_of_known_lognormals_and_everything_in_one_dataset():
    sigma = 0.2
    rng = np.random.default_rng(3)
    errors = np.ones((400, 2, len(PAPER_MODELS)))
    errors[:, :, 7] = 0.5 * np.exp(rng.normal(0, sigma, 400))[:, np.newaxis]
    ratios = e.ratio_intervals(concatenated(invented(errors))["mse"].min("n"))
    mixing = ratios.sel(ratio="M8/M7", transport="exact", experiment="E00")
    # Standard errors of mean and spread over 400 draws: 0.01 and 0.007; four of them.
    assert np.log(mixing["value"].item()) == pytest.approx(np.log(0.5), abs=0.04)
    assert np.log(mixing["resolvable"].item()) == pytest.approx(1.96 * sigma, abs=4 * 1.96 * 0.007)
    assert mixing["low"] < mixing["value"] < mixing["high"]
    assert mixing["single_low"] < mixing["low"] and mixing["high"] < mixing["single_high"]
    everything = e.ensemble_statistics(invented(random_errors()), LEVELS)
    assert everything["table_mse"].dims == ("spread", "transport", "level", "model")
    np.testing.assert_allclose(everything["table_constant_n"].sel(spread="mean", level="low"), 1.2)
    assert set(everything["ratio_value"].dims) == {"ratio", "averaged", "transport", "level"}
    assert set(everything["experiment_ratio_low"].dims) == {"ratio", "transport", "experiment"}
    assert everything["table_mse"].attrs["units"] == "Pa2"
    assert all({"units", "long_name"} <= set(variable.attrs) for variable in everything.data_vars.values())
