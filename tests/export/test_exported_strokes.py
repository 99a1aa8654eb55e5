"""Strokes from vented chambers to rest at open ports: exported C against Radau on equations of our own.

The independent states are mass and internal energy of each chamber; the piston's release and its stop are
located by events.
"""

from functools import cache

import numpy as np
import pytest
from brief import in_brief
from exported_c import C_COMPILER, CompiledModel
from scipy.integrate import solve_ivp

from benchmarks.exported_strokes import (
    AT_REST,
    NEVER,
    PRESSURE,
    ROWS,
    SIZES,
    STEPS,
    TEMPERATURE,
    sized,
    strokes,
    template_plant,
)
from pneumo.equations.system import rates, system
from pneumo.export import exported

H, DURATION = 1e-3, 0.3  # s; all strokes but the slowest end within it
REST = 10_000  # steps: air in a large dead volume takes seconds to warm up
BRIEF = [(4.0, 4e-6, 10e5, -1), (1.5, 4e-6, 10e5, 1), (4.0, 30e-6, 2e5, 1)]
CORNERS = [(C, V_d, P_s, 1) for C in (0.4, 4.0) for V_d in (4e-6, 30e-6) for P_s in (2e5, 10e5)]

template = pytest.fixture(cache(template_plant))


def reference(plant, sign):
    """States (x, v, P_A, T_A, P_B, T_B) at every 1 ms of a stroke with the valve fully open."""
    gas, c, cyl, R, g = plant.gas, plant.conditions, plant.cylinder, plant.gas.R, plant.gas.gamma
    A_t, sides = plant.valve.k_xu * plant.valve.u_max, ((cyl.A_A, cyl.V_d_A, 1), (cyl.A_B, cyl.V_d_B, -1))

    def flow(P_u, P_d, T_u):
        above = max((P_d / P_u - gas.critical_ratio) / (1 - gas.critical_ratio), 0.0)
        return A_t * gas.sonic_coefficient * P_u / T_u**0.5 * max(1 - above**2, 0.0) ** 0.5

    def wetted(x):
        return np.pi / 2 * cyl.bore**2 + np.pi * cyl.bore * (x + cyl.stroke / 2)

    def gases(y):
        V = [V_d + A * (cyl.stroke / 2 + way * y[0]) for A, V_d, way in sides]
        P = [(g - 1) * y[3 + 2 * i] / V[i] for i in (0, 1)]
        return V, P, [P[i] * V[i] / (R * y[2 + 2 * i]) for i in (0, 1)]

    def force(P):
        return P[0] * cyl.A_A - P[1] * cyl.A_B + cyl.load

    def rates(t, y, held):
        _, P, T = gases(y)
        v = 0.0 if held else y[1]
        result = [v, 0.0 if held else (force(P) - cyl.k_f * v - cyl.coulomb * sign) / cyl.M]
        for i, (A, _, way) in enumerate(sides):
            port = c.P_s if way * sign > 0 else c.P_atm
            fills = port >= P[i]
            m = flow(port, P[i], c.T_in) if fills else -flow(P[i], port, T[i])
            k = plant.k_0 * wetted(way * y[0]) / wetted(0.0) * max(P[i] * T[i] / (c.P_0 * c.T_0), 0) ** 0.5
            enthalpy = g * R / (g - 1) * m * (c.T_in if fills else T[i])
            result += [m, enthalpy - P[i] * A * way * v + k * (c.T_amb - T[i])]
        return result

    def released(t, y, held):
        return sign * force(gases(y)[1]) - cyl.coulomb

    def met(t, y, held):
        return cyl.x_max - sign * y[0]

    released.terminal, released.direction, met.terminal, met.direction = True, 1, True, -1
    x = -sign * cyl.x_max
    y, t, at = [x, 0.0], 0.0, np.arange(1, round(DURATION / H) + 1) * H
    for A, V_d, way in sides:
        V = V_d + A * (cyl.stroke / 2 + way * x)
        y += [c.P_atm * V / (R * c.T_amb), c.P_atm * V / (g - 1)]
    atol, rows = [1e-9, 1e-9, 1e-13, 1e-5, 1e-13, 1e-5], list[np.ndarray]()
    for held, event in ((True, released), (False, met), (True, released)):
        part = solve_ivp(
            rates,
            (t, at[-1]),
            y,
            method="Radau",
            rtol=1e-9,
            atol=atol,
            events=event,
            args=(held,),
            dense_output=True,
            max_step=0.02,
        )
        rows += [part.sol(time) for time in at if t < time <= part.t[-1]]
        t, y = part.t[-1], part.y[:, -1].copy()
        if event is met and part.status == 1:
            y[:2] = sign * cyl.x_max, 0.0
        if part.status == 0:
            break
    states = []
    for y in rows:
        _, P, T = gases(y)
        states.append([y[0], y[1], P[0], T[0], P[1], T[1]])
    return np.array(states)


