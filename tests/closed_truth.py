"""Records of closed chambers whose truth is known, by SciPy: mass and internal energy of each chamber."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from pneumo.configuration.experiment import Plant
from pneumo.fitting.record.measurement import Measurement


class Truth(NamedTuple):
    """Two chambers of an own cylinder; pairs are of A and B."""

    k_0: tuple[float, float]  # W/K, at P_0, T_0 in mid-stroke
    V_d: tuple[float, float]  # m^3
    P: tuple[float, float] = (4e5, 3e5)  # Pa, at first
    T: tuple[float, float] = (293.15, 293.15)  # K, at first
    T_wall: float = 293.15  # K
    leak: float = 0.0  # kg/(s Pa), from A to B
    e_A: float = 1.0  # exponents of the wall's area and of P T
    e_PT: float = 0.5


def moving(t: np.ndarray) -> np.ndarray:
    """Position of a piston that moves, m from mid-stroke."""
    return 0.055 * np.sin(2.2 * t) * np.cos(0.3 * t) + 0.01 * np.sin(7 * t)


def compressed(t: np.ndarray) -> np.ndarray:
    """Position of a piston that is pushed by 60 mm in 0.2 s and held."""
    return -0.03 * np.tanh((t - 0.3) / 0.05)


def pressures(
    truth: Truth, plant: Plant, x: Callable[[np.ndarray], np.ndarray], t: np.ndarray, break_at: float = 0.0
) -> np.ndarray:
    """Pressures of both chambers, Pa, while the piston moves as x, m from mid-stroke."""
    c, R = plant.cylinder, plant.gas.R
    c_v = R / (plant.gas.gamma - 1)
    areas, signs = np.array([c.A_A, c.A_B]), np.array([1.0, -1.0])
    P_0T_0 = plant.conditions.P_0 * plant.conditions.T_0

    def volumes(time):
        length = c.stroke / 2 + signs * x(time)
        wall = 2 * np.pi / 4 * c.bore**2 + np.pi * c.bore * length
        mid = 2 * np.pi / 4 * c.bore**2 + np.pi * c.bore * c.stroke / 2
        return np.array(truth.V_d) + areas * length, wall / mid

    def state(time, y):
        m, U = y[:2], y[2:]
        V, wall = volumes(time)
        T = U / (m * c_v)
        return m, V, wall, T, m * R * T / V

    def rates(time, y):
        _, _, wall, T, P = state(time, y)
        speed = (x(time + 1e-7) - x(time - 1e-7)) / 2e-7
        k = np.array(truth.k_0) * wall**truth.e_A * (P * T / P_0T_0) ** truth.e_PT
        flow = truth.leak * (P[0] - P[1])
        enthalpy = flow * (c_v + R) * (T[0] if flow > 0 else T[1])
        work = P * areas * signs * speed
        return np.concatenate([[-flow, flow], k * (truth.T_wall - T) - work + enthalpy * np.array([-1, 1])])

    V, _ = volumes(t[0])
    m = np.array(truth.P) * V / (R * np.array(truth.T))
    y = np.concatenate([m, m * c_v * np.array(truth.T)])
    done = solve_ivp(rates, (t[0], t[-1]), y, t_eval=t, rtol=1e-9, atol=1e-12, max_step=0.01)
    return np.array([state(time, y)[4] for time, y in zip(t, done.y.T, strict=True)]).T


def measured(x: np.ndarray, P: np.ndarray, period: float, seed: int, noise: float = 200.0) -> Measurement:
    """Measurement with noise, Pa, on the pressures, and 10 um on a position that moves."""
    rng = np.random.default_rng(seed)
    P = P + rng.normal(0.0, noise, P.shape)
    x = x + rng.normal(0.0, 1e-5, x.shape) * (np.ptp(x) > 0)
    return Measurement("closed.csv", period, np.zeros_like(x), x, P, closed=True)
