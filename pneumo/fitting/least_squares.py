"""Nonlinear least squares: solution, covariance with correlated residuals, and intervals.

A fit is a `LeastSquares`, which knows its parameters and the residual. Sensors have white
noise; noise in the position and whatever a model lacks reach the residual through a replay, which has memory,
so that the usual covariance of least squares would be far too small. Two are computed, from the white part of
the residual and from its auto- and cross-correlation, and the larger one is used. A narrow interval comes
from the standard error, a wide one from the profile of the sum of squares.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.optimize import brentq
from scipy.special import stdtrit

from pneumo.fitting.settings import LEVEL

MEMORY = 1 / 8  # longest lag of the residual's correlation over the length of the record
FREEDOM = 3.71 / MEMORY  # degrees of freedom of a covariance with a Parzen window (Priestley 1981, 6.2.4)
HALF_WIDTH = float(stdtrit(FREEDOM, (1 + LEVEL) / 2))  # of an interval, in standard errors
# On the scale of the search, where 1 is a factor of e of most parameters:
WIDE = 0.3  # half an interval beyond which a profile replaces the standard error
LOOSE = 1.0  # half an interval of a loosely known parameter, on a logarithmic scale
CORRELATED = 0.7  # correlation with a loosely known parameter that counts
DAMPING = 1e-3  # of a search's first step, where each parameter has a curvature of 1
COARSE = 1e-3  # tolerance of a search that comes to nothing
UNKNOWN = 1e6  # variance of a parameter that the record does not determine
SMALLEST = 1e-6  # curvature, over the largest, below which a direction is flat; a derivative's over its root
CLOSE = 0.05  # relative accuracy of the end of an interval
PROFILE_STEPS = 12  # evaluations for each value that is tried for an end


class Scale(NamedTuple):
    """Scale on which a parameter is searched, and its bounds in SI units."""

    low: float
    high: float
    logarithmic: bool = False
    unit: float = 1.0  # of a linear scale

    def inner(self, value: float) -> float:
        """Value on the scale of the search, from that in SI units."""
        return float(np.log(value)) if self.logarithmic else float(value) / self.unit

    def si(self, part: float) -> float:
        """Convert a value on the scale of the search to SI units."""
        return float(np.exp(part)) if self.logarithmic else self.unit * float(part)


class LeastSquares:
    """A problem of least squares with parameters between bounds; arrays of them are on the search's scale."""

    scales: Mapping[str, Scale]  # by parameter
    fixed: Mapping[str, float]  # values of what is not fitted, SI units
    slope_step: ClassVar[float]  # of one-sided differences

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(self.scales)

    def residual(self, theta: np.ndarray) -> np.ndarray:
        """Measured minus computed values, shape (channel, sample)."""
        raise NotImplementedError

    def inner(self, values: Mapping[str, float]) -> np.ndarray:
        """Parameters on the scale of the search, from their values in SI units."""
        return np.array([scale.inner(values[name]) for name, scale in self.scales.items()])

    def values(self, theta: np.ndarray) -> dict[str, float]:
        """Parameters in SI units, fixed ones too."""
        fitted = {name: self.scales[name].si(x) for name, x in zip(self.scales, theta, strict=True)}
        return {**self.fixed, **fitted}

    def named(self, theta: np.ndarray) -> dict[str, float]:
        """Parameters by name, on the scale of the search."""
        return dict(zip(self.names, theta.tolist(), strict=True))

    def bounds(self) -> np.ndarray:
        """Lower and upper bounds, shape (2, parameter)."""
        scales = self.scales.values()
        return np.array([[s.inner(s.low) for s in scales], [s.inner(s.high) for s in scales]])

    def prior_terms(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distances from the priors' centres, and weights of their squares; here without any weight."""
        return theta, np.zeros(len(theta))

    def around(self, theta: np.ndarray) -> tuple[np.ndarray, Callable[[], np.ndarray]]:
        """Residual, and a function that returns what `Solution.jacobian` is, by one-sided differences."""
        low, high = self.bounds()
        steps = np.where(theta - low > high - theta, -self.slope_step, self.slope_step)
        here, changed = self.residual(theta), theta + np.diag(steps)

        def derivatives() -> np.ndarray:
            columns = [(here - self.residual(row)) / size for row, size in zip(changed, steps, strict=True)]
            return np.stack(columns, axis=-1) if columns else np.empty((*here.shape, 0))

        return here, derivatives

    def intervals(self, best: "Solution", both: np.ndarray) -> tuple[dict[str, float], dict[str, float]]:
        """Lower and upper ends of the parameters' intervals, SI units, NaN where open."""
        low, high = dict[str, float](), dict[str, float]()
        for i, (name, scale) in enumerate(self.scales.items()):
            ends = parameter_interval(self, best, i, both)
            low[name], high[name] = (scale.si(end) if np.isfinite(end) else np.nan for end in ends)
        return low, high


@dataclass(frozen=True, eq=False)
class Solution:
    """Sum of squares at parameters on the scale of the search; its derivatives are computed when used."""

    theta: np.ndarray  # parameters
    residual: np.ndarray  # by (channel, sample)
    squares: float  # sum of squared residuals and of the priors' terms
    prior: np.ndarray  # weights of the squared distances from the priors
    derivatives: Callable[[], np.ndarray]

    @cached_property
    def jacobian(self) -> np.ndarray:
        """Derivatives of the computed values, by (channel, sample, parameter)."""
        return self.derivatives()

    @cached_property
    def curvature(self) -> np.ndarray:
        """Half the second derivative of the sum of squares (Gauss and Newton), by (parameter, parameter)."""
        J = self.jacobian.reshape(-1, len(self.theta))
        return J.T @ J + np.diag(self.prior)


def solve(
    problem: LeastSquares,
    start: np.ndarray,
    *,
    tolerance: float = 1e-7,
    most: int = 60,
    fixed: int | None = None,
    hopeless: float = np.inf,
) -> Solution:
    """Local minimum of a sum of squares, searched from `start` (Levenberg and Marquardt, between bounds).

    The search ends after `most` trials, or where a step changes the sum of squares by less than `tolerance`,
    relative (`COARSE` above the sum `hopeless`). The parameter with index `fixed` keeps its value.
    """
    low, high = problem.bounds()
    best, damping = solution_at(problem, np.clip(start, low, high)), DAMPING
    for _ in range(most):
        distance, _ = problem.prior_terms(best.theta)
        J = best.jacobian.reshape(-1, len(start))
        slope, H = J.T @ best.residual.ravel() - best.prior * distance, best.curvature
        free = ((best.theta > low) | (slope > 0)) & ((best.theta < high) | (slope < 0)) & (np.diag(H) > 0)
        if fixed is not None:
            free[fixed] = False
        scale = np.sqrt(np.diag(H)[free])
        size, axes = np.linalg.eigh(H[np.ix_(free, free)] / np.outer(scale, scale))
        move = axes @ ((axes.T @ (slope[free] / scale)) / (np.maximum(size, 0.0) + damping)) / scale
        if float(slope[free] @ move) <= tolerance * best.squares:
            break
        theta = best.theta.copy()
        theta[free] += move
        theta = np.clip(theta, low, high)
        trial = solution_at(problem, theta)
        if not trial.squares < best.squares:
            damping *= 10
            continue
        gained, damping = best.squares - trial.squares, damping / 10
        best = trial
        if gained < (COARSE if best.squares > hopeless else tolerance) * best.squares:
            break
    return best


def solution_at(problem: LeastSquares, theta: np.ndarray) -> Solution:
    """Sum of squares at given parameters."""
    distance, weight = problem.prior_terms(theta)
    residual, derivatives = problem.around(theta)
    squares = float(np.sum(residual**2) + weight @ distance**2)
    return Solution(theta, residual, squares, weight, derivatives)


def convolved(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Convolution along the first axis, followed by zeros."""
    size = next_fast_len(len(first) + len(second) - 1, real=True)
    one, other = (np.asarray(rfft(part, size, axis=0)) for part in (first, second))
    return np.asarray(irfft(one * other, size, axis=0))


def correlations(residual: np.ndarray) -> np.ndarray:
    """Auto- and cross-covariance of the residuals of all channels, with a Parzen taper.

    `residual` has the shape (channel, samples), the result the shape (channel, channel, 2 L + 1), for lags -L
    to L: the mean of first(t) second(t + lag).
    """
    samples = residual.shape[1]
    L = max(1, int(MEMORY * samples))
    lag = np.abs(np.arange(-L, L + 1)) / (L + 1)
    taper = np.where(lag <= 0.5, 1 - 6 * lag**2 + 6 * lag**3, 2 * (1 - lag) ** 3)
    e = residual - residual.mean(axis=1, keepdims=True)
    full = [[convolved(b, a[::-1]) for b in e] for a in e]
    return np.array(full)[:, :, samples - 1 - L : samples + L] / samples * taper


def residual_scatter(found: Solution) -> np.ndarray:
    """Covariance of the slope due to correlated residuals, J' Gamma J, shape (parameter, parameter).

    Gamma is the covariance of the residuals, from `correlations`.
    """
    J, gamma = found.jacobian, correlations(found.residual)
    L, samples = gamma.shape[2] // 2, J.shape[1]
    terms = [
        J[a].T @ convolved(J[b], gamma[a, b][::-1, None])[L : L + samples]
        for a in range(len(J))
        for b in range(len(J))
    ]
    return np.sum(terms, axis=0)


def white_variance(found: Solution) -> float:
    """Variance of the residual's white part: correlated errors change little from sample to sample."""
    return float(np.mean(np.diff(found.residual, axis=1) ** 2) / 2)


def covariances(found: Solution, model_error: float = 0.0) -> np.ndarray:
    """Two covariances of the parameters, shape (2, parameter, parameter).

    With H the curvature and s^2 the variance of the residual's white part, they are s^2 H^-1 and, from the
    covariance Gamma of the residual, H^-1 (J' Gamma J + s^2 W) H^-1, where W has the priors' weights. Both
    include the model's own error, with the sum of squares `model_error`: it is not noise, so an interval
    keeps every value whose added sum of squares stays below it.
    """
    inverse, white = inverse_curvature(found), white_variance(found)
    of_noise = white * inverse @ found.curvature @ inverse
    of_residual = inverse @ (residual_scatter(found) + white * np.diag(found.prior)) @ inverse
    seen = np.sqrt(np.diag(found.curvature))
    # The record does not determine a parameter that changes nothing: infinite variance.
    unseen = np.diag(np.where(seen > SMALLEST**1.5 * seen.max(), 0.0, UNKNOWN))
    return np.array([of_noise, of_residual]) + model_error / HALF_WIDTH**2 * inverse + unseen


def correlation(both: np.ndarray) -> np.ndarray:
    """Correlation of the parameters from the larger of two covariances from `covariances`."""
    covariance = max(both, key=lambda matrix: float(np.trace(matrix)))
    scale = np.sqrt(np.diag(covariance))
    return covariance / np.outer(scale, scale)


def expected_shifts(covariance: np.ndarray) -> np.ndarray:
    """Half-widths of the parameters' intervals from a covariance."""
    return HALF_WIDTH * np.sqrt(np.diag(covariance))


def remainder_shifts(found: Solution) -> np.ndarray:
    """Half-widths by which coloured residuals may have moved the parameters."""
    J, inverse = found.jacobian.reshape(-1, len(found.theta)), inverse_curvature(found)
    added = inverse @ (residual_scatter(found) - white_variance(found) * J.T @ J) @ inverse
    return HALF_WIDTH * np.sqrt(np.maximum(np.diag(added), 0.0))


def bounded(covariance: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Covariance whose standard deviations are at most half the distance between the `bounds`.

    The limit holds in every direction: without it, one flat direction would make every parameter with a small
    part in it uncertain.
    """
    half = (bounds[1] - bounds[0]) / 2
    size, axes = np.linalg.eigh(covariance / np.outer(half, half))
    return (axes * np.clip(size, 0.0, 1.0)) @ axes.T * np.outer(half, half)


def inverse_curvature(found: Solution) -> np.ndarray:
    """Inverse of the curvature, shape (parameter, parameter), with eigenvalues limited for flat directions.

    Eigenvalues, of parameters scaled to a curvature of 1 each, are at least `SMALLEST` times the largest.
    """
    H = found.curvature
    scale = np.sqrt(np.diag(H))
    scale = np.maximum(scale, SMALLEST**1.5 * scale.max())
    size, axes = np.linalg.eigh(H / np.outer(scale, scale))
    return (axes / np.maximum(size, SMALLEST * size.max())) @ axes.T / np.outer(scale, scale)


def parameter_interval(
    problem: LeastSquares, best: Solution, index: int, both: np.ndarray
) -> tuple[float, float]:
    """Interval of parameter `index`, from its standard error if it is narrow, else from the profile.

    The ends are on the scale of the search, infinite where open. A parameter correlated with a loosely known
    one gets the union of both intervals: the sum of squares has a curved valley there. `both` is from
    `covariances`. A parameter whose scale is not logarithmic needs no profile of its own, and is not loose.
    """
    bounds, logarithmic = problem.bounds(), [scale.logarithmic for scale in problem.scales.values()]
    low, high = bounds[:, index]
    limited = max((bounded(c, bounds) for c in both), key=lambda c: c[index, index])
    halves = expected_shifts(limited)
    start, end = best.theta[index] - halves[index], best.theta[index] + halves[index]
    wide = logarithmic[index] and (halves[index] > WIDE or start <= low or end >= high)
    spread = np.sqrt(np.maximum(np.diag(limited), np.finfo(float).tiny))
    related = np.abs(limited[index]) / spread[index] / spread
    if wide or np.any(logarithmic & (halves > LOOSE) & (related > CORRELATED)):
        ends = profile_interval(problem, best, index, float(both[:, index, index].max()))
        start, end = ends if wide else (min(start, ends[0]), max(end, ends[1]))
    return start if start > low else -np.inf, end if end < high else np.inf


def profile_interval(
    problem: LeastSquares, best: Solution, index: int, variance: float
) -> tuple[float, float]:
    """Interval of parameter `index` from the profile of the sum of squares, on the scale of the search.

    A value is inside as long as the lowest sum of squares with this value exceeds the minimum by no more than
    `HALF_WIDTH` squared, in units in which the curvature is the inverse of the parameter's `variance`. An end
    is infinite if the interval reaches a bound of the search.
    """
    inverse = inverse_curvature(best)
    allowed = HALF_WIDTH**2 * variance / inverse[index, index]
    along = inverse[:, index] / inverse[index, index]
    bounds, centre = problem.bounds(), best.theta[index]

    def end(sign: float, limit: float) -> float:
        """Distance of an end from the best value; infinite if the interval reaches the distance `limit`."""
        tried = {0.0: (best.theta, -1.0)}

        def excess(distance: float) -> float:
            """Root of the added sum of squares over that allowed, less 1: about linear in the distance."""
            if distance not in tried:
                nearest = min(tried, key=lambda other: abs(other - distance))
                start = np.clip(tried[nearest][0] + sign * (distance - nearest) * along, *bounds)
                start[index] = centre + sign * distance
                profile = solve(
                    problem, start, tolerance=CLOSE * allowed / best.squares, most=PROFILE_STEPS, fixed=index
                )
                root = float(np.sqrt(max(profile.squares - best.squares, 0.0) / allowed))
                tried[distance] = profile.theta, root - 1 if abs(root - 1) > CLOSE else 0.0
            return tried[distance][1]

        inside, outside = 0.0, min(HALF_WIDTH * float(np.sqrt(variance)), LOOSE, limit)
        while excess(outside) < 0:
            if outside >= limit:
                return np.inf
            inside, outside = outside, min(2 * outside, limit)
        return float(brentq(excess, inside, outside, xtol=CLOSE * min(outside, 1.0) / 2))  # type: ignore[arg-type]

    return centre - end(-1.0, centre - bounds[0, index]), centre + end(1.0, bounds[1, index] - centre)