@C_COMPILER
@pytest.mark.parametrize(("C", "V_d", "P_s", "sign"), in_brief(SIZES, BRIEF))
def test_a_stroke_from_vented_to_rest_is_that_of_another_solver(C, V_d, P_s, sign, template, tmp_path):
    chosen = sized(template, C, V_d, P_s)
    compiled = CompiledModel("full", None, chosen, tmp_path, piston=True)
    c, inputs = chosen.conditions, [sign * chosen.valve.u_max, 0.0]
    state = [-sign * chosen.cylinder.x_max, 0.0, c.P_atm, c.T_amb, c.P_atm, c.T_amb]
    for expected in reference(chosen, sign):
        failed, state = compiled.step(inputs, inputs, H, state)
        off = np.abs(np.subtract(state, expected))
        assert not failed and off[[2, 4]].max() < PRESSURE and off[[3, 5]].max() < TEMPERATURE
    for _ in range(REST):
        failed, state = compiled.step(inputs, inputs, H, state)
        assert not failed
    full, vented = (state[2:4], state[4:6]) if sign > 0 else (state[4:6], state[2:4])
    assert abs(full[0] - P_s) < PRESSURE and abs(vented[0] - c.P_atm) < PRESSURE
    assert abs(vented[1] - c.T_amb) < TEMPERATURE


@C_COMPILER
@pytest.mark.parametrize(
    ("row", "sizes"),
    in_brief(
        [(row, sizes) for sizes in ("corners", "all") for row in ROWS],
        [(row, "corners") for row in ("full", "M5", "M9")],
    ),
)
def test_strokes_of_every_model_keep_to_fine_steps(row, sizes, template):
    """With the valve open, or shut when the piston rests; M5 and M9 come nearest to the limit."""
    chosen = CORNERS if sizes == "corners" else SIZES
    cases = [(*sizes, shut) for sizes in chosen for shut in (NEVER, AT_REST)]
    for h in STEPS:
        for case, made in zip(cases, strokes(row, template, h, cases), strict=True):
            assert made.pressure < PRESSURE and made.temperature < TEMPERATURE and not made.failed, (
                case,
                made,
            )


@C_COMPILER
@pytest.mark.parametrize("model", in_brief(["M1", "M4", "M5", "M8", "M10", "full"], ["M8"]))
@pytest.mark.parametrize("precision", ["double", "float"])
def test_no_step_is_refused_whatever_its_length(model, precision, template, tmp_path):
    chosen = sized(template, 4.0, 4e-6, 10e5)
    compiled = CompiledModel(model, 1.35, chosen, tmp_path, precision, piston=True)
    c = chosen.conditions
    for h in (1e-5, 1e-3, 0.02):
        state = compiled.system.state(x=-chosen.cylinder.x_max, v=0.0, P=c.P_atm, T=c.T_amb)
        for k in range(200):
            inputs = [(chosen.valve.u_max, -chosen.valve.u_max)[k // 50 % 2], 0.0]
            failed, state = compiled.step(inputs, inputs, h, state)
            assert not failed and np.all(np.isfinite(state))


def test_exports_say_which_models_drift_with_the_valve_shut(plant):
    """What is said is right: by the rates of the exported system itself, with no flow at rest."""
    c = plant.conditions
    for model, drifts in (("full", 0), ("M1", 0), ("M6", 0), ("M7", 1), ("M8", 1), ("M10", 1)):
        states = [c.P_atm, c.T_amb] * 2 if model == "full" else [c.P_atm] * 2
        rate = rates(system(model, 1.35, plant, valve=False), states, [0.0] * 4)[0]
        assert (abs(rate) > 1e3) == bool(drifts)
        for target, name in (("c", f"{model}.c"), ("st", f"{model}.st"), ("casadi", f"{model}.py")):
            said = exported(model, 1.35, plant, target)[name].decode()
            assert ("drifts to P_0" in " ".join(said.split())) == bool(drifts)
