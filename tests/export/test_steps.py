"""Exported C that steps: against the study's own runs and replays, and its test program in every form."""

from itertools import pairwise

import numpy as np
import pytest
from brief import in_brief
from exported_c import C_COMPILER, CompiledModel, run_test_program
from plain_rates import EVERY, OWN

from pneumo import MODELS, recorded, simulate
from pneumo.configuration.experiment import Drive
from pneumo.configuration.sampling import INTERPOLATED
from pneumo.equations.equation_list import constants
from pneumo.equations.system import METHODS, rates, step, system
from pneumo.export import exported
from pneumo.linear.linear_analysis import stability_function, stable_steps
from pneumo.linear.linear_model import state_matrix
from pneumo.physics.models import full_order_lane, lane, lane_array
from pneumo.physics.valve_dynamics import ValveDynamics
from pneumo.simulation.reference import full_order_rates, full_order_step
from pneumo.simulation.replay import replay_one_by_one

N, H = 1.35, 1e-3
BRIEF = [MODELS["M1"], MODELS["M8"], OWN, "full"]
# Some hundred roundings, 1.1e-16 each, in every step; earlier ones die out.
ROUNDING = 1e-12


def rough(plant):
    """The plant with load, dry friction, narrow stops and unlike dead volumes; its valve leaks, unevenly."""
    V_d_B = 1.7 * plant.cylinder.V_d_A
    cylinder = plant.cylinder._replace(load=20.0, coulomb=15.0, x_min=-0.02, x_max=0.02, V_d_B=V_d_B)
    return plant._replace(cylinder=cylinder, valve=plant.valve._replace(leak=1e-8, exhaust=0.7))


def some_states(plant, count, seed=7):
    """States and inputs of a full-order actuator, the first few at rest on the stops."""
    rng, c = np.random.default_rng(seed), plant.conditions
    low = (plant.cylinder.x_min, -1.0, 0.6 * c.P_atm, 220.0, 0.6 * c.P_atm, 220.0, -12.0, -200.0)
    high = (plant.cylinder.x_max, 1.0, 1.3 * c.P_s, 380.0, 1.3 * c.P_s, 380.0, 12.0, 200.0)
    states = rng.uniform(low, high, (count, 8))
    for i, x in enumerate(
        (plant.cylinder.x_min, plant.cylinder.x_max, plant.cylinder.x_min, plant.cylinder.x_max)
    ):
        states[i, :2] = x, 0.0
        states[i, 7] = 1e3 * (1 if i < 2 else -1)
    states[4, 1] = 0.0
    return states.tolist()


@pytest.mark.parametrize("form", [lambda plant: plant, rough])
def test_equations_in_their_order_are_the_study_s_right_hand_side_to_the_bit(form, plant):
    formed = form(plant)
    chosen, drive = system("full", None, formed, piston=True), Drive(False, 0.0, np.inf)
    for *state, u, force in some_states(formed, 300):
        expected = full_order_rates(np.array(state), u, drive, formed, force)
        assert rates(chosen, state, [u, force]) == expected.tolist()
        after = full_order_step(np.array(state), u, drive, formed, 1e-4, force)
        stepped = step(chosen, METHODS["DORMAND_PRINCE"], state, [u, force], [u, force], 1e-4)
        np.testing.assert_allclose(stepped, after, rtol=1e-14, atol=1e-16)  # sums may be compensated


@pytest.fixture(scope="module")
def lopsided(plant):
    """The plant with chambers of unlike dead volumes."""
    return plant._replace(cylinder=plant.cylinder._replace(V_d_B=1.7 * plant.cylinder.V_d_A))


@pytest.fixture(scope="module")
def run(lopsided):
    """A full-order run of a second that takes the piston into its stops."""
    t = np.arange(1000) * H
    return simulate(lopsided, H, command=1.5 * np.sign(np.sin(17 * t) + np.sin(29 * t)) + 6.0 * (t > 0.7))


