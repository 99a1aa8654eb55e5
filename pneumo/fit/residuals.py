"""Residuals of a fit, split into white noise of the sensor and a rest that noise does not explain."""

from typing import NamedTuple

import numpy as np

from pneumo.fit.fit_problem import Problem, replayed_pressures
from pneumo.fit.stage_signals import smoothing

BLOCK = 0.02  # s, over which white noise averages out
COLOURED = 0.4  # rms of the coloured part over the sensor's noise, above which noise does not explain it
FAR = 1.0  # the same, above which intervals mean nothing


class Residual(NamedTuple):
    """Residual of one pressure, Pa."""

    rms: float
    coloured: float  # rms of the part that neither white noise nor noise in the position explains
    noise: float  # standard deviation of the sensor's noise

    @property
    def unexplained(self) -> bool:
        """Whether the sensor's noise does not explain it."""
        return self.coloured > COLOURED * self.noise

    @property
    def far_from_noise(self) -> bool:
        """Whether it is so large that no interval would mean anything."""
        return self.coloured > FAR * self.noise


def block_means(signal: np.ndarray, length: int) -> np.ndarray:
    """Means over blocks of `length` samples along the last axis; a shorter rest is left out."""
    count = signal.shape[-1] // length
    return signal[..., : count * length].reshape(*signal.shape[:-1], count, length).mean(axis=-1)


def residuals(problem: Problem, theta: np.ndarray) -> list[Residual]:
    """Residuals of both pressures at a set of parameters on the scale of the search."""
    signals = problem.signals
    residual = signals.P - replayed_pressures(problem, theta[None])[0, 0]
    noisy = np.empty((0, *residual.shape))
    if problem.noisy is not None:
        noisy = replayed_pressures(problem, theta[None], problem.noisy)[:, 0]
    return split_residuals(signals.P, residual, signals.period, noisy)


def split_residuals(P: np.ndarray, residual: np.ndarray, period: float, noisy: np.ndarray) -> list[Residual]:
    """Residuals of measured pressures P, split into noise and the rest.

    The mean square over blocks is compared with that of white noise and of replays with added noise.
    `P` and `residual`, Pa, have the shape (chamber, sample); `noisy`, replays with noise added to the
    position, (replay, chamber, sample), perhaps none.
    """
    length = max(1, round(BLOCK / period))
    spread = np.zeros(2)
    if len(noisy):
        spread = np.nan_to_num(np.mean(block_means(noisy - noisy.mean(axis=0), length) ** 2, axis=(0, 2)))
    result: list[Residual] = []
    for side in range(len(P)):
        _, noise = smoothing(P[side], period)
        excess = float(np.mean(block_means(residual[side], length) ** 2)) - noise**2 / length - spread[side]
        rms = float(np.sqrt(np.mean(residual[side] ** 2)))
        result.append(Residual(rms, float(np.sqrt(max(excess, 0.0))), noise))
    return result
