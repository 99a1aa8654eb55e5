"""Repeated runs: the workflow's bits for the configuration's seed, other seeds, a wrong k_0, failures."""

import numpy as np
import pytest
import xarray as xr
from paper_study import STUDY, lasting
from workflow_scripts import script

from pneumo.configuration.known_within import KnownWithin
from pneumo.configuration.sampling import EXACT_SAMPLING
from pneumo.configuration.study_json import to_json
from pneumo.physics.models import MODELS, Lane, full_order_lane, lane, lane_array
from pneumo.selection import cylinder_ranking
from pneumo.selection.cylinder_ranking import K_0_ENDS, mse_at_other_k_0, one_run, run_study, seeds_of
from pneumo.simulation.full_order import DIVERGED, record
from pneumo.simulation.replay import NO_RUN, full_order_mse, replay
from pneumo.storage.files import write_json

pytestmark = pytest.mark.xdist_group("repeated runs")  # its fixtures take seconds

WITH_WALL = [name for name, model in MODELS.items() if model.wall != "none"]
CELLS = ("mean_error", "variance", "mse", "status", "failure_time")


def repeated(experiments, n=STUDY.n, seeds=3, threads=2, **options):
    study_of = STUDY._replace(experiments={e.name: e for e in experiments}, n=n, seeds=seeds)
    return run_study(study_of, threads, **options)


@pytest.fixture(scope="module")
def runs():
    return repeated([lasting("E02", 2.0), lasting("E01", 1.0)])