@C_COMPILER
@pytest.mark.parametrize(
    "model", in_brief([*EVERY, "full"], BRIEF), ids=lambda model: getattr(model, "name", model)
)
def test_steps_of_the_chambers_are_those_of_a_replay(model, run, lopsided, tmp_path):
    plant = lopsided
    measured = recorded(plant, H, u=run.u, x=run.x, v=run.v, P_A=run.P_A, P_B=run.P_B).recording
    gamma = plant.gas.gamma
    measured = measured._replace(
        states=run.recording.states, most_halvings=0
    )  # in steps of 1 ms, as C has them
    lanes = lane_array([full_order_lane(gamma) if model == "full" else lane(model, N, gamma)])
    expected = replay_one_by_one(measured, lanes, INTERPOLATED).pressure[0]
    compiled = CompiledModel(model, N, plant, tmp_path)
    P_0, T_0 = plant.conditions.P_0, plant.conditions.T_0
    state = [P_0, T_0, P_0, T_0] if model == "full" else [P_0, P_0]
    inputs = np.column_stack([run.u, run.x, run.v]).tolist()
    worst = 0.0
    for k, (start, end) in enumerate(pairwise(inputs)):
        failed, state = compiled.step("DORMAND_PRINCE", start, end, H, state)
        assert not failed
        pressures = np.array(state[:: len(state) // 2])
        worst = max(worst, np.max(np.abs(pressures / expected[:, k + 1] - 1)))
    assert worst < ROUNDING


@C_COMPILER
@pytest.mark.parametrize("form", [lambda plant: plant, rough])
def test_steps_of_the_actuator_are_those_of_the_full_order_run(form, plant, tmp_path):
    formed = form(plant)
    t = np.arange(1500) * H
    command = 3.0 * np.sign(np.sin(11 * t)) + 2.0 * np.sin(60 * t)
    run = simulate(formed, H, command=command)
    assert np.sum(run.x == formed.cylinder.x_max) > 10  # it met its stop
    compiled = CompiledModel("full", None, formed, tmp_path, piston=True)
    state, scale, worst = run.recording.states[0].tolist(), [0.1, 1.0, 1e5, 293.0, 1e5, 293.0], 0.0
    for k, u in enumerate(command[:-1].tolist()):
        parts = 1 << int(run.recording.halvings[k])
        for _ in range(parts):
            failed, state = compiled.step("DORMAND_PRINCE", [u, 0.0], [u, 0.0], H / parts, state)
            assert not failed
        worst = max(worst, np.max(np.abs(state - run.recording.states[k + 1]) / scale))
    assert worst < ROUNDING


FORMS = [
    *((model, "double", True, True) for model in EVERY),
    *(
        ("full", precision, valve, piston)
        for precision in ("double", "float")
        for valve in (0, 1)
        for piston in (0, 1)
    ),
    ("M10", "float", True, True),
]
BRIEF_FORMS = [(MODELS["M8"], "double", True, True), ("full", "double", 1, 1), ("full", "float", 0, 0)]


@C_COMPILER
@pytest.mark.parametrize(("model", "precision", "valve", "piston"), in_brief(FORMS, BRIEF_FORMS))
def test_the_test_program_agrees_with_python(model, precision, valve, piston, plant, tmp_path):
    formed, parts = rough(plant) if model is OWN else plant, {"valve": bool(valve), "piston": bool(piston)}
    files = exported(model, N, formed, "c", precision=precision, stem="model", **parts)
    code, said = run_test_program(files, tmp_path)
    assert code == 0, said
    if precision == "float":
        assert b"double" not in files["model.c"] + files["model.h"]


@C_COMPILER
def test_the_test_program_sees_a_wrong_constant(plant, tmp_path):
    files = exported("M8", N, plant, "c", stem="model")
    right, wrong = (f"{k_0!r}, /* k_0 */".encode() for k_0 in (plant.k_0, 1.00002 * plant.k_0))
    assert right in files["model.c"]
    code, said = run_test_program(files | {"model.c": files["model.c"].replace(right, wrong)}, tmp_path)
    assert code == 1 and "largest relative difference" in said


@C_COMPILER
def test_a_step_out_of_the_positive_numbers_says_so(plant, tmp_path):
    compiled = CompiledModel("M1", None, plant, tmp_path)
    failed, _ = compiled.step("EULER", [0.0, -0.049, 100.0], [0.0, -0.049, 100.0], 1e-3, [5e5, 5e5])
    assert failed


def test_only_needed_constants_are_parameters(plant):
    header = exported("M1", None, plant, "c")["M1.h"].decode()
    assert "k_xu" in header and "k_0;" not in header and "float" not in header
    late = ValveDynamics(lag=4e-3, null=0.1, dead_band=0.3)
    every = {constant.name for constant in constants(rough(plant), N, late)}
    assert "valve_" not in header
    header = exported("full", None, rough(plant), "c", piston=True, dynamics=late)["full.h"].decode()
    assert every - {"n", "laminar"} == {name for name in every if f" {name};" in header}


# Stability


@pytest.mark.parametrize(("method", "reach"), [("EULER", 2.0), ("RK4", 2.785), ("DORMAND_PRINCE", 3.307)])
def test_stability_reaches_as_far_as_the_literature_says(method, reach):
    """Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.2."""
    inside, outside = np.abs(stability_function(METHODS[method], -np.array([reach - 2e-3, reach + 2e-3])))
    assert inside < 1 < outside


@pytest.mark.parametrize("method", in_brief(METHODS, ["RK4"]))
def test_errors_die_out_below_the_stable_step_and_grow_above(method, plant):
    leaking = plant._replace(valve=plant.valve._replace(leak=2e-8))
    chosen, inputs = system("M8", N, leaking), [0.5, 0.0, 0.0]
    state = [5e5, 4e5]
    for _ in range(3000):
        state = step(chosen, METHODS["RK4"], state, inputs, inputs, 2e-3)
    fastest = float(np.abs(np.linalg.eigvals(state_matrix(chosen, state, inputs))).max())
    reach = {"EULER": 2.0, "RK4": 2.785, "DORMAND_PRINCE": 3.307}[method]
    for factor, dies in ((0.95, True), (1.05, False)):
        disturbed = [P + 1.0 for P in state]
        for _ in range(60):
            disturbed = step(chosen, METHODS[method], disturbed, inputs, inputs, factor * reach / fastest)
        assert (np.max(np.abs(np.subtract(disturbed, state))) < 0.5) == dies


def test_stable_steps_are_of_the_stiffest_point(plant):
    """Of M1 without valve only n A v / V is left, largest at a stop: eq (10)."""
    cylinder = plant.cylinder
    steps = stable_steps(system(MODELS["M1"], None, plant, valve=False))
    V = cylinder.V_d_A + cylinder.A_A * 0.001 * cylinder.stroke / 2
    expected = 2.0 / (cylinder.A_A * 1.0 / V)
    assert steps["EULER"] == pytest.approx(expected, rel=0.01)  # the border is found in steps of 0.01
    assert steps["EULER"] < steps["RK4"] < steps["DORMAND_PRINCE"]
