"""The seven steps from a closed chamber's pressure to its wall conductance, of the paper of 2007.

The mean conductance of the record is ``k_av`` = m c_v / tau; ``lambda_av`` is ``k_av`` over the heat transfer
area. The square-root law lambda = lambda_0 (P T / (P_0 T_0))^(1/2), at the means of P and T over the settling
time, converts them to ``k_0`` and ``lambda_0``. Steps 2 to 7 take floats and NumPy arrays.
"""

from math import log
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from pneumo.physics.chamber import wall_conductance
from pneumo.physics.cylinder import wetted_area

Value = Any  # a float, or an array of them

SETTLED = 0.01  # fraction of the change of pressure that is left after the settling time


class Exponential(NamedTuple):
    """Least-squares fit of P = P_f + delta_P exp(-t / tau): step 1."""

    P_f: float  # Pa, final pressure
    delta_P: float  # Pa, pressure at first less P_f
    tau: float  # s, thermal time constant


class Conductance(NamedTuple):
    """Results of steps 2 to 7, in SI units."""

    m: Value  # kg, mass of air
    V_f: Value  # m^3, volume of the chamber when held
    V_d: Value  # m^3, its dead volume
    k_av: Value  # W/K, mean conductance
    A_q: Value  # m^2, heat transfer area
    lambda_av: Value  # W/(m^2 K), mean coefficient
    t_ss: Value  # s, settling time to 1 per cent
    P_av: Value  # Pa, mean pressure over it
    T_av: Value  # K, mean temperature over it
    lambda_0: Value  # W/(m^2 K), coefficient at P_0 and T_0
    k_0: Value  # W/K, conductance at P_0 and T_0


def exponential(t: np.ndarray, P: np.ndarray, P_f: float | None = None) -> Exponential:
    """Fit P_f + delta_P exp(-t / tau) to a pressure, Pa, at times from 0 on, s; `P_f` may be given."""
    third = len(P) // 3
    last = float(P[-third:].mean()) if P_f is None else P_f
    guess = [last, P[: max(1, third // 10)].mean() - last, np.log(float(t[-1]) / 5)]
    free = slice(0 if P_f is None else 1, 3)

    def curve(theta: np.ndarray) -> np.ndarray:
        final = theta[0] if P_f is None else P_f
        return final + theta[-2] * np.exp(-t * np.exp(-theta[-1]))

    optimum = least_squares(
        lambda theta: curve(theta) - P, guess[free], x_scale=[1e5, 1e5, 1.0][free], xtol=1e-12, ftol=1e-12
    )
    final = float(optimum.x[0]) if P_f is None else P_f
    return Exponential(final, float(optimum.x[-2]), float(np.exp(optimum.x[-1])))


def mean_pressure(P_f: Value, delta_P: Value) -> Value:
    """Mean of the fitted pressure over the settling time to 1 per cent, Pa: step 6."""
    return P_f + delta_P * (1 - SETTLED) / log(1 / SETTLED)


def seven_steps(
    P_i: Value,
    swept_i: Value,
    swept_f: Value,
    fit: tuple[Value, Value, Value],
    *,
    bore: Value,
    T_amb: Value,
    c_v: Value,
    R: Value,
    P_0: float,
    T_0: float,
) -> Conductance:
    """Conductance of a chamber that was closed at P_i, compressed and held: steps 2 to 7 of the 2007 method.

    Parameters
    ----------
    P_i : float
        Absolute pressure before the push, at T_amb, Pa.
    swept_i, swept_f : float
        Volumes without the dead volume before and after the compression, m^3.
    fit : tuple of float
        P_f, Pa, delta_P, Pa, and tau, s, from `exponential` (step 1).
    bore, T_amb, c_v, R
        m, K, J/(kg K), J/(kg K).
    P_0, T_0
        Pressure and temperature at which lambda_0 and k_0 are stated, Pa, K.
    """
    P_f, delta_P, tau = fit
    m = (swept_i - swept_f) / (R * T_amb) * P_i * P_f / (P_f - P_i)
    V_f = m * R * T_amb / P_f
    k_av, A_q = m * c_v / tau, wetted_area(V_f, bore)
    P_av = mean_pressure(P_f, delta_P)
    T_av = V_f * P_av / (m * R)
    lambda_av = k_av / A_q
    lambda_0 = lambda_av / wall_conductance(1.0, 1.0, P_av * T_av / (P_0 * T_0), 0.0, 0.5)
    t_ss = tau * log(1 / SETTLED)
    return Conductance(
        m=m,
        V_f=V_f,
        V_d=V_f - swept_f,
        k_av=k_av,
        A_q=A_q,
        lambda_av=lambda_av,
        t_ss=t_ss,
        P_av=P_av,
        T_av=T_av,
        lambda_0=lambda_0,
        k_0=lambda_0 * A_q,
    )
