"""Confidence intervals of fitted parameters where residuals are correlated.

Noise in pressures is white. Noise in the position and what the model lacks reach the residual through the
replay, which has memory: the usual covariance of least squares would be far too small. Two others are
computed, from replays with added noise and from the auto- and cross-correlation of both chambers'
residuals, and the larger one is used. A narrow interval comes from the standard error, a wide one from the
profile of the sum of squares.
"""

from typing import NamedTuple

import numpy as np
from scipy.signal import fftconvolve
from scipy.stats import t

from pneumo.fit.fit_problem import Problem
from pneumo.fit.fitted_parameters import PARAMETERS
from pneumo.fit.least_squares import Fit, fit_with_one_fixed
from pneumo.fit.stage_signals import PAIRS

LEVEL = 0.95
HALF_WIDTH = float(t.ppf((1 + LEVEL) / 2, PAIRS))  # of an interval, in standard errors from PAIRS noises
# On the scale of the search:
WIDE = 0.3  # half an interval beyond which the model is too far from linear for standard errors
LOOSE = 1.0  # half an interval of a loosely known parameter: a factor of e
UNKNOWN = 1e6  # variance of a parameter that the record does not determine
CORRELATED = 0.7  # correlation with a loosely known parameter that counts
UNSEEN = 1e-9  # derivative, over the largest, that is taken for zero
SMALLEST = 1e-6  # curvature, over the largest, below which a direction is flat
CLOSE = 0.05  # relative accuracy of the end of an interval
LEAST = 1e-3  # deviance over what is allowed, below which the least squares' own accuracy counts
LONGEST_STEP = 4.0  # largest factor between two distances tried
ROUNDS = 6  # values tried for one end
MEMORY = 1 / 8  # longest lag of the residual's correlation over the length of the record


def correlations(residual: np.ndarray) -> np.ndarray:
    """Auto- and cross-covariance of the residuals of all chambers, with a Parzen taper.

    `residual` has the shape (chamber, samples), the result the shape (chamber, chamber, 2 L + 1), for lags -L
    to L: the mean of first(t) second(t + lag).
    """
    samples = residual.shape[1]
    L = max(1, int(MEMORY * samples))
    lag = np.abs(np.arange(-L, L + 1)) / (L + 1)
    taper = np.where(lag <= 0.5, 1 - 6 * lag**2 + 6 * lag**3, 2 * (1 - lag) ** 3)
    e = residual - residual.mean(axis=1, keepdims=True)
    full = [[fftconvolve(b, a[::-1]) for b in e] for a in e]
    return np.array(full)[:, :, samples - 1 - L : samples + L] / samples * taper


def residual_scatter(fit: Fit) -> np.ndarray:
    """Covariance of the slope due to correlated residuals, J' Gamma J, shape (parameter, parameter).

    Gamma is the covariance of the residuals, from `correlations`.
    """
    J, gamma = fit.jacobian, correlations(fit.residual)
    terms = [
        J[a].T @ fftconvolve(J[b], gamma[a, b][::-1, None], mode="same", axes=0)
        for a in range(2)
        for b in range(2)
    ]
    return np.sum(terms, axis=0)


def covariances(fit: Fit, model_error: float = 0.0) -> np.ndarray:
    """Two covariances of the parameters on the scale of the search, shape (2, parameter, parameter).

    From noise: H^-1 (S + s^2 J'J) H^-1, where H is the curvature, S the scatter of the slope under added
    noise and s^2 the variance of the residual's white part. From the residual: H^-1 J' Gamma J H^-1, where
    Gamma is the residual's covariance. Both include the model's own error, with the sum of squares
    `model_error` in units of P_s^2: model error is not noise, so an interval keeps every value whose added
    sum of squares stays below `model_error`.
    """
    J, inverse = fit.jacobian, inverse_curvature(fit)
    flat_J = J.reshape(-1, J.shape[2])
    # Correlated errors change little from sample to sample: differences are those of white noise.
    white = np.mean(np.diff(fit.residual, axis=1) ** 2) / 2
    # The error of a prior's centre moves the slope by its weight.
    inner = np.array([fit.scatter + white * flat_J.T @ flat_J, residual_scatter(fit)]) + white * np.diag(
        fit.prior
    )
    seen = np.sqrt(np.sum(flat_J**2, axis=0) + fit.prior)
    # The record does not determine a parameter that changes nothing: infinite variance.
    of_model = model_error / HALF_WIDTH**2 * inverse
    return inverse @ inner @ inverse + of_model + np.diag(np.where(seen > UNSEEN * seen.max(), 0.0, UNKNOWN))


