"""Known mistakes: each changes what it says and nothing else, and the verdict counts what it loses."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from invented_cells import cells_of
from paper_study import STUDY

from pneumo.configuration.parameters import read_yaml
from pneumo.evidence.sensitivity import verdict_power as p
from pneumo.evidence.sensitivity.alternatives import Alternative
from pneumo.papers.paper_2006 import summary
from pneumo.papers.paper_2006.printed_tables import PAPER_FOLDER
from pneumo.papers.paper_2006.results import StudyResults
from pneumo.physics.models import MODELS
from pneumo.storage.files import write
from pneumo.storage.kept_evidence import KEPT
from pneumo.verdict.claims import BASES, read_claims

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
    found = p.MISTAKES[mistake](grid)
    np.testing.assert_array_equal(found["mse"].sel(model=model), grid["mse"].sel(model=source))
    np.testing.assert_array_equal(found["mse"].sel(model="M2"), grid["mse"].sel(model="M2"))


def test_bookkeeping(grid):
    shifted = p.MISTAKES["n shifted by 0.05"](grid)["mse"]
    np.testing.assert_array_equal(shifted.sel(n=1.2), grid["mse"].sel(n=1.25))
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
    own, mistaken = p.rerun_results(KEPT, Alternative(study), 1), p.rerun_results(KEPT, heavy, 1)
    assert mistaken.run("datum", "E14", "x")["x"].sizes["t"] == 301
    for of in ("cells", "statistics"):
        assert not getattr(own, of)["mse"].equals(getattr(mistaken, of)["mse"])
    assert not own.settling_times.sel(experiment="E14").equals(mistaken.settling_times.sel(experiment="E14"))
    claim = CLAIMS.items["T5.E14.P_A"]
    assert p.agrees(claim, CLAIMS, own)  # a settling run does not depend on the length of the other
    assert not p.agrees(CLAIMS.items["T7.M8.mse"], CLAIMS, own)
    assert not p.agrees(CLAIMS.items["T5.E01.P_A"], CLAIMS, own)  # not run


def test_counts_of_what_is_lost(tmp_path):
    items = ["T7.M8.mse", "T5.E01.P_A", "S4.best_four", "T7.M9.mse"]
    agrees = xr.DataArray(
        np.array([[1, 1, 1, 0], [0, 1, 0, 1], [1, 1, 1, 0]], dtype=np.int8),
        {"mistake": [p.NO_MISTAKE, "one", "two"], "item": items},
        name="agrees",
    )
    write(agrees.to_dataset(), tmp_path / "power.nc", {"config_sha256": STUDY.config_sha256})
    results = StudyResults(tmp_path, "published")
    results.study = STUDY
    judged = [{"id": name, "basis": CLAIMS.items[name].basis} for name in items]
    nothing = dict.fromkeys(BASES, 0)
    assert summary.power(results, judged) == [
        {"mistake": "one", "lost": 2, "of": 3} | nothing | {"fitted": 2},
        {"mistake": "two", "lost": 0, "of": 3} | nothing,
    ]
