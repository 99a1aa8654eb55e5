"""Measured signals at every Runge-Kutta stage of a replay: smoothed position, velocity, command or flows.

Position and velocity come from one smoothing spline, so that noise in the velocity is the derivative of noise
in the position. Generalised cross-validation chooses the smoothing (Craven and Wahba 1979), computed in
the cosine spectrum (Garcia 2010), where it is cheap.

What is left of the noise biases a replay. `with_added_noise` adds as much noise again: the shift that this
causes estimates the bias already there, and `pneumo.engineer.least_squares` subtracts it.
"""

from typing import NamedTuple

import numpy as np
from scipy.fft import dct
from scipy.interpolate import make_smoothing_spline

from pneumo.simulation.fitted_pressures import KUTTA

LONGEST_STEP = 1e-3  # s; the step of the paper's study
SMOOTHING = np.logspace(-6, 14, 201)  # weights of the squared second difference, from none to a straight line
# Antithetic pairs, noise and its negative, cancel odd-order terms.
FEW_PAIRS = 3  # enough to minimise the corrected sum of squares
PAIRS = 16  # for the estimate and its variance: the standard error is then known to some 15 %


class StageSignals(NamedTuple):
    """Signals of a measurement, uniform in time, as a replay reads them."""

    period: float  # s, time between samples
    h: float  # s, step of the replay, a whole fraction of the period
    u: np.ndarray  # limited command, V, by (step, stage)
    motion: np.ndarray  # position, m, and velocity, m/s, by (step, stage, 2)
    P: np.ndarray  # Pa, measured pressures by (chamber, sample)
    penalty: float  # s^3, smoothing of the position: from `smoothing`
    noise: float  # m, in the position
    P_s: np.ndarray | None = None  # Pa, supply pressure where measured, by (step, stage)
    flow: np.ndarray | None = None  # kg/s, where measured, by (step, stage, chamber); u then plays no role

    @property
    def stride(self) -> int:
        """Steps between samples."""
        return round(self.period / self.h)

    def part(self, first: int, last: int) -> "StageSignals":
        """Signals from one sample to another, both included."""
        steps = slice(first * self.stride, last * self.stride)
        flow, P_s = (signal if signal is None else signal[steps] for signal in (self.flow, self.P_s))
        at = {"u": self.u[steps], "motion": self.motion[steps], "P_s": P_s, "flow": flow}
        return self._replace(P=self.P[:, first : last + 1], **at)


def smoothing(x: np.ndarray, period: float) -> tuple[float, float]:
    """Choose the smoothing of a signal, samples `period` seconds apart, by generalised cross-validation.

    Returns the penalty, s^3: the weight of the integrated squared second derivative against the sum of
    squared residuals; and the estimated standard deviation of white noise in the signal, in units of x.
    """
    count = len(x)
    spectrum = dct(x - np.linspace(x[0], x[-1], count), norm="ortho")
    rough = (2 - 2 * np.cos(np.pi * np.arange(count) / count)) ** 2
    best = (np.inf, 0.0, 0.0)
    for weight in SMOOTHING:
        removed = 1 - 1 / (1 + weight * rough)
        freedom, squares = removed.sum(), np.sum((removed * spectrum) ** 2)
        if freedom > 0:
            best = min(best, (squares / freedom**2, weight, squares / freedom))
    _, weight, variance = best
    return weight * period**3, float(np.sqrt(variance))


def stage_times(steps: int, h: float) -> np.ndarray:
    """Times of the stages of a replay from 0 on, s, shape (steps, 3)."""
    return (np.arange(steps)[:, None] + KUTTA.c) * h


def stage_signals(
    period: float,
    u: np.ndarray,
    x: np.ndarray,
    P: np.ndarray,
    u_max: float,
    *,
    held: bool = True,
    P_s: np.ndarray | None = None,
    m: np.ndarray | None = None,
) -> StageSignals:
    """Signals at the stages of a replay, from samples `period` seconds apart.

    They are the command before its limiter at `u_max`, V, and the position, m, shape (samples,); pressures,
    Pa, and, where they were measured, mass flows into the chambers, kg/s, shape (chamber, samples), and the
    supply pressure, Pa, shape (samples,). The command is `held` until the next sample (zero-order hold, as a
    digital controller does) or else interpolated linearly, as flows and supply always are.
    """
    t, within = period * np.arange(len(u)), int(np.ceil(period / LONGEST_STEP * (1 - 1e-9)))
    h, steps = period / within, within * (len(u) - 1)
    at = stage_times(steps, h)
    held_u = np.broadcast_to(np.repeat(u[:-1], within)[:, None], at.shape)
    limited = np.clip(held_u if held else np.interp(at, t, u), -u_max, u_max)
    penalty, noise = smoothing(x, period)
    spline = make_smoothing_spline(t, x, lam=penalty)
    motion = np.stack([spline(at), spline.derivative()(at)], axis=-1)
    flow = None if m is None else np.stack([np.interp(at, t, side) for side in m], axis=-1)
    supply = None if P_s is None else np.interp(at, t, P_s)
    return StageSignals(period, h, limited, motion, P, penalty, noise, supply, flow)


def with_added_noise(signals: StageSignals, pairs: int = PAIRS, seed: int = 0) -> np.ndarray:
    """Motions with noise added to the smoothed position, which is then smoothed again.

    There are two for each of the `pairs`, one with a noise and one with its negative: antithetic pairs cancel
    odd-order terms. Each is shaped as `StageSignals.motion`.
    """
    steps, stride = signals.motion[:, :, 0], signals.stride
    x = np.append(steps[::stride, 0], steps[-1, -1])
    t, at = signals.period * np.arange(len(x)), stage_times(len(steps), signals.h)
    rng = np.random.default_rng(seed)

    def smoothed(values: np.ndarray) -> np.ndarray:
        spline = make_smoothing_spline(t, values, lam=signals.penalty)
        return np.stack([spline(at), spline.derivative()(at)], axis=-1)

    motion = smoothed(x)
    noises = smoothed(rng.normal(0.0, signals.noise, (pairs, len(x))).T).transpose(2, 0, 1, 3)
    return np.array([motion + sign * noise for noise in noises for sign in (1.0, -1.0)])
