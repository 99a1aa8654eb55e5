"""Confidence intervals of fitted parameters where residuals are correlated.

Noise in pressures is white, but noise in the position reaches the residual through the replay, which
remembers, and so does what the model lacks. The usual covariance of least squares would be far too small. Two
others are found: that of the noises, which replays with disturbed positions give, and that of whatever the
residual shows, from its own auto- and cross-correlation of both chambers. The larger one counts. Standard
errors make the interval where it is narrow; elsewhere the profile of the sum of squares does, in their unit.
"""

from typing import NamedTuple

import numpy as np
from scipy.signal import fftconvolve
from scipy.stats import t

from pneumo.engineer.added_noise import PAIRS
from pneumo.engineer.least_squares import PARAMETERS, Fit, Problem, with_one_held

LEVEL = 0.95
REACH = float(t.ppf((1 + LEVEL) / 2, PAIRS))  # standard errors; they are known from as many noises
WIDE = 0.3  # on the scale of the search; beyond, no model is linear enough for standard errors
LOOSE = 1.0  # half an interval on the scale of the search: a factor of e
GOES_WITH = 0.7  # correlation with a loose one
UNSEEN = 1e-9  # derivative, over the largest, that is none
SMALLEST = 1e-6  # curvature, over the largest, below which a direction is as good as flat
NOTHING_KNOWN = 1e6  # variance on the scale of the search
CLOSE = 0.05  # relative distance at which the end of an interval is found
MEMORY = 1 / 8  # longest lag of the residual's correlation over the length of the record


class Interval(NamedTuple):
    """A parameter's confidence interval on the scale of the search; an open end is infinite."""

    low: float
    high: float


def correlations(residual: np.ndarray) -> np.ndarray:
    """Auto- and cross-covariance of both chambers' residuals, tapered (Parzen).

    Parameters
    ----------
    residual : numpy.ndarray
        Shape (chamber, samples).

    Returns
    -------
    numpy.ndarray
        Shape (chamber, chamber, 2 L + 1), for lags -L to L: mean of first(t) second(t + lag).
    """
    samples = residual.shape[1]
    L = max(1, int(MEMORY * samples))
    lag = np.abs(np.arange(-L, L + 1)) / (L + 1)
    taper = np.where(lag <= 0.5, 1 - 6 * lag**2 + 6 * lag**3, 2 * (1 - lag) ** 3)
    e = residual - residual.mean(axis=1, keepdims=True)
    full = [[fftconvolve(b, a[::-1]) for b in e] for a in e]
    return np.array(full)[:, :, samples - 1 - L : samples + L] / samples * taper


def covariances(fit: Fit) -> np.ndarray:
    """Covariances of the parameters on the scale of the search, shape (2, parameter, parameter).

    From the noises, H^-1 (S + s^2 J'J) H^-1 with S what positions disturbed once more make of the slope and
    s the residual's white part; and from what is left, H^-1 J' Gamma J H^-1 with Gamma the residual's
    covariance.
    """
    J, inverse = fit.jacobian, bread(fit)
    flat = J.reshape(-1, J.shape[2])
    # What the replay remembers changes little from sample to sample: differences are those of white noise.
    white = np.mean(np.diff(fit.residual, axis=1) ** 2) / 2
    gamma = correlations(fit.residual)
    middle = sum(
        J[a].T @ fftconvolve(J[b], gamma[a, b][::-1, None], mode="same", axes=0)
        for a in range(2)
        for b in range(2)
    )
    inner = np.array([fit.scatter + white * flat.T @ flat, middle])
    seen = np.sqrt(np.sum(flat**2, axis=0))
    # What changes nothing has no noise either; its variance is none that any bound allows.
    return inverse @ inner @ inverse + np.diag(np.where(seen > UNSEEN * seen.max(), 0.0, NOTHING_KNOWN))


