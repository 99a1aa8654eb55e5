"""Wall conductance from the thermal time constant of a closed chamber.

Fill or empty a chamber quickly, or push its piston against a stop, and hold it closed: volume and mass stay
constant, the temperature returns to that of the wall, and the pressure follows. From
m c_v dT/dt = k (T_amb - T), eqs (4) and (7) of 2006 at rest, tau = m c_v / k.

The mean conductance of the record is k_av = m c_v / tau. The square-root law, at the means of P and T over
the settling time, converts it to k_0.

Source: J. F. Carneiro and F. G. de Almeida, Proc. IMechE Part I 221 (2007) 119-128,
DOI 10.1243/09596518JSCE188, section on the thermal time constant.
"""

from math import log
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from pneumo.configuration.experiment import Plant
from pneumo.errors import InputError
from pneumo.fitting.engine import Solution, covariances, expected_shifts, larger
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.settings import FEWEST_SAMPLES, LARGEST_MOTION, LONGEST_TAU, SMALLEST_CHANGE
from pneumo.physics.chamber import wall_conductance
from pneumo.physics.cylinder import Side, chamber_of, heat_area, volume

Value = Any  # a float, or an array of them

SETTLED = 0.01  # fraction of the change of pressure that is left after the settling time


class Exponential(NamedTuple):
    """Least-squares fit of P = P_f + delta_P exp(-t / tau): step 1."""

    P_f: float  # Pa, final pressure
    delta_P: float  # Pa, pressure at first less P_f
    tau: float  # s, thermal time constant
    residual: np.ndarray  # Pa, measured minus fitted
    jacobian: np.ndarray  # Pa, derivatives of the fitted pressure; the last is by ln(tau)


class Transient(NamedTuple):
    """Result of a closed chamber's transient, with ends of 95 per cent intervals."""

    tau: float  # s, thermal time constant
    tau_low: float
    tau_high: float
    P_inf: float  # Pa, final pressure
    k_av: float  # W/K, mean conductance of the record
    k_0: float  # W/K, at P_0, T_0 and in mid-stroke by eqs (7) and (8)
    k_0_low: float
    k_0_high: float
    rms: float  # Pa, root mean square of measured minus fitted pressure


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
    return Exponential(final, float(optimum.x[-2]), float(np.exp(optimum.x[-1])), -optimum.fun, optimum.jac)


def mean_pressure(P_f: Value, delta_P: Value) -> Value:
    """Mean of the fitted pressure over the settling time to 1 per cent, Pa: step 6."""
    return P_f + delta_P * (1 - SETTLED) / log(1 / SETTLED)


def since(measurement: Measurement, begin: float) -> Measurement:
    """Measurement from the time `begin` on, s; `InputError` if few samples remain."""
    rest = measurement.since(begin)
    if len(rest.u) < FEWEST_SAMPLES:
        left = f"leaves {len(rest.u)} samples of {measurement.t[-1]:g} s: must be at least {FEWEST_SAMPLES}"
        raise InputError(f"--closed-from {begin:g} s: {left}")
    return rest


def transient(measurement: Measurement, plant: Plant, side: str, begin: float = 0.0) -> Transient:
    """Thermal time constant and conductance of chamber A or B, closed from the time `begin` on, s.

    Volume and area are those of the `plant`. `InputError` if few samples remain, if the piston moves, or if
    the pressure changes too little or does not settle within the record.
    """
    still = since(measurement, begin)
    t, x, P = still.t, still.x, still.P[Side[side]]
    third = len(x) // 3
    motion = abs(float(np.mean(x[:third]) - np.mean(x[-third:])))
    allowed = LARGEST_MOTION * plant.cylinder.stroke
    if motion > allowed:
        raise InputError(
            f"{measurement.name}: the piston moves by {motion * 1e3:.3g} mm after {begin:g} s: it must"
            f" be held, within {allowed * 1e3:.3g} mm"
        )
    P_inf, change, tau, residual, jacobian = exponential(t, P)
    noise = float(np.std(np.diff(P)) / np.sqrt(2))  # the mean changes little from sample to sample
    if abs(change) < SMALLEST_CHANGE * noise:
        raise InputError(
            f"{measurement.name}: pressure {side} changes by {abs(change):.3g} Pa at a noise of"
            f" {noise:.3g} Pa: too little; fill or empty the chamber faster"
        )
    span = float(t[-1])
    if tau > LONGEST_TAU * span or P_inf <= 0:
        raise InputError(
            f"{measurement.name}: pressure {side} does not settle within the record's {span:.3g} s;"
            " record longer"
        )
    c, cylinder, gas, mean = plant.conditions, plant.cylinder, plant.gas, float(np.mean(x))
    position, chamber = Side[side].sign * mean, chamber_of(cylinder, Side[side])
    m = P_inf * volume(position, chamber, cylinder) / (gas.R * c.T_amb)
    k_av = m * (gas.R / (gas.gamma - 1)) / tau
    P_av = mean_pressure(P_inf, change)
    T_av = c.T_amb * P_av / P_inf
    ratio = heat_area(position, cylinder) / heat_area(0.0, cylinder)
    k_0 = k_av / wall_conductance(1.0, ratio, P_av * T_av / (c.P_0 * c.T_0), 1.0, 0.5)  # (7), (8)
    found = Solution(
        theta=np.zeros(3),
        residual=residual[None],
        jacobian=jacobian[None],
        squares=float(residual @ residual),
        prior=np.zeros(3),
    )
    factor = float(np.exp(expected_shifts(larger(covariances(found)))[-1]))
    rms = float(np.sqrt(np.mean(residual**2)))
    return Transient(
        tau=tau,
        tau_low=tau / factor,
        tau_high=tau * factor,
        P_inf=P_inf,
        k_av=k_av,
        k_0=k_0,
        k_0_low=k_0 / factor,
        k_0_high=k_0 * factor,
        rms=rms,
    )
