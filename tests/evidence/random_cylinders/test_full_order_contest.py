"""The full order in the contest: what each row is told, and what it must not know."""

import numpy as np
import pytest

from pneumo.configuration.sampling import EXACT_SAMPLING, INTERPOLATED
from pneumo.evidence.random_cylinders import full_order_contest as c
from pneumo.evidence.random_cylinders.cylinder_runs import random_experiments
from pneumo.simulation.chamber_replay import replay_chambers
from pneumo.simulation.full_order import record
from pneumo.simulation.full_order_replay import FullRow, full_order_mse

EXPERIMENT = random_experiments(3)[1]._replace(steps=1500, pressure_stride=1500)
GRID = (1.0, 1.2, 1.4)


@pytest.fixture(scope="module")
def recording():
    return record(EXPERIMENT)


def test_the_full_order_with_the_runs_parameters_follows_it_to_rounding(recording):
    # The same equations by the same steps: only the order of sums differs.
    assert full_order_mse(recording, [FullRow()], EXACT_SAMPLING).max() ** 0.5 < 1e-6  # Pa


@pytest.mark.parametrize("k_0, valve", [(0.5, 1.0), (2.7, 0.97)])
def test_a_row_is_the_full_order_of_the_plant_as_told(recording, k_0, valve):
    told = c.Told(k_0, valve)
    other = recording._replace(plant=told.plant(recording.plant))
    # Signals of the run, chambers of the plant as told: samples, since exact signals would be run again.
    pressure = replay_chambers(other._replace(most_halvings=0), INTERPOLATED)
    expected = ((pressure - recording.states[:, [2, 4]].T) ** 2).mean(axis=1)
    row = told.full_row("true")
    mse = full_order_mse(recording._replace(most_halvings=0), [row], INTERPOLATED)[0]
    np.testing.assert_allclose(mse, expected, rtol=1e-9)


def test_the_simulation_knows_what_is_told_and_not_the_cylinder():
    told = c.Told(2.0, 1.03)
    plant = EXPERIMENT.plant
    wrong = plant._replace(k_0=2 * plant.k_0, valve=plant.valve._replace(k_xu=1.03 * plant.valve.k_xu))
    by_truth = c.simulated_choice(EXPERIMENT, told, 5, GRID)
    by_wrong = c.simulated_choice(EXPERIMENT._replace(plant=wrong), c.Told(1.0, 1.0), 5, GRID)
    assert by_truth == by_wrong  # only the product of truth and factor plays a role


def test_no_row_but_the_told_one_follows_the_run_and_the_choice_is_not_of_the_run():
    run = c.contest_run(EXPERIMENT, 5, GRID)
    full = run["mse_full"]
    assert full.sel(law="true", k_0_told=1, valve_told=1) < 1e-9 * full.sel(
        law="true", k_0_told=2, valve_told=1
    )
    tried = [(told.k_0, told.valve) for told in c.TOLD]
    for k_0 in c.K_0_TOLD:
        for valve in c.VALVE_TOLD:
            at = {"k_0_told": k_0, "valve_told": valve}
            assert (full.sel(at).notnull() == ((k_0, valve) in tried)).all()
            assert (run["mse_simulated"].sel(at).notnull() == ((k_0, valve) in tried)).all()
    at = {"k_0_told": 2.0, "valve_told": 1.0}
    n = run["simulated_n"].sel(at | {"carried": "M8"}).item()
    assert run["mse_simulated"].sel(at | {"carried": "M8"}).item() == pytest.approx(
        run["mse_with_k_0"].sel(k_0_told=2.0, model_with_k_0="M8", n=n).item(), rel=1e-12
    )
    # With another seed the simulation, and so perhaps n, is another; the errors by n stay.
    again = c.contest_run(EXPERIMENT, 6, GRID)
    assert again["mse_with_k_0"].equals(run["mse_with_k_0"]) and again["mse_full"].equals(full)
    assert run["swing"].item() == pytest.approx(
        np.sqrt(record(EXPERIMENT).states[:, [2, 4]].var(axis=0).mean()), rel=1e-12
    )