def bounded(covariance: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Covariance in which no direction is less known than the bounds say.

    Else one that the measurement leaves open would make all parameters with a little of it as uncertain.

    Parameters
    ----------
    covariance : numpy.ndarray
        Shape (parameter, parameter), on the scale of the search.
    bounds : numpy.ndarray
        From `Problem.bounds`.
    """
    half = (bounds[1] - bounds[0]) / 2
    size, axes = np.linalg.eigh(covariance / np.outer(half, half))
    return (axes * np.clip(size, 0.0, 1.0)) @ axes.T * np.outer(half, half)


def bread(fit: Fit) -> np.ndarray:
    """Inverse of the curvature, shape (parameter, parameter); finite where that is not positive definite."""
    J = fit.jacobian.reshape(-1, len(fit.theta))
    scale = np.sqrt(np.sum(J**2, axis=0))
    scale = np.maximum(scale, UNSEEN * scale.max())
    size, axes = np.linalg.eigh(fit.curvature / np.outer(scale, scale))
    return (axes / np.maximum(size, SMALLEST * size.max())) @ axes.T / np.outer(scale, scale)


def interval(problem: Problem, rough: Fit, best: Fit, index: int, both: np.ndarray) -> Interval:
    """Interval of one parameter: of standard errors, or of the profile where that is wide or meets a bound.

    A parameter of no wide interval that goes with one that has gets what both ways leave possible: the
    valley of the sum of squares is curved there.

    Parameters
    ----------
    problem : Problem
        With few disturbed inputs.
    rough, best : Fit
        Of that, and with all of them.
    index : int
        Of the parameter.
    both : numpy.ndarray
        From `covariances`.
    """
    bounds = problem.bounds()
    low, high = bounds[:, index]
    limited = max((bounded(c, bounds) for c in both), key=lambda c: c[index, index])
    halves = REACH * np.sqrt(np.diag(limited))
    start, end = best.theta[index] - halves[index], best.theta[index] + halves[index]
    logarithmic = PARAMETERS[problem.names[index]].logarithmic
    beyond = logarithmic and (halves[index] > WIDE or start <= low or end >= high)
    shared = np.abs(limited[index]) / np.sqrt(limited[index, index] * np.diag(limited))
    if beyond or np.any((halves > LOOSE) & (shared > GOES_WITH)):
        found = profile(problem, rough, index, float(both[:, index, index].max()))
        moved = best.theta[index] - rough.theta[index]
        ends = found.low + moved, found.high + moved
        start, end = ends if beyond else (min(start, ends[0]), max(end, ends[1]))
    return Interval(start if start > low else -np.inf, end if end < high else np.inf)


def profile(problem: Problem, fit: Fit, index: int, variance: float, rounds: int = 3) -> Interval:
    """Interval of one parameter from the profile of the sum of squares.

    A value is inside as long as the lowest sum of squares with it exceeds the least one by no more than
    `REACH` squared, in units that make its curvature the inverse of the variance.

    Parameters
    ----------
    problem : Problem
    fit : Fit
    index : int
        Of the parameter.
    variance : float
        Its variance, the larger one of `covariances`.
    rounds : int
        Profile points at either side.
    """
    threshold = REACH**2
    scale = variance / bread(fit)[index, index]
    low, high = (bound[index] for bound in problem.bounds())
    best = fit.theta[index]
    ends = []
    for sign, bound in ((-1.0, low), (1.0, high)):
        reach = abs(bound - best)
        at, end, before, like = np.sqrt(threshold * variance), np.inf, 0.0, None
        for _ in range(rounds):
            tried = min(at, reach)
            if like is not None:
                like = fit.theta + (like - fit.theta) * tried / before
            found = with_one_held(problem, fit, index, best + sign * tried, like)
            deviance, like, before = (found.squares - fit.squares) / scale, found.theta, tried
            if tried == reach and deviance < threshold:
                end = np.inf
                break
            # The deviance is near a parabola: the next point is where that crosses the threshold.
            at = end = tried * float(np.clip(np.sqrt(threshold / max(deviance, 1e-9)), 0.25, 4.0))
            if abs(end / tried - 1) < CLOSE:
                break
        ends.append(best + sign * end if end < reach else sign * np.inf)
    return Interval(*ends)
