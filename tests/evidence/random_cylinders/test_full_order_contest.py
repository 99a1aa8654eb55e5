"""The full order in the contest: what each row is told, and what it must not know."""

import numpy as np
import pytest
import xarray as xr

from pneumo.configuration.sampling import EXACT_SAMPLING, INTERPOLATED
from pneumo.evidence.random_cylinders import contest_statistics as s
from pneumo.evidence.random_cylinders import full_order_contest as c
from pneumo.evidence.random_cylinders.cylinder_runs import random_experiments
from pneumo.physics.models import full_order_lane, lane_array
from pneumo.simulation.full_order import record
from pneumo.simulation.replay import full_order_mse, replay_one_by_one

EXPERIMENT = random_experiments(3)[1]._replace(steps=1500, pressure_stride=1500)
GRID = (1.0, 1.2, 1.4)


@pytest.fixture(scope="module")
def recording():
    return record(EXPERIMENT)


def test_the_full_order_with_the_runs_parameters_follows_it_to_rounding(recording):
    # The same equations by the same steps: only the order of sums differs.
    assert full_order_mse(recording, [full_order_lane(1.4)], EXACT_SAMPLING).max() ** 0.5 < 1e-6  # Pa


@pytest.mark.parametrize("k_0, valve", [(0.5, 1.0), (2.7, 0.97)])
def test_a_row_is_the_full_order_of_the_plant_as_told(recording, k_0, valve):
    told = c.Told(k_0, valve)
    other = recording._replace(plant=told.plant(recording.plant))
    # Signals of the run, chambers of the plant as told: samples, since exact signals would be run again.
    lanes = lane_array([full_order_lane(1.4)])
    pressure = replay_one_by_one(other._replace(most_halvings=0), lanes, INTERPOLATED).pressure[0]
    expected = ((pressure - recording.states[:, [2, 4]].T) ** 2).mean(axis=1)
    row = told.full_order("true", 1.4)
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


