"""Fleets: blocks hold what single studies hold, whatever the threads; one cylinder is found again."""

import numpy as np
import pytest
import xarray as xr

from pneumo.configuration.parameters import load, study
from pneumo.configuration.priors import Uncertain
from pneumo.selection.answer import answers
from pneumo.selection.cylinder_ranking import run_study, selected
from pneumo.selection.cylinder_template import write_table_template
from pneumo.selection.error_budget import FULL_ORDER
from pneumo.storage.files import write
from workflow.jobs.fleet import CELLS, DRAWS, RANKED, fleet_index, run_block, studies_of, together

pytestmark = pytest.mark.xdist_group("own study")  # the same kernels, compiled once
UNKNOWN = {name: Uncertain(("C", "k_0"), ((0.01, 0.0), (0.0, 0.1))) for name in ("first", "second")}
FAILING = "second"  # too light for its step: every full-order run fails


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    file = tmp_path_factory.mktemp("table") / "fleet.yaml"
    write_table_template(file)
    whole = study(load(file))
    experiments = {name: e._replace(steps=300) for name, e in whole.experiments.items()}
    return whole._replace(experiments=experiments, n=(1.2, 1.3), seeds=2)


@pytest.fixture(scope="module")
def half_failing(short):
    def spoilt(e):
        light = e.plant.cylinder._replace(M=1e-6, k_f=1000.0)
        return e._replace(plant=e.plant._replace(cylinder=light), h=0.03, most_halvings=0)

    changed = {k: spoilt(e) if e.cylinder == FAILING else e for k, e in short.experiments.items()}
    return short._replace(experiments=changed)


@pytest.fixture(scope="module")
def block(half_failing):
    return run_block(half_failing, threads=2, uncertain=UNKNOWN)


def test_a_block_holds_what_the_study_of_each_cylinder_holds(short, half_failing, block):
    xr.testing.assert_identical(block, run_block(half_failing, threads=1, uncertain=UNKNOWN))
    assert list(studies_of(short)) == ["first", "second"]
    assert list(studies_of(short)["second"].experiments) == ["open", "closed"]
    alone = run_study(selected(short, ["first"]), threads=1, uncertain=UNKNOWN, draws=DRAWS)
    mine = block.sel(cylinder="first")
    assert [name for name in CELLS if name in mine] == [name for name in CELLS if name in alone]
    for name in (name for name in CELLS if name in alone):
        assert mine[name].dtype == np.float32 and (mine[name].values.shape == alone[name].values.shape)
        np.testing.assert_array_equal(mine[name].values, alone[name].values.astype(np.float32))
    assert (mine["status"].values == alone["status"].values).all()
    (answer,) = answers(alone)
    ranking = answer.ranking
    assert (mine["recommended"].item(), int(mine["runs"])) == (answer.chosen, ranking.runs)
    assert mine["as_good"].item() == ", ".join(answer.as_good)
    full_order = answer.budget.row(FULL_ORDER).rms
    assert mine["expected_rms_of_full_order"].item() == pytest.approx(full_order, rel=1e-5)
    for model, row in ranking.table.iterrows():
        stored, expected = mine.sel(model=model), answer.budget.row(model)
        # Four bytes have 24 binary digits.
        found = [stored["expected_rms"].item(), stored["expected_n"].item()]
        assert found == pytest.approx([expected.rms, expected.n], rel=1e-5, nan_ok=True)
        for name in RANKED:
            assert stored[name].item() == pytest.approx(row[name], rel=1e-5, nan_ok=True)


def test_each_cylinder_is_drawn_from_what_is_known_about_it(short, block):
    first = studies_of(short)["first"]
    named = {f"first-{name}": experiment for name, experiment in first.experiments.items()}
    unknown = {"first": Uncertain(("k_0",), ((0.25,),))}
    wide = run_block(short._replace(experiments=named), threads=2, uncertain=unknown)
    expected = run_study(first, threads=2, uncertain=unknown, draws=DRAWS)["mse_drawn"]
    assert np.array_equal(wide["mse_drawn"].values[0], expected.values.astype(np.float32))


def test_a_cylinder_whose_runs_fail_is_told_and_leaves_the_others_alone(short, block):
    failed = block.sel(cylinder=FAILING)
    assert failed["recommended"] == "" and failed["reason"] == "no full-order run succeeded"
    assert (failed["run_status"] != 0).all() and failed["best_mse"].isnull().all()
    assert not failed["place"].any()
    index = fleet_index({"000000": block})
    assert index["failed_runs"].values.tolist() == [0, 4]
    whole = run_block(short, threads=2)
    xr.testing.assert_equal(whole["mse"].sel(cylinder="first"), block["mse"].sel(cylinder="first"))


@pytest.mark.slow
def test_a_cylinder_takes_at_most_100_kB(short, tmp_path):
    whole = run_block(short._replace(n=tuple(1 + i / 20 for i in range(9)), seeds=5), threads=2)
    many = together([whole] * 10)  # bytes of a file without any cylinder do not count
    write(many, tmp_path / "block.nc", {})
    assert (tmp_path / "block.nc").stat().st_size < 20 * 100_000