def test_first_run_is_the_workflows_bit_for_bit_whatever_the_threads(runs, tmp_path):
    cut = STUDY._replace(experiments={"E02": lasting("E02", 2.0)})
    write_json(to_json(cut), tmp_path / "parameters.json")
    parameters, datum = tmp_path / "parameters.json", tmp_path / "datum" / "E02.nc"
    replayed = tmp_path / "exact" / "replay" / "E02.nc"
    script("datum")(parameters, [datum], 1, "")
    script("replay")(parameters, [datum], [replayed], 1, "")
    mine = runs.sel(experiment="E02").isel(run=0)
    with xr.open_dataset(replayed) as theirs:
        for name in CELLS:
            np.testing.assert_array_equal(mine[name].values, theirs[name].values, err_msg=name)
        stored = theirs["pressure"].values[..., : 2000 // 50 + 1]
        assert np.array_equal(mine["trace_pressure"].values[..., : 2000 // 50 + 1], stored)
    assert np.isfinite(mine["mse"].values).all() and (mine["mse"].values > 0).all()
    # Threads do not matter.
    again = repeated([lasting("E02", 2.0), lasting("E01", 1.0)], threads=1)
    xr.testing.assert_identical(again, runs)


def test_runs_differ_in_their_seed_alone_and_more_begin_with_the_same(runs):
    seeds = runs["seed"].sel(experiment="E02").values.tolist()
    assert seeds == seeds_of(lasting("E02", 2.0), 3)
    assert seeds[0] == 666 and len(set(seeds)) == 3
    e = lasting("E02", 2.0)
    alone = one_run(e.with_seed(seeds[2]), STUDY.n, traced=False)
    assert np.array_equal(runs["mse"].sel(experiment="E02").isel(run=2).values, alone["mse"].values)
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


def test_a_wrong_k_0_is_the_cylinders():
    """The run has the cylinder's k_0; the models take the configured one, or know the cylinder's."""
    e, n = lasting("E02", 2.0), (1.2, 1.3)
    wrong, right, full = mse_at_other_k_0(e, n, 4.0)
    recording = record(e._replace(plant=e.plant._replace(k_0=4 * e.plant.k_0)))
    knowing = lane_array([lane(model, value, 1.4) for model in MODELS.values() for value in n])
    mistaken = knowing.copy()
    mistaken[:, Lane._fields.index("wall_scale")] /= 4
    for cells, lanes in ((wrong, mistaken), (right, knowing)):
        expected = replay(recording, lanes, EXACT_SAMPLING, e.steps).mse
        np.testing.assert_array_equal(cells, expected.reshape(cells.shape))
    # The full order with a quarter of the run's k_0: both runs start alike, so its signals are the run's.
    assert full.shape == (2,) and (full > 0).all()
    np.testing.assert_allclose(
        full, full_order_mse(recording, [full_order_lane(1.4, 0.25)], EXACT_SAMPLING)[0], rtol=1e-12
    )
    assert (mse_at_other_k_0(e, n, 1.0)[2] < 1e-9 * full).all()  # told the truth it is the run
    walled = np.isin(list(MODELS), WITH_WALL)
    assert np.array_equal(wrong[~walled], right[~walled])
    assert (wrong[walled] != right[walled]).all()


def test_models_that_take_the_configured_plant_where_valve_or_dead_volumes_are_off():
    e, n = lasting("E02", 1.0), (1.2, 1.3)
    known = KnownWithin(2.0, valve=0.05)
    smaller, larger = cylinder_ranking.off_plants(e.plant, known)[::2][:2]
    assert smaller.valve.k_xu / e.plant.valve.k_xu == pytest.approx(0.95)
    assert larger.k_0 / e.plant.k_0 == pytest.approx(0.5)
    larger = larger._replace(k_0=e.plant.k_0)
    reduced, full = cylinder_ranking.mse_on_other_plant(e, n, larger)
    # The same by the run's own signals, with models whose flow is too small. Signals inside a step differ
    # by what 5 % of the flow changes within a millisecond, some 1e-4 of the models' error.
    recording = record(e._replace(plant=larger))
    lanes = [lane(m, value, e.plant.gas.gamma) for m in MODELS.values() for value in n]
    lanes = lane_array([row._replace(flow_scale=row.flow_scale / 1.05) for row in lanes])
    cells = replay(recording, lanes, EXACT_SAMPLING, e.steps)
    np.testing.assert_allclose(reduced, cells.mse.reshape(reduced.shape), rtol=1e-2)
    told = full_order_mse(recording, [full_order_lane(1.4)._replace(flow_scale=1 / 1.05)], EXACT_SAMPLING)[0]
    np.testing.assert_allclose(full, told, rtol=1e-2)
    cells = one_run(e, n, traced=False, known=known)
    assert tuple(cells["off_plant"].values) == cylinder_ranking.OFF_PLANTS
    # Every combination: k_0 is at its ends together with the valve; dead volumes are exact here.
    both = e.plant._replace(k_0=2 * e.plant.k_0, valve=smaller.valve)
    reduced, full = cylinder_ranking.mse_on_other_plant(e, n, both)
    for name in ("k_0 high, valve low, V_d low", "k_0 high, valve low, V_d high"):
        at = cells.sel(off_plant=name)
        assert np.array_equal(at["mse_of_off_plant"].values, reduced)
        assert np.array_equal(at["mse_of_full_order_off_plant"].values, full)
    single = KnownWithin(1.0, valve=0.05)
    assert len({*cylinder_ranking.off_plants(e.plant, single)}) == 2
    assert len({*cylinder_ranking.off_plants(e.plant, KnownWithin(2.0, 0.05, 0.2))}) == 8
    wrong_volume = cylinder_ranking.off_plants(e.plant, KnownWithin(1.0, dead_volumes=0.2))[3]
    assert wrong_volume.cylinder.V_d_B / e.plant.cylinder.V_d_B == pytest.approx(1.2)
    assert (cylinder_ranking.mse_on_other_plant(e, n, wrong_volume)[1] > 1e3).all()


def test_errors_at_the_ends_of_k_0_and_traces_of_the_first_run(runs):
    wrong, right = runs["mse_of_wrong_k_0"], runs["mse_of_right_k_0"]
    assert tuple(wrong["k_0_end"].values) == K_0_ENDS and (runs["k_0_factor"] == 2.0).all()
    assert wrong.notnull().all() and right.notnull().all()
    e = lasting("E02", 2.0)
    for end, ratio in zip(K_0_ENDS, (0.5, 2.0), strict=True):
        at = wrong.sel(experiment="E02", k_0_end=end).isel(run=0)
        assert np.array_equal(at.values, mse_at_other_k_0(e, STUDY.n, ratio)[0])
    first_run = runs.isel(run=0)
    known = repeated(
        [lasting("E01", 1.0)], seeds=1, known={first_run["cylinder"].values[1]: KnownWithin(1.0)}
    )
    # A factor of one is the configured k_0 itself.
    for name in ("mse_of_wrong_k_0", "mse_of_right_k_0"):
        for end in K_0_ENDS:
            assert np.array_equal(known[name].sel(k_0_end=end).values, known["mse"].values)
    cell = runs.sel(experiment="E01")
    kept = cell["trace_t"].notnull().values
    assert cell.sizes["sample"] == cylinder_ranking.TRACED_SAMPLES and kept.sum() == 1000 // 50 + 1
    assert cell["trace_t"].values[kept][-1] == pytest.approx(1.0)
    P = cell["trace_P"].values[:, kept]
    assert (P[:, 0] == STUDY.experiments["E01"].plant.conditions.P_0).all() and np.ptp(P) > 1e4
