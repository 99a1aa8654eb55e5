"""k_0 from the thermal time constant of a closed chamber.

Fill or empty a chamber quickly, close the valve and hold the piston: volume and mass stay constant, the
temperature returns to that of the wall, and the pressure follows. From m c_v dT/dt = k (T_amb - T), eqs (4)
and (7) at rest,

    tau = m c_v / k,  and with m = P V / (R T):  k = P_inf V / ((gamma - 1) T_amb tau).
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import norm

from pneumo.configuration.experiment import Plant
from pneumo.engineer.fit_intervals import LEVEL, correlations
from pneumo.engineer.record import Measurement
from pneumo.errors import InputError
from pneumo.physics.chamber import wall_conductance
from pneumo.physics.cylinder import heat_area, volume

FEWEST_SAMPLES = 50
SMALLEST_CHANGE = 3.0  # of the pressure over the noise in it
LONGEST_TAU = 3.0  # time constant over the record's length, beyond which the final pressure is not seen
LARGEST_MOTION = 0.02  # of the stroke, of a piston that is held


class Transient(NamedTuple):
    """Result of a closed chamber's transient, with ends of 95 per cent intervals."""

    tau: float  # s, thermal time constant
    tau_low: float
    tau_high: float
    P_inf: float  # Pa, final pressure
    k: float  # W/K, conductance during the transient
    k_0: float  # W/K, conductance at equilibrium by eqs (7) and (8)
    k_0_low: float
    k_0_high: float
    rms: float  # Pa, root mean square of measured minus fitted pressure


def transient(measurement: Measurement, plant: Plant, side: str, begin: float = 0.0) -> Transient:
    """Thermal time constant of a closed chamber, and its conductance.

    Parameters
    ----------
    side : {"A", "B"}
        The closed chamber.
    begin : float
        Time from which it is closed and the piston is held, s.

    Raises
    ------
    InputError
        If the piston moves, or pressure changes too little or does not settle within the record.
    """
    first = int(np.searchsorted(measurement.t, begin))
    t, x = measurement.t[first:] - begin, measurement.x[first:]
    P = measurement.P[0 if side == "A" else 1, first:]
    if len(t) < FEWEST_SAMPLES:
        raise InputError(
            f"--closed-from {begin:g} s: leaves {len(t)} samples: must be at least {FEWEST_SAMPLES}"
        )
    third = len(x) // 3
    motion = abs(float(np.mean(x[:third]) - np.mean(x[-third:])))
    allowed = LARGEST_MOTION * plant.cylinder.stroke
    if motion > allowed:
        raise InputError(
            f"{measurement.name}: the piston moves by {motion * 1e3:.3g} mm after {begin:g} s: it must"
            f" be held, within {allowed * 1e3:.3g} mm"
        )

    def curve(theta: np.ndarray) -> np.ndarray:
        return theta[0] + theta[1] * np.exp(-t * np.exp(-theta[2]))

    span = float(t[-1])
    guess = np.array(
        [P[-third:].mean(), P[: max(1, third // 10)].mean() - P[-third:].mean(), np.log(span / 5)]
    )
    optimum = least_squares(lambda theta: curve(theta) - P, guess, x_scale=np.array([1e5, 1e5, 1.0]))
    P_inf, change, log_tau = optimum.x
    residual, tau = -optimum.fun, float(np.exp(log_tau))
    rms = float(np.sqrt(np.mean(residual**2)))
    noise = float(np.std(np.diff(P)) / np.sqrt(2))  # the mean changes little from sample to sample
    if abs(change) < SMALLEST_CHANGE * noise:
        raise InputError(
            f"{measurement.name}: pressure {side} changes by {abs(change):.3g} Pa at a noise of"
            f" {noise:.3g} Pa: too little; fill or empty the chamber faster"
        )
    if tau > LONGEST_TAU * span or P_inf <= 0:
        raise InputError(
            f"{measurement.name}: pressure {side} does not settle within the record's {span:.3g} s;"
            " record longer"
        )
    c, outward = plant.conditions, 1.0 if side == "A" else -1.0
    area = plant.cylinder.A_A if side == "A" else plant.cylinder.A_B
    position = outward * float(np.mean(x))
    k = P_inf * volume(position, area, plant.cylinder) / ((plant.gas.gamma - 1) * c.T_amb * tau)
    ratio = heat_area(position, plant.cylinder) / heat_area(0.0, plant.cylinder)
    k_0 = k / wall_conductance(1.0, ratio, P_inf * c.T_amb / (c.P_0 * c.T_0), 1.0, 0.5)  # (7), (8)
    factor = float(np.exp(norm.ppf(0.5 + LEVEL / 2) * _standard_error(optimum.jac, residual)))
    return Transient(tau, tau / factor, tau * factor, P_inf, k, k_0, k_0 / factor, k_0 * factor, rms)


def _standard_error(jacobian: np.ndarray, residual: np.ndarray) -> float:
    """Standard error of ln(tau), with the residual's correlation."""
    gamma = correlations(np.vstack([residual, residual]))[0, 0]
    inverse = np.linalg.inv(jacobian.T @ jacobian)
    spread = np.array([np.convolve(column, gamma, mode="full") for column in jacobian.T])
    L = len(gamma) // 2
    middle = spread[:, L : L + len(residual)] @ jacobian
    return float(np.sqrt((inverse @ middle @ inverse)[2, 2]))