def correlation(both: np.ndarray) -> np.ndarray:
    """Correlation of the parameters by the larger of two covariances from `covariances`."""
    larger = max(both, key=lambda c: float(np.trace(c)))
    scale = np.sqrt(np.diag(larger))
    return larger / np.outer(scale, scale)


def expected_shifts(covariance: np.ndarray) -> np.ndarray:
    """Half-widths of the parameters' intervals from a covariance, on the scale of the search."""
    return HALF_WIDTH * np.sqrt(np.diag(covariance))


def remainder_shifts(fit: Fit) -> np.ndarray:
    """Half-widths by which coloured residuals may have moved the parameters, on the scale of the search."""
    J, inverse = fit.jacobian.reshape(-1, len(fit.theta)), inverse_curvature(fit)
    white = np.mean(np.diff(fit.residual, axis=1) ** 2) / 2
    added = inverse @ (residual_scatter(fit) - white * J.T @ J) @ inverse
    return HALF_WIDTH * np.sqrt(np.maximum(np.diag(added), 0.0))


def bounded(covariance: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Covariance whose standard deviations are at most half the distance between `Problem.bounds`.

    The limit holds in every direction: without it, one flat direction would make every parameter with a small
    part in it uncertain.
    """
    half = (bounds[1] - bounds[0]) / 2
    size, axes = np.linalg.eigh(covariance / np.outer(half, half))
    return (axes * np.clip(size, 0.0, 1.0)) @ axes.T * np.outer(half, half)


def inverse_curvature(fit: Fit) -> np.ndarray:
    """Inverse of the curvature, shape (parameter, parameter), with eigenvalues limited for flat directions.

    Eigenvalues are at least `SMALLEST` times the largest. The curvature is `plain_curvature` where the
    corrected one is not `definite`.
    """
    size, axes, scale = principal_curvatures(fit)
    if not definite(fit):
        size, axes, scale = principal_curvatures(fit._replace(curvature=plain_curvature(fit)))
    return (axes / np.maximum(size, SMALLEST * size.max())) @ axes.T / np.outer(scale, scale)


def definite(fit: Fit) -> bool:
    """Whether the curvature is positive in every direction that the record shows at all."""
    size, *_ = principal_curvatures(fit)
    return bool(size.min() > -SMALLEST * size.max())


def plain_curvature(fit: Fit) -> np.ndarray:
    """Curvature without the correction for noise in the position; never negative."""
    J = fit.jacobian.reshape(-1, len(fit.theta))
    return J.T @ J + np.diag(fit.prior)


def principal_curvatures(fit: Fit) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Eigenvalues and eigenvectors of the curvature for scaled parameters, and the scales, by parameter.

    A parameter's scale is the root of its diagonal element of `plain_curvature`; each element of the
    curvature is divided by the scales of both parameters.
    """
    scale = np.sqrt(np.diag(plain_curvature(fit)))
    scale = np.maximum(scale, UNSEEN * scale.max())
    size, axes = np.linalg.eigh(fit.curvature / np.outer(scale, scale))
    return size, axes, scale


def parameter_interval(
    problem: Problem, rough: Fit, best: Fit, index: int, both: np.ndarray
) -> tuple[float, float]:
    """Interval of parameter `index`, from its standard error if it is narrow, else from the profile.

    The ends are on the scale of the search, infinite where open. A parameter correlated with a loosely known
    one gets the union of both intervals: the sum of squares has a curved valley there. `problem` has at most
    `FEW_PAIRS` pairs of noisy motions, and `rough` is its fit; `best` is the fit with all pairs; `both` is
    from `covariances`.
    """
    bounds = problem.bounds()
    low, high = bounds[:, index]
    limited = max((bounded(c, bounds) for c in both), key=lambda c: c[index, index])
    halves = HALF_WIDTH * np.sqrt(np.diag(limited))
    start, end = best.theta[index] - halves[index], best.theta[index] + halves[index]
    logarithmic = PARAMETERS[problem.names[index]].search.logarithmic
    wide = logarithmic and (halves[index] > WIDE or start <= low or end >= high)
    correlation = np.abs(limited[index]) / np.sqrt(limited[index, index] * np.diag(limited))
    if wide or np.any((halves > LOOSE) & (correlation > CORRELATED)):
        by_profile = profile_interval(problem, rough, index, float(both[:, index, index].max()))
        ends = np.array(by_profile) + (best.theta[index] - rough.theta[index])
        start, end = ends if wide else (min(start, ends[0]), max(end, ends[1]))
    return start if start > low else -np.inf, end if end < high else np.inf


class Trial(NamedTuple):
    """A value that was tried for a parameter."""

    distance: float  # from the best, on the scale of the search
    deviance: float  # of the profile, over what an interval allows
    theta: np.ndarray


def profile_interval(problem: Problem, fit: Fit, index: int, variance: float) -> tuple[float, float]:
    """Interval of parameter `index` from the profile of the sum of squares, on the scale of the search.

    A value is inside as long as the lowest sum of squares with this value exceeds the minimum by no more than
    `HALF_WIDTH` squared, in units in which the curvature is the inverse of the parameter's `variance`. An end
    is infinite if the interval reaches a bound of the search.
    """
    allowed = HALF_WIDTH**2 * variance / inverse_curvature(fit)[index, index]
    low, high = (bound[index] for bound in problem.bounds())
    best = fit.theta[index]

    def end(sign: float, limit: float) -> float:
        """Distance of an end from the best value; infinite if the interval reaches the distance `limit`."""
        inside, outside = Trial(0.0, LEAST, fit.theta), Trial(np.inf, np.inf, fit.theta)
        distance = min(HALF_WIDTH * float(np.sqrt(variance)), LOOSE, limit)
        for _ in range(ROUNDS):
            start = None if inside.distance == 0 else inside.theta
            value = best + sign * distance
            profile = fit_with_one_fixed(problem, fit, index, value, start, CLOSE * allowed)
            deviance = max((profile.squares - fit.squares) / allowed, LEAST)
            if deviance >= 1:
                outside = Trial(distance, deviance, profile.theta)
            elif distance >= limit:
                return np.inf
            else:
                inside = Trial(distance, deviance, profile.theta)
            before, distance = distance, min(_crossing(inside, outside), limit)
            if abs(distance - before) < CLOSE * min(distance, 1.0):
                break
        return distance

    return best - end(-1.0, best - low), best + end(1.0, high - best)


def _crossing(inside: Trial, outside: Trial) -> float:
    """Next distance to try, not too far from those tried."""
    if np.isinf(outside.distance):
        return inside.distance * min(inside.deviance**-0.5, LONGEST_STEP)
    between = crossing(inside.distance, inside.deviance, outside.distance, outside.deviance)
    return between if inside.distance else max(between, outside.distance / LONGEST_STEP)


def crossing(inside: float, below: float, outside: float, above: float) -> float:
    """Distance from the best at which a deviance is 1, from two distances and their deviances.

    Near the best the deviance is a parabola, far away an exponential.
    """
    if inside == 0:
        return outside * above**-0.5
    return inside + float(np.log(below) / np.log(below / above)) * (outside - inside)
