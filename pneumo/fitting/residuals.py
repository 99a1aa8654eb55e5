"""Residuals of a fit, split into white noise of the sensor and a rest that noise does not explain."""

from typing import NamedTuple

import numpy as np

from pneumo.fitting.fit_problem import Problem, replayed_pressures
from pneumo.fitting.record.sensor_faults import noise_of, quantum
from pneumo.fitting.settings import FAR

BLOCK = 0.02  # s, over which white noise averages out


class Residual(NamedTuple):
    """Residual of one pressure, Pa."""

    rms: float
    coloured: float  # rms of the part that white noise does not explain
    noise: float  # standard deviation of the sensor's noise

    @property
    def far_from_noise(self) -> bool:
        """Whether the residual is so large that no interval would mean anything."""
        return self.coloured > FAR * self.noise


def sensor_noise(P: np.ndarray, residual: np.ndarray) -> float:
    """Standard deviation of the sensors' noise, Pa: root mean square of both chambers.

    Measured pressures `P` and their residuals, Pa, have the shape (chamber, sample).
    """
    return float(np.sqrt(np.mean([noise_of(*pair) ** 2 for pair in zip(P, residual, strict=True)])))


def residuals(problem: Problem, theta: np.ndarray) -> list[Residual]:
    """Residuals of both pressures at a set of parameters on the scale of the search."""
    signals = problem.signals
    residual = signals.residual(replayed_pressures(problem, theta[None])[0])
    return split_residuals(signals.P, residual, signals.period)


def split_residuals(P: np.ndarray, residual: np.ndarray, period: float) -> list[Residual]:
    """Residuals of measured pressures P, split into noise and the rest.

    The mean square of block means is compared with that of white noise. `P` and `residual`, Pa, have the
    shape (chamber, sample).
    """
    length = max(1, round(BLOCK / period))
    whole, result = residual.shape[1] // length * length, list[Residual]()
    for measured, left in zip(P, residual, strict=True):
        noise, steps = noise_of(measured, left), quantum(measured) ** 2 / 12
        means = left[:whole].reshape(-1, length).mean(axis=1)
        # Steps do not average out where a pressure is constant.
        excess = float(np.mean(means**2)) - max(noise**2 / length, steps)
        result.append(Residual(float(np.sqrt(np.mean(left**2))), float(np.sqrt(max(excess, 0.0))), noise))
    return result
