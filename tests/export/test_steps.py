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
from pneumo.equations.system import rates, system
from pneumo.export import exported
from pneumo.physics.models import full_order_lane, lane, lane_array
from pneumo.physics.valve_dynamics import ValveDynamics
from pneumo.simulation.reference import full_order_rates
from pneumo.simulation.replay import replay_one_by_one

N, H = 1.35, 1e-3
BRIEF = [MODELS["M1"], MODELS["M8"], OWN, "full"]
# Of the pressure: the sampled velocity jumps within the step in which the piston meets its stop.
WITHIN = 3e-3


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
    measured = measured._replace(states=run.recording.states)
    lanes = lane_array([full_order_lane(gamma) if model == "full" else lane(model, N, gamma)])
    expected = replay_one_by_one(measured, lanes, INTERPOLATED).pressure[0]
    compiled = CompiledModel(model, N, plant, tmp_path)
    P_0, T_0 = plant.conditions.P_0, plant.conditions.T_0
    state = [P_0, T_0, P_0, T_0] if model == "full" else [P_0, P_0]
    inputs = np.column_stack([run.u, run.x, run.v]).tolist()
    worst = 0.0
    for k, (start, end) in enumerate(pairwise(inputs)):
        failed, state = compiled.step(start, end, H, state)
        assert not failed
        pressures = np.array(state[:: len(state) // 2])
        worst = max(worst, np.max(np.abs(pressures / expected[:, k + 1] - 1)))
    assert worst < WITHIN


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
    failed, _ = compiled.step([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], 1e-3, [float("nan"), 5e5])
    assert failed


def test_only_needed_constants_are_parameters(plant):
    header = exported("M1", None, plant, "c")["M1.h"].decode()
    assert "k_xu" in header and "k_0;" not in header and "float" not in header
    late = ValveDynamics(lag=4e-3, null=0.1, dead_band=0.3)
    every = {constant.name for constant in constants(rough(plant), N, late)}
    assert "valve_" not in header
    header = exported("full", None, rough(plant), "c", piston=True, dynamics=late)["full.h"].decode()
    assert every - {"n", "laminar"} == {name for name in every if f" {name};" in header}
