"""Known mistakes: each changes what it says and nothing else, and the verdict counts what it loses."""

from pathlib import Path

import numpy as np
import pytest
from invented_cells import cells_of
from paper_study import STUDY

from pneumo.configuration.parameters import read_yaml
from pneumo.evidence.sensitivity import verdict_power as p
from pneumo.evidence.sensitivity.alternatives import Alternative
from pneumo.papers.paper_2006.printed_tables import PAPER_FOLDER
from pneumo.physics.models import MODELS
from pneumo.storage.kept_evidence import KEPT
from pneumo.verdict.claims import read_claims

ROOT = Path(__file__).parents[3]
CLAIMS = read_claims(PAPER_FOLDER)


@pytest.fixture(scope="module")
def grid():
    coords = {"experiment": list(STUDY.experiments), "model": list(MODELS), "n": list(STUDY.n)}
    coords |= {"chamber": ["A", "B"]}
    shape = [len(labels) for labels in coords.values()]
    return cells_of(np.random.default_rng(7).uniform(1e6, 2e6, shape), coords)


@pytest.mark.parametrize(
    ("mistake", "model", "source"),
    [
        ("M7 and M8 exchanged", "M7", "M8"),
        ("M8 and M9 exchanged", "M9", "M8"),
        ("M9 is M8", "M9", "M8"),
        ("M9 is M8", "M8", "M8"),
        ("M10 is M8", "M10", "M8"),
    ],
)
def test_models_get_the_errors_of_others(grid, mistake, model, source):
    mistaken = p.MISTAKES[mistake](grid)
    np.testing.assert_array_equal(mistaken["mse"].sel(model=model), grid["mse"].sel(model=source))
    np.testing.assert_array_equal(mistaken["mse"].sel(model="M2"), grid["mse"].sel(model="M2"))


def test_bookkeeping(grid):
    shifted = p.MISTAKES["n shifted by 0.05"](grid)["mse"]
    np.testing.assert_array_equal(shifted.sel(n=1.2), grid["mse"].sel(n=1.25))
    np.testing.assert_array_equal(shifted.sel(n=1.4), grid["mse"].sel(n=1.4))
    shifted = p.MISTAKES["n shifted by -0.05"](grid)["mse"]
    np.testing.assert_array_equal(shifted.sel(n=1.25), grid["mse"].sel(n=1.2))
    np.testing.assert_array_equal(p.MISTAKES["sign of errors"](grid)["mean_error"], -grid["mean_error"])
    larger = p.MISTAKES["MSE x 1.08"](grid)
    np.testing.assert_allclose(larger["mse"], 1.08 * grid["mse"])
    np.testing.assert_allclose(larger["mean_error"] ** 2, 1.08 * grid["mean_error"] ** 2)


def changed(mistake):
    """E14 and E05 of the study with a mistake in what is run."""
    configuration = read_yaml(ROOT / "config/paper.yaml")
    study = p.MISTAKES[mistake].change(Alternative(STUDY), configuration)
    return study, study.study.experiments["E14"], STUDY.experiments["E14"]


def test_mistakes_in_what_is_run():
    _, mistaken, taken = changed("M + 10 %")
    assert mistaken.plant.cylinder.M == 1.1 * taken.plant.cylinder.M
    assert mistaken.plant.cylinder._replace(M=taken.plant.cylinder.M) == taken.plant.cylinder
    assert changed("k_f + 10 %")[1].plant.cylinder.k_f == 1.1 * taken.plant.cylinder.k_f
    assert changed("gamma = 1.35")[1].plant.gas.gamma == 1.35
    assert changed("other seeds")[1].excitation.seed != taken.excitation.seed
    assert changed("one settling time in place of ten")[1].steps == taken.steps // 10
    assert taken.push.leak > 0 == changed("no leak")[1].push.leak
    alternative, mistaken, taken = changed("linear for held")
    assert alternative.sampling(taken).rule == "linear" != Alternative(STUDY).sampling(taken).rule


def test_a_rerun_has_runs_cells_and_settling_times_of_its_own():
    short = {name: STUDY.experiments[name]._replace(steps=300) for name in ("E13", "E14")}
    study = STUDY._replace(experiments=short)
    heavy = p.MISTAKES["M + 10 %"].change(Alternative(study), {})
    as_taken, mistaken = p.rerun_results(KEPT, Alternative(study), 1), p.rerun_results(KEPT, heavy, 1)
    assert mistaken.run("datum", "E14", "x")["x"].sizes["t"] == 301
    for table in ("cells", "statistics"):
        assert not getattr(as_taken, table)["mse"].equals(getattr(mistaken, table)["mse"])
    assert not as_taken.settling_times.sel(experiment="E14").equals(
        mistaken.settling_times.sel(experiment="E14")
    )
    claim = CLAIMS.items["T5.E14.P_A"]
    assert p.agrees(claim, CLAIMS, as_taken)  # a settling run does not depend on the length of the other
    assert not p.agrees(CLAIMS.items["T7.M8.mse"], CLAIMS, as_taken)
    assert not p.agrees(CLAIMS.items["T5.E01.P_A"], CLAIMS, as_taken)  # not run


def test_an_experiment_gets_the_errors_of_another(grid):
    def source(mistake, experiment):
        """Experiment whose errors another one has under a mistake."""
        mse = p.MISTAKES[mistake](grid)["mse"].sel(experiment=experiment, drop=True)
        (name,) = [
            e for e in grid["experiment"].values if grid["mse"].sel(experiment=e, drop=True).equals(mse)
        ]
        return name

    def kind(name):
        e = STUDY.experiments[name]
        return e.cylinder, e.drive.closed_loop, round(e.plant.k_0, 3)  # Table 4's lambda_0 has three digits

    for name in STUDY.experiments:
        cylinder, closed, k_0 = kind(name)
        assert kind(source("D and E exchanged", name)) == ({"D": "E", "E": "D"}[cylinder], closed, k_0)
        assert kind(source("loops exchanged", name)) == (cylinder, not closed, k_0)
        assert kind(source("experiments of a level cycled", name))[2] == k_0
        assert source("experiments of a level cycled", name) != name
    assert [source("E05 and E07 exchanged", name) for name in ("E05", "E06", "E07")] == ["E07", "E06", "E05"]


def test_chambers_are_exchanged_and_errors_scaled_or_shifted(grid):
    exchanged = p.MISTAKES["A and B exchanged"](grid)["mse"]
    np.testing.assert_array_equal(exchanged.sel(chamber="A"), grid["mse"].sel(chamber="B"))
    np.testing.assert_array_equal(exchanged.mean("chamber"), grid["mse"].mean("chamber"))
    wider = p.MISTAKES["sigma x 1.05"](grid)
    np.testing.assert_array_equal(wider["mean_error"], grid["mean_error"])
    variance = grid["mse"] - grid["mean_error"] ** 2
    np.testing.assert_allclose(wider["mse"] - wider["mean_error"] ** 2, 1.05**2 * variance)
    shifted = p.MISTAKES["mu + 50 Pa"](grid)
    np.testing.assert_allclose(shifted["mean_error"] - grid["mean_error"], 50.0)
    np.testing.assert_allclose(shifted["mse"] - shifted["mean_error"] ** 2, variance)
