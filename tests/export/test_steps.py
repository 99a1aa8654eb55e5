"""Exported C that steps: against the study's right-hand side, another solver, and Python in every form."""

from itertools import pairwise

import numpy as np
import pytest
from brief import in_brief
from exported_c import C_COMPILER, CompiledModel, run_test_program
from plain_rates import EVERY, OWN
from readable_equations import full_order_rates
from scipy.integrate import solve_ivp

from pneumo import MODELS
from pneumo.configuration.experiment import Drive
from pneumo.equations.system import rates, step, system
from pneumo.export import exported

N, H = 1.35, 1e-3
BRIEF = [MODELS["M1"], MODELS["M8"], OWN, "full"]


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


def integrated(chosen, state, start, end, h, rtol=1e-11):
    """State after h s by another solver, with inputs that change linearly."""

    def rate(t, y):
        return rates(chosen, y.tolist(), [a + t / h * (b - a) for a, b in zip(start, end, strict=True)])

    return solve_ivp(rate, (0, h), state, method="LSODA", rtol=rtol, atol=1e-9).y[:, -1]


@C_COMPILER
@pytest.mark.parametrize(
    "model", in_brief([*EVERY, "full"], BRIEF), ids=lambda model: getattr(model, "name", model)
)
@pytest.mark.parametrize("piston", [False, True])
def test_the_error_falls_with_the_square_of_the_substep(model, piston, lopsided, tmp_path):
    """Against another solver, on 10 ms without a kink: chamber A fills, chamber B empties."""
    compiled = CompiledModel(model, N, lopsided, tmp_path, piston=piston)
    state = compiled.system.state(x=0.0, v=0.1, P=4e5, T=290.0)
    start, end, duration = (
        ([2.0, 0.0], [3.0, 30.0], 0.01) if piston else ([2.0, 0.0, 0.1], [3.0, 1e-3, 0.1], 0.01)
    )
    expected, off = integrated(compiled.system, state, start, end, duration), []
    for count in (120, 240, 480):  # the longest is shorter than any substep
        now = state
        for k in range(count):
            at = [[a + (k + i) / count * (b - a) for a, b in zip(start, end, strict=True)] for i in (0, 1)]
            failed, now = compiled.step(*at, duration / count, now)
            assert not failed
        off.append(np.abs((np.array(now) - expected) / compiled.system.scale).max())
    assert off[0] < 1e-5
    # A stage's flow out leaves out what wall heat does to the temperature meanwhile: of first order, 0.01 Pa.
    assert np.all(np.log2(np.divide(off[:-1], off[1:])) > 1.8) or off[0] < 1e-7


@C_COMPILER
@pytest.mark.parametrize(
    "model", in_brief([*EVERY, "full"], BRIEF), ids=lambda model: getattr(model, "name", model)
)
def test_steps_of_1_ms_keep_to_another_solver(model, lopsided, tmp_path):
    """Within the 0.5 kPa and 1 K of docs/export.md where valve and piston change their direction."""
    compiled = CompiledModel(model, N, lopsided, tmp_path)
    t = np.arange(301) * H
    inputs = np.column_stack([6 * np.sin(60 * t), 0.03 * np.sin(30 * t), 0.9 * np.cos(30 * t)]).tolist()
    c = lopsided.conditions
    state = exact = compiled.system.state(P=c.P_0, T=c.T_0)
    for start, end in pairwise(inputs):
        failed, state = compiled.step(start, end, H, state)
        exact = integrated(compiled.system, exact, start, end, H, rtol=1e-7)  # 0.1 Pa
        off = np.abs(np.subtract(state, exact)).reshape(2, -1)
        assert not failed and off[:, 0].max() < 500 and off[:, 1:].max(initial=0) < 1


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


@pytest.mark.parametrize("way", [-1, 1])
def test_a_piston_leaves_its_stop_when_the_force_turns_and_not_before(way, plant):
    cylinder, P, push, h = plant.cylinder, 4e5, 0.1, 9e-5  # N into the stop, s: one substep
    x = cylinder.x_max if way > 0 else cylinder.x_min
    force = way * push - P * (cylinder.A_A - cylinder.A_B) - cylinder.load
    for u in (8.0, -8.0):
        inputs = [way * u, force]
        after = step(system("M3", None, plant, piston=True), [x, 0.0, P, P], inputs, inputs, h)
        F = after[2] * cylinder.A_A - after[3] * cylinder.A_B + cylinder.load + force
        since = F / (F - way * push)  # fraction of the step after the turn, with a force linear in time
        expected = F * since * h / 2 / cylinder.M if u < 0 else 0.0
        assert F * way * u > 0 and after[:2] == [x, pytest.approx(expected, rel=1e-2)]


@C_COMPILER
def test_a_step_out_of_the_positive_numbers_says_so(plant, tmp_path):
    compiled = CompiledModel("M1", None, plant, tmp_path)
    failed, _ = compiled.step([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], 1e-3, [float("nan"), 5e5])
    assert failed
