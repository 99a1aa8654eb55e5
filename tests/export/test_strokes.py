"""Strokes from vented chambers to rest at open ports: exported C against Radau on equations of our own.

The independent states are mass and internal energy of each chamber; the piston's release and its stop are
located by events.
"""

from itertools import product

import numpy as np
import pytest
from brief import in_brief
from exported_c import C_COMPILER, CompiledModel
from scipy.integrate import solve_ivp

from pneumo.equations.system import rates, system
from pneumo.export import exported

H, DURATION = 1e-3, 0.3  # s; all strokes but the slowest end within it
PRESSURE, TEMPERATURE = 500.0, 1.0  # Pa, K: what docs/export.md promises
# Sonic conductance, dm^3/(s bar); dead volume, m^3; supply, Pa; direction
GRID = list(product((0.4, 1.5, 4.0), (4e-6, 30e-6), (2e5, 4e5, 7e5, 10e5), (1, -1)))
BRIEF = [(4.0, 4e-6, 10e5, -1), (1.5, 4e-6, 10e5, 1), (0.4, 4e-6, 10e5, -1), (4.0, 30e-6, 2e5, 1)]


def formed(plant, C, V_d, P_s):
    """Plant with an ISO 6358 valve, dry friction and these sizes."""
    gas = plant.gas._replace(elliptic=True, critical_ratio=0.3)
    k_xu = C * 1e-8 * 1.185 * 293.15**0.5 / gas.sonic_coefficient / plant.valve.u_max
    c = plant.conditions
    return plant._replace(
        gas=gas,
        valve=plant.valve._replace(k_xu=k_xu),
        cylinder=plant.cylinder._replace(V_d_A=V_d, V_d_B=V_d, coulomb=10.0, load=-8.0),
        conditions=c._replace(P_s=P_s, P_0=c.P_0 / c.P_s * P_s),
    )


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
@pytest.mark.parametrize(
    ("C", "V_d", "P_s", "sign"),
    [pytest.param(*case, marks=[] if case in BRIEF else pytest.mark.slow) for case in GRID],
)
def test_a_stroke_from_vented_to_rest(C, V_d, P_s, sign, plant, tmp_path):
    chosen = formed(plant, C, V_d, P_s)
    compiled = CompiledModel("full", None, chosen, tmp_path, piston=True)
    expected, c, inputs = reference(chosen, sign), chosen.conditions, [sign * chosen.valve.u_max, 0.0]
    state, off = [-sign * chosen.cylinder.x_max, 0.0, c.P_atm, c.T_amb, c.P_atm, c.T_amb], []
    for row in expected:
        failed, state = compiled.step(inputs, inputs, H, state)
        assert not failed
        off.append(np.abs(np.subtract(state, row)))
    worst = np.max(off, axis=0)
    assert max(worst[2], worst[4]) < PRESSURE and max(worst[3], worst[5]) < TEMPERATURE
    for _ in range(3000):
        failed, state = compiled.step(inputs, inputs, H, state)
        assert not failed
    full, vented = (state[2:4], state[4:6]) if sign > 0 else (state[4:6], state[2:4])
    assert abs(full[0] - P_s) < PRESSURE
    assert abs(vented[0] - c.P_atm) < PRESSURE and abs(vented[1] - c.T_amb) < TEMPERATURE


@C_COMPILER
@pytest.mark.parametrize("model", in_brief(["M1", "M4", "M5", "M8", "M10", "full"], ["M8"]))
@pytest.mark.parametrize("precision", ["double", "float"])
def test_no_step_is_refused_whatever_its_length(model, precision, plant, tmp_path):
    chosen = formed(plant, 4.0, 4e-6, 10e5)
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
