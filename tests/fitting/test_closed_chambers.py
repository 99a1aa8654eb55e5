"""Balances of two closed chambers: limiting cases, identities, and an independent solver."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pneumo.fitting.closed.closed_problem import closed_chambers

R_NITROGEN, GAMMA, T_WALL, P_0 = 296.80, 1.4, 293.15, 1e6
H = 0.02  # s, as in the records
T = H * np.arange(1500)
X = 0.9 - 0.4 * np.cos(2 * T) + 0.3 * np.sin(0.7 * T)  # m
VOLUMES = np.array([0.02 + 0.0127 * X, 0.05 + 0.0115 * (2.0 - X)])
FIRST = np.array([8e5, 1.1e6])


def run(k=(0.0, 0.0), n=GAMMA, leak=0.0, volumes=VOLUMES):
    one = np.ones(2)
    gas = (R_NITROGEN, GAMMA, T_WALL, P_0 * T_WALL)
    ratio = np.ones_like(volumes)
    motion = volumes, (True, True), volumes, ratio
    return closed_chambers(FIRST, *motion, H, one, n, np.array(k), 0.0, 0.0, leak, *gas)


@pytest.mark.parametrize("n", [1.0, 1.2, GAMMA])
def test_without_wall_heat_and_leakage_the_polytrope_is_followed(n):
    constant = run(n=n) * VOLUMES**n
    # Fourth-order steps of 0.02 s, while the volume changes in a second: (0.02)^4.
    np.testing.assert_allclose(constant, constant[:, :1] * np.ones_like(T), rtol=1e-6)


def test_much_wall_heat_is_isothermal_and_little_is_adiabatic():
    isothermal, adiabatic = run(n=1.0), run()
    much, little = run(k=(1.5e4, 4.4e4)), run(k=(1e-3, 1e-3))
    apart = np.abs(isothermal - adiabatic).max()
    # Time constants of 15 ms beside motion at 2 rad/s: temperatures lag by 0.03 of what they would change.
    assert np.abs(much - isothermal).max() < 0.05 * apart
    assert np.abs(little - adiabatic).max() < 0.001 * apart


@pytest.mark.parametrize("order", [1, -1])
def test_gas_leaks_from_an_open_chamber_at_its_pressure_between_samples(order):
    """Chamber A keeps volume and temperature; B is open, and its pressure rises on a line; or A and B."""
    leak, count = 2e-8, 200
    V, T_wall = VOLUMES[::order, :1], T_WALL
    still = np.repeat(V, count, axis=1)
    t = H * np.arange(count)
    measured = np.array([np.full(count, 8e5), 8e5 + 1e5 * t / t[1]])[::order]  # 1 bar in each sample
    gas = (R_NITROGEN, GAMMA, T_wall, P_0 * T_wall)
    motion = measured, (True, False)[::order], still, np.ones_like(still)
    P = closed_chambers(measured[:, 0], *motion, H, np.ones(2), 1.0, np.zeros(2), 0.0, 0.0, leak, *gas)
    P, measured, V = P[::order], measured[::order], V[::order]
    np.testing.assert_array_equal(P[1], measured[1])
    # V / (R T) dP_A/dt = leak (P_B - P_A): behind a ramp by its slope times the time constant, less a decay.
    tau = V[0, 0] / (R_NITROGEN * T_wall * leak)
    expected = measured[1] - 1e5 / H * tau * (1 - np.exp(-t / tau))
    # Steps of fourth order, a thousandth of the time constant or less.
    assert H / tau < 2e-3
    np.testing.assert_allclose(P[0], expected, rtol=1e-8)


def test_balances_are_those_of_an_independent_solver():
    """Volumes and wall areas on lines, walls by area and root of P T, a leak from the higher pressure."""
    count, k, leak, h = 101, np.array([60.0, 40.0]), 2e-8, 0.01
    t = h * np.arange(count)
    V_0, V_1 = np.array([0.02, 0.05]), np.array([0.01, -0.012])  # m^3 and m^3/s
    A_0, A_1 = np.array([1.1, 0.9]), np.array([0.3, -0.2])
    start, first = np.array([1.05, 0.95]), np.array([11e5, 8e5])

    def rates(at, y):
        P, m = y[:2] * 1e5, y[2:]
        V, area = V_0 + V_1 * at, A_0 + A_1 * at
        T = P * V / (m * R_NITROGEN)
        flow = leak * (P[0] - P[1])
        gain = flow * np.array([-1.0, 1.0])
        heat = k * area * np.sqrt(P * T / (P_0 * T_WALL)) * (T_WALL - T)
        enthalpy = GAMMA * R_NITROGEN * T[0 if flow > 0 else 1] * gain
        return np.concatenate([(enthalpy + (GAMMA - 1) * heat - GAMMA * P * V_1) / V / 1e5, gain])

    m = first * V_0 / (R_NITROGEN * T_WALL * start)
    y_0 = np.concatenate([first / 1e5, m])
    expected = 1e5 * solve_ivp(rates, (0, t[-1]), y_0, "DOP853", t, rtol=1e-11, atol=1e-12).y[:2]
    V, area = (a[:, None] + b[:, None] * t for a, b in ((V_0, V_1), (A_0, A_1)))
    law = GAMMA, k, 1.0, 0.5, leak
    gas = (R_NITROGEN, GAMMA, T_WALL, P_0 * T_WALL)
    P = closed_chambers(first, V, (True, True), V, area, h, start, *law, *gas)
    # Steps of fourth order, a twentieth of the fastest time constant: (m c_v / k = 0.2 to 1 s).
    np.testing.assert_allclose(P, expected, rtol=1e-7)