def invented_runs(cylinders=40, seed=0):
    """Runs in which M6 is best, at n = 1.4 - 0.3/(1 + thermal), and the full order's error is stated."""
    rng, n = np.random.default_rng(seed), np.array(c.GRID_N)
    shape = cylinders, 2
    thermal = np.exp(rng.uniform(np.log(0.05), np.log(50), shape))
    size = np.exp(rng.normal(12, 1, shape))
    best_n = 1.4 - 0.3 / (1 + thermal)
    by_n = 1 + 40 * (n - best_n[..., None]) ** 2
    model = {"M6": 1.0, "M5": 4.0, "M7": 3.0, "M8": 2.0, "M9": 2.5, "M10": 2.2}
    factors = np.array([model.get(name, 9.0) for name in c.WITHOUT_K_0])
    without = size[..., None, None] * factors[:, None] * by_n[..., None, :]
    off = np.abs(np.log(c.K_0_TOLD))
    with_k_0 = (
        (size[..., None] * (1 + off))[..., None, None]
        * np.array([model[name] for name in c.WITH_K_0])[:, None]
        * by_n[..., None, None, :]
    )
    tried = np.isin(
        np.arange(15), [3 * c.K_0_TOLD.index(t.k_0) + c.VALVE_TOLD.index(t.valve) for t in c.TOLD]
    )
    full = np.where(tried, 0.2 + np.repeat(off, 3) / 2, np.nan).reshape(5, 3)
    lowest = without[..., c.WITHOUT_K_0.index("M6"), :].min(axis=-1)
    simulated = np.where(tried.reshape(5, 3), 1.1, np.nan)[..., None] * np.ones(4)
    values = {
        "mse_without_k_0": without,
        "mse_with_k_0": with_k_0,
        "mse_full": lowest[..., None, None, None] * np.stack([full, 2 * full]),
        "mse_adiabatic": 0.5 * lowest,
        "mse_simulated": lowest[..., None, None, None] * simulated,
        "thermal": thermal,
        "swing": 10 * np.sqrt(lowest),
        "cut": np.zeros(shape, dtype=np.int8),
        "run_status": np.zeros(shape, dtype=np.int8),
        "held_out": (np.arange(cylinders) >= cylinders // 2).astype(np.int8),
    }
    dims = {name: ["cylinder", "loop", *about[0].split()] for name, about in c.RUN_VARIABLES.items()}
    dims |= {"run_status": ["cylinder", "loop"], "held_out": ["cylinder"]}
    coords = {"loop": ["open", "closed"], "n": n, "model_without_k_0": list(c.WITHOUT_K_0)}
    coords |= {"model_with_k_0": list(c.WITH_K_0), "k_0_told": list(c.K_0_TOLD), "law": list(c.LAWS)}
    coords |= {"valve_told": list(c.VALVE_TOLD), "carried": ["best", *c.FIXED_MODELS]}
    coords["cylinder"] = np.arange(cylinders)
    return xr.Dataset({name: (dims[name], value) for name, value in values.items()}, coords)


def row_of(contest, choice, k_0=1.0, valve=1.0):
    """Row of a choice at a k_0 and valve told."""
    at = (
        (contest["choice"] == choice)
        & np.isclose(contest["row_k_0"], k_0)
        & np.isclose(contest["row_valve"], valve)
    )
    return contest.isel(row=int(np.flatnonzero(at)[0]))


@pytest.mark.slow
def test_tables_of_invented_runs_say_what_was_put_in():
    runs = invented_runs()
    paper = runs.isel(loop=0, cylinder=[0, 1]).rename(cylinder="experiment")
    contest = s.contest_statistics(runs, paper.drop_vars(["held_out", "loop"]), 1.0, ("M6", "M8"))
    assert row_of(contest, s.BEFOREHAND, 0.5)["paper_error"].values == pytest.approx([1.1, 1.1])
    assert row_of(contest, "full order, adiabatic")["paper_error"].values == pytest.approx([0.5, 0.5])
    assert row_of(contest, "M6 in hindsight")["error"].sel(part="all").values == pytest.approx([1, 1, 1])
    assert row_of(contest, s.BEFOREHAND)["error"].sel(part="all", bound="value") == pytest.approx(1.1)
    assert row_of(contest, "M6 by rule")["error"].sel(part="all", bound="value") < 1.05
    assert row_of(contest, "M6 at 1.35")["error"].sel(part="all", bound="value") > 1.05
    law = 0.2 + np.log(2.7) / 2
    at = row_of(contest, "full order, true law", 2.7, 0.97)
    assert at["error"].sel(part="open", bound="value") == pytest.approx(law)
    assert at["of_swing"].sel(part="all") == pytest.approx(0.1 * law**0.5)
    case = (contest["full"] == "full order, constant law") & (contest["case_k_0"] == 2.0)
    expected = 2 * (0.2 + np.log(2) / 2) / 1.1
    assert contest["full_quotient"].isel(case=case).sel(part="all", bound="value") == pytest.approx(expected)
    assert contest["runs"].sel(part="all") == 40 and contest["cylinders"].sel(part="all") == 20
    # The truth told the truth is no row, and 20 cylinders are no answer.
    full = contest["choice"] == "full order, true law"
    assert not (full & (contest["row_k_0"] == 1) & (contest["row_valve"] == 1)).any()
    assert s.answer(contest) == "no answer: fewer than 200 cylinders held out"
    many = contest.assign(cylinders=contest["cylinders"] * 20)
    assert s.answer(many) == "depends on what is known"  # 2 * 0.7 / 1.1 is no gain
    gain = many.assign(full_quotient=many["full_quotient"] * 0.5)
    assert s.answer(gain) == "carry the full order"


def test_the_rules_do_not_see_the_half_held_out():
    runs = invented_runs()
    rules = [s.fitted_rule(runs, model) for model in s.RULED]
    held = runs["held_out"] == 1
    changed = runs.assign(
        mse_without_k_0=runs["mse_without_k_0"].where(~held, runs["mse_without_k_0"][..., ::-1].values),
        mse_with_k_0=runs["mse_with_k_0"].where(~held, runs["mse_with_k_0"][..., ::-1].values),
        thermal=runs["thermal"].where(~held, 1 / runs["thermal"]),
    )
    assert [s.fitted_rule(changed, model) for model in s.RULED] == rules
    swapped = runs.assign(held_out=1 - runs["held_out"]).assign(thermal=1 / runs["thermal"])
    assert [s.fitted_rule(swapped, model) for model in s.RULED] != rules


def test_a_rule_knows_the_k_0_told_and_not_the_cylinders():
    runs = invented_runs()
    told = s.told_group(runs).sel(k_0_told=2.0, drop=True)
    twice = s.told_group(runs.assign(thermal=runs["thermal"] / 2)).sel(k_0_told=1.0, drop=True)
    xr.testing.assert_allclose(told, twice)
