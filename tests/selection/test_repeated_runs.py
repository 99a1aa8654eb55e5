"""Repeated runs: the workflow's bits for the configuration's seed, other seeds, failures."""

import numpy as np
import pytest
import xarray as xr
from paper_study import STUDY, lasting
from workflow_scripts import script

from pneumo.selection.cylinder_ranking import one_run, run_study, seeds_of
from pneumo.simulation.full_order import DIVERGED, record
from pneumo.simulation.replay import NO_RUN

pytestmark = pytest.mark.xdist_group("repeated runs")  # its fixtures take seconds

CELLS = ("mean_error", "variance", "mse", "status", "failure_time")


def repeated(experiments, n=STUDY.n, seeds=3, threads=2, **options):
    study_of = STUDY._replace(experiments={e.name: e for e in experiments}, n=n, seeds=seeds)
    return run_study(study_of, threads, **options)


@pytest.fixture(scope="module")
def runs():
    return repeated([lasting("E02", 2.0), lasting("E01", 1.0)])


def test_first_run_is_the_workflows_bit_for_bit(runs, tmp_path):
    cut = STUDY._replace(experiments={"E02": lasting("E02", 2.0)})
    parameters, datum = tmp_path / "parameters.json", tmp_path / "datum" / "E02.nc"
    replayed = tmp_path / "exact" / "replay" / "E02.nc"
    script("datum")(cut, parameters, [datum], 1)
    script("replay")(parameters, [datum], [replayed], 1)
    mine = runs.sel(experiment="E02").isel(run=0)
    with xr.open_dataset(replayed) as theirs:
        for name in CELLS:
            np.testing.assert_array_equal(mine[name].values, theirs[name].values, err_msg=name)
    assert np.isfinite(mine["mse"].values).all() and (mine["mse"].values > 0).all()


def test_runs_differ_in_their_seed_alone_and_more_begin_with_the_same(runs):
    seeds = runs["seed"].sel(experiment="E02").values.tolist()
    assert seeds == seeds_of(lasting("E02", 2.0), 3)
    assert seeds[0] == 666 and len(set(seeds)) == 3
    e = lasting("E02", 2.0)
    alone = one_run(e.with_seed(seeds[2]), STUDY.n)
    assert np.array_equal(runs["mse"].sel(experiment="E02").isel(run=2).values, alone["mse"].values)
    P = record(e.with_seed(seeds[2])).states[:, [2, 4]]
    assert alone["swing"] == pytest.approx(np.hypot(*P.std(axis=0)) / 2**0.5)
    assert len(np.unique(runs["mse"].sel(experiment="E02", model="M1", n=1.0, chamber="A"))) == 3
    assert seeds_of(lasting("E02", 2.0), 9)[:4] == seeds_of(lasting("E02", 2.0), 4)
    assert len(set(seeds_of(lasting("E02", 2.0), 100))) == 100


def test_a_signal_that_is_not_random_runs_once_and_a_run_that_fails_is_a_status():
    e = lasting("E02", 0.3)
    sweep = e._replace(excitation=e.excitation._replace(signal="sweep", band=(1e-3, 2e-3)))
    assert seeds_of(sweep, 5) == [666]
    told = []
    cells = repeated([sweep], (1.2,), seeds=5, threads=1, progress=told.append)
    assert cells.sizes["run"] == 1 and told == [pytest.approx(0.3)] and not cells["random"].any()
    both = repeated([sweep, e._replace(name="E98")], (1.2,), seeds=2, threads=1)
    assert both.sizes["run"] == 2
    assert both["mse"].sel(experiment="E02").std("run").max() == 0
    e = lasting("E02", 0.1)
    wild = e._replace(plant=e.plant._replace(cylinder=e.plant.cylinder._replace(M=1e-9)))
    cells = repeated([wild], (1.2,), seeds=2, threads=1)
    assert (cells["run_status"] == DIVERGED).all() or (cells["run_status"] > 0).all()
    assert (cells["status"] == NO_RUN).all() and cells["mse"].isnull().all()
    assert (cells["run_failure_time"] > 0).all()
