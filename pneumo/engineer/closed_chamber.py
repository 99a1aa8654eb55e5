"""k_0 from the thermal time constant of a closed chamber.

Fill or empty a chamber quickly, close the valve and hold the piston: volume and mass stay, temperature
returns to that of the wall, and pressure with it. From m c_v dT/dt = k (T_amb - T), eqs (4) and (7) at rest,

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

SMALLEST_CHANGE = 3.0  # of the pressure over the noise in it
LONGEST = 3.0  # time constant over the length of the record, beyond which its end cannot be told
MOVED = 0.02  # of the stroke, by which the piston may move while it is held


class Transient(NamedTuple):
    """What a closed chamber's transient tells.

    Attributes
    ----------
    tau, tau_low, tau_high : float
        Thermal time constant and its 95 per cent interval, s.
    P_inf : float
        Pressure in the end, Pa.
    k : float
        Conductance during the transient, W/K.
    k_0, k_0_low, k_0_high : float
        Conductance at equilibrium by eqs (7) and (8), and its interval, W/K.
    rms : float
        Of what is left of the measured pressure, Pa.
    """

    tau: float
    tau_low: float
    tau_high: float
    P_inf: float
    k: float
    k_0: float
    k_0_low: float
    k_0_high: float
    rms: float


def transient(measurement: Measurement, plant: Plant, side: str, begin: float = 0.0) -> Transient:
    """Find the thermal time constant of a closed chamber.

    Parameters
    ----------
    measurement : Measurement
    plant : Plant
        Its dead volume counts.
    side : {"A", "B"}
        The chamber that is closed.
    begin : float
        When it is closed and the piston stands, s.

    Raises
    ------
    InputError
        If the piston moves, or pressure changes too little or is not seen to settle.
    """
    first = int(np.searchsorted(measurement.t, begin))
    t, x = measurement.t[first:] - begin, measurement.x[first:]
    P = measurement.P[0 if side == "A" else 1, first:]
    if len(t) < 50:
        raise InputError(f"--closed-from {begin:g} s: leaves {len(t)} samples: must be at least 50")
    third = len(x) // 3
    moved = abs(float(np.mean(x[:third]) - np.mean(x[-third:])))
    if moved > MOVED * plant.cylinder.stroke:
        raise InputError(
            f"{measurement.name}: the piston moves by {moved * 1e3:.3g} mm after {begin:g} s: it must"
            f" be held, within {MOVED * plant.cylinder.stroke * 1e3:.3g} mm"
        )

    def curve(theta: np.ndarray) -> np.ndarray:
        return theta[0] + theta[1] * np.exp(-t * np.exp(-theta[2]))

    span = float(t[-1])
    guess = np.array(
        [P[-third:].mean(), P[: max(1, third // 10)].mean() - P[-third:].mean(), np.log(span / 5)]
    )
    scale = np.array([1e5, 1e5, 1.0])
    found = least_squares(lambda theta: curve(theta) - P, guess, x_scale=scale)
    P_inf, change, log_tau = found.x
    residual, tau = -found.fun, float(np.exp(log_tau))
    rms = float(np.sqrt(np.mean(residual**2)))
    # Steps between neighbours are noise, however the mean runs.
    noise = float(np.std(np.diff(P)) / np.sqrt(2))
    if abs(change) < SMALLEST_CHANGE * noise:
        raise InputError(
            f"{measurement.name}: pressure {side} changes by {abs(change):.3g} Pa at a noise of"
            f" {noise:.3g} Pa: too little; fill or empty the chamber faster"
        )
    if tau > LONGEST * span or P_inf <= 0:
        raise InputError(
            f"{measurement.name}: pressure {side} does not settle within the record's {span:.3g} s;"
            " record longer"
        )
    c, inward = plant.conditions, 1.0 if side == "A" else -1.0
    area = plant.cylinder.A_A if side == "A" else plant.cylinder.A_B
    here = inward * float(np.mean(x))
    k = P_inf * volume(here, area, plant.cylinder) / ((plant.gas.gamma - 1) * c.T_amb * tau)
    ratio = heat_area(here, plant.cylinder) / heat_area(0.0, plant.cylinder)
    k_0 = k / wall_conductance(1.0, ratio, P_inf * c.T_amb / (c.P_0 * c.T_0), 1.0, 0.5)  # (7), (8)
    widening = float(np.exp(norm.ppf(0.5 + LEVEL / 2) * _standard_error(found.jac, residual)))
    return Transient(tau, tau / widening, tau * widening, P_inf, k, k_0, k_0 / widening, k_0 * widening, rms)


def _standard_error(jacobian: np.ndarray, residual: np.ndarray) -> float:
    """Standard error of ln(tau), with the residual's correlation."""
    gamma = correlations(np.vstack([residual, residual]))[0, 0]
    inverse = np.linalg.inv(jacobian.T @ jacobian)
    spread = np.array([np.convolve(column, gamma, mode="full") for column in jacobian.T])
    L = len(gamma) // 2
    middle = spread[:, L : L + len(residual)] @ jacobian
    return float(np.sqrt((inverse @ middle @ inverse)[2, 2]))
