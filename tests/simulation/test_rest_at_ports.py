"""Runs into rest at open ports, where the slope of eq (1) is infinite: against Radau, and by balances."""

from itertools import product

import numpy as np
import pytest
from brief import in_brief
from hypothesis import given
from hypothesis import strategies as st
from radau_strokes import radau_stroke

import pneumo
from benchmarks.exported_strokes import sized, template_plant

H, OPENED, SHUT = 1e-3, 1.0, 3.0  # s
PLANT = template_plant()
CASES = list(product((0.4, 1.5, 4.0), (4e-6, 30e-6), (4e5, 7e5), (1, -1), ("rest", "vented")))
BRIEF = [(4.0, 30e-6, 7e5, 1, "rest")]


@pytest.mark.parametrize(("C", "V_d", "P_s", "sign", "start"), in_brief(CASES, BRIEF))
def test_runs_into_rest_and_then_shut_are_those_of_radau(C, V_d, P_s, sign, start):
    plant = sized(PLANT, C, V_d, P_s)
    if start == "rest":  # nothing holds the piston in mid-stroke
        plant = plant._replace(cylinder=plant.cylinder._replace(coulomb=0.0))
    u = np.where(
        np.arange(round((OPENED + SHUT) / H) + 1) * H < OPENED - H / 2, sign * plant.valve.u_max, 0.0
    )
    c = plant.conditions
    vented = (-sign * plant.cylinder.x_max, 0.0, c.P_atm, c.T_amb, c.P_atm, c.T_amb)
    run = pneumo.simulate(plant, H, command=u, start="rest" if start == "rest" else vented)
    off = np.abs(run.recording.states[1:] - radau_stroke(plant, sign, OPENED, SHUT, start == "vented"))
    # A step may be off by 1e-4 P_0, and the steps into rest take that back.
    assert off[:, [2, 4]].max() < 50.0 and off[:, [3, 5]].max() < 0.1
    assert off[:, 0].max() < 1e-4 * plant.cylinder.stroke
    full = pneumo.replay("full", None, run)
    assert np.abs(full.P_A - run.P_A).max() < 0.1 and np.abs(full.P_B - run.P_B).max() < 0.1


def insulated(C, V_d, P_s, leak=0.0):
    plant = sized(PLANT, C, V_d * 1e-6, P_s * 1e5)
    return plant._replace(k_0=0.0, valve=plant.valve._replace(leak=leak))


def masses(run):
    """Air in chambers A and B, kg, by step; and their volumes, m^3."""
    cyl, states = run.recording.plant.cylinder, run.recording.states.T
    V = np.array(
        [
            V_d + A * (cyl.stroke / 2 + way * states[0])
            for A, V_d, way in ((cyl.A_A, cyl.V_d_A, 1), (cyl.A_B, cyl.V_d_B, -1))
        ]
    )
    P, T = states[[2, 4]], states[[3, 5]]
    return P * V / (run.recording.plant.gas.R * T), V


@given(
    st.floats(1.0, 6.0),
    st.floats(2.0, 60.0),
    st.floats(2.0, 10.0),
    st.sampled_from((1e-3, 4e-3)),
    st.floats(0.3, 1.0),
    st.booleans(),
)
def test_insulated_chambers_keep_their_energy_and_exchange_no_air_at_rest(C, V_d, P_s, h, opening, forward):
    """The first law from start to rest, and nothing changes after it."""
    plant = insulated(C, V_d, P_s)
    c, gas, sign = plant.conditions, plant.gas, 1 if forward else -1
    start = (sign * plant.cylinder.x_max, 0.0, c.P_atm, c.T_amb, c.P_atm, c.T_amb)
    u = np.full(round(2.0 / h) + 1, sign * opening * plant.valve.u_max)  # against the stop: constant volumes
    run = pneumo.simulate(plant, h, command=u, start=start)
    m, V = masses(run)
    filled = 0 if forward else 1
    P, T = run.recording.states[:, [2, 4]].T, run.recording.states[:, [3, 5]].T
    brought = gas.gamma * gas.R * c.T_in * (m[filled] - m[filled][0])
    np.testing.assert_allclose((P[filled] - c.P_atm) * V[filled], brought, atol=2e-4 * c.P_s * V[filled][0])
    late = slice(len(u) // 2, None)
    assert np.ptp(P[filled][late]) < 1e-6 * c.P_s and np.ptp(T[filled][late]) < 1e-6 * c.T_amb
    assert P[filled][-1] == pytest.approx(c.P_s, rel=1e-7)
    assert np.ptp(P[1 - filled]) < 1e-6 * c.P_s  # at its port from the start
    assert np.ptp(T[1 - filled]) < 1e-6 * c.T_amb


@given(st.floats(2.0, 60.0), st.floats(2.0, 10.0), st.floats(-300.0, 300.0))
def test_shut_chambers_keep_their_air_when_the_piston_meets_a_stop(V_d, P_s, load):
    plant = insulated(1.5, V_d, P_s)
    plant = plant._replace(cylinder=plant.cylinder._replace(load=load))
    c = plant.conditions
    start = (0.0, 8.0 if load > 0 else -8.0, c.P_atm, c.T_amb, c.P_atm, c.T_amb)
    run = pneumo.simulate(plant, H, command=np.zeros(300), start=start)
    m, V = masses(run)
    for side, P in enumerate((run.P_A, run.P_B)):
        np.testing.assert_allclose(m[side], m[side][0], rtol=1e-3)
        isentropic = P * V[side] ** plant.gas.gamma
        np.testing.assert_allclose(isentropic, isentropic[0], rtol=1e-3)


def test_a_leak_keeps_the_pressure_below_that_of_the_open_port():
    """Where the flows through both ports are equal; the leak's is sonic."""
    plant = insulated(1.5, 4.0, 7.0, leak=2e-8)
    c, gas, opened = plant.conditions, plant.gas, plant.valve.k_xu * plant.valve.u_max + 2e-8
    run = pneumo.simulate(plant, H, command=np.full(6001, 10.0), start="extended")
    drop = 1 - run.P_A[-1] / c.P_s
    ratio = 2e-8 / opened * (1 - drop) * (c.T_in / run.T_A[-1]) ** 0.5  # of both ports' sonic flows
    above = 1 - drop / (1 - gas.critical_ratio)
    assert (1 - above**2) ** 0.5 == pytest.approx(ratio, rel=1e-3)
    assert np.ptp(run.P_A[-1000:]) < 1.0 and run.T_A[-1] == pytest.approx(c.T_in, abs=0.01)
