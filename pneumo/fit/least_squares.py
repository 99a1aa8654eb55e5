"""Least squares over a whole replay, corrected for the bias that noise in the position causes."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from pneumo.errors import InputError
from pneumo.fit.fit_problem import Problem, pressure_and_jacobian, scaled_pressures
from pneumo.fit.fitted_parameters import FULL_ORDER

OFF = 10.0  # residual, in units of P_s, where a replay left the positive numbers
SETTLED = 0.03  # change of the sum of squares, over the variance of a residual, that is negligible
ROUNDS = 8
KEPT = 2  # evaluations of a search that are remembered
SPIKE = 3.0  # of a derivative's usual maximum, by which it may differ from the median of its neighbours
USUAL_MAXIMUM = 99  # percentile of a derivative's magnitude
NEIGHBOURS = 5  # samples of that median
FLAT = 1e-2  # curvature over the largest, below which a direction is flat and left out of the first guess


class Fit(NamedTuple):
    """Sum of squares of a model at one set of parameters, corrected for position noise, with derivatives.

    Pressures count in units of P_s, parameters on the scale of the search.
    """

    theta: np.ndarray  # parameters
    residual: np.ndarray  # measured minus replayed pressure by (chamber, sample)
    jacobian: np.ndarray  # derivative of the replayed pressure by (chamber, sample, parameter)
    squares: float  # corrected sum of squared residuals
    slope: np.ndarray  # minus half its gradient
    curvature: np.ndarray  # half its second derivative (Gauss and Newton's)
    scatter: np.ndarray  # covariance of the slope due to noise in the position, by (parameter, parameter)
    prior: np.ndarray  # weights of the squared distances from the priors, by parameter; part of the sum


def without_spikes(J: np.ndarray) -> np.ndarray:
    """Derivative J, shape (motion, chamber, sample, parameter), with its spikes cut.

    Where the pressures of a chamber and its port are equal, eq (1) has no finite slope, and the derivative of
    one sample may be larger than that of all others together. Each value is limited to a range about the
    median of all motions and neighbouring samples. J is changed in place.
    """
    limit = SPIKE * np.percentile(np.abs(J[0]), USUAL_MAXIMUM, axis=1)
    # Only a derivative above half the limit can differ from its neighbours by more than the limit.
    side, sample, parameter = np.nonzero(np.maximum(J.max(axis=0), -J.min(axis=0)) > limit[:, None] / 2)
    last, around = J.shape[2] - 1, np.arange(NEIGHBOURS) - NEIGHBOURS // 2
    near = np.clip(sample[:, None] + around, 0, last)
    usual = np.median(np.median(J[:, side[:, None], near, parameter[:, None]], axis=0), axis=1)
    most = limit[side, parameter]
    J[:, side, sample, parameter] = np.clip(J[:, side, sample, parameter], usual - most, usual + most)
    return J


def evaluate(problem: Problem, theta: np.ndarray) -> Fit:
    """Corrected sum of squares at a set of parameters, with slope and curvature.

    Noise in the position adds a bias to the replayed pressure and to its mean square, larger at some
    parameters than at others. Both are estimated with added noise and subtracted: with P the replay and P_b
    the replays with added noise, the corrected sum is

        sum (measured - P + (mean P_b - P))^2  -  mean over b of  sum (P_b - mean P_b)^2.

    `scatter` is the covariance of the slope over the P_b. In it, pressure and derivative vary together, which
    a first-order covariance of the pressure alone misses.
    """
    P, J = pressure_and_jacobian(problem, theta)
    J = without_spikes(J)
    count, number = len(theta), len(P) - 1
    pressure, jacobian = P[0], J[0]
    excess, excess_slope, excess_curvature = 0.0, np.zeros(count), np.zeros((count, count))
    scatter = np.zeros_like(excess_curvature)
    if number:
        mean_P, mean_J = P[1:].mean(axis=0), J[1:].mean(axis=0)
        slope_of_each, slopes = np.zeros((number, count)), np.zeros((number, count))
        for b in range(number):  # one at a time: the derivatives of all take gigabytes
            d, J_d = (P[b + 1] - mean_P).ravel(), (J[b + 1] - mean_J).reshape(-1, count)
            slope_of_each[b] = d @ J_d
            slopes[b] = slope_of_each[b] + d @ mean_J.reshape(-1, count)
            excess += float(d @ d) / number
            excess_curvature += J_d.T @ J_d / number
        excess_slope = slope_of_each.mean(axis=0)
        scatter = np.atleast_2d(np.cov(np.where(np.isfinite(slopes), slopes, 0.0), rowvar=False))
        pressure, jacobian = 2 * pressure - mean_P, 2 * jacobian - mean_J
    residual = problem.signals.P / problem.plant.conditions.P_s - pressure
    residual = np.where(np.isfinite(residual), residual, OFF)
    J = jacobian.reshape(-1, count)
    squares = float(np.sum(residual**2)) - (excess if np.isfinite(excess) else 0.0)
    slope = J.T @ residual.ravel() + excess_slope
    distance, prior = problem.prior_terms(theta)
    squares, slope = squares + float(prior @ distance**2), slope - prior * distance
    curvature = J.T @ J - excess_curvature + np.diag(prior)
    return Fit(
        theta=theta,
        residual=residual,
        jacobian=jacobian,
        squares=squares,
        slope=slope,
        curvature=curvature,
        scatter=scatter,
        prior=prior,
    )


def squares_at(problem: Problem, theta: np.ndarray) -> float:
    """Corrected sum of squares, as from `evaluate`, computed without derivatives."""
    P, *noisy = scaled_pressures(problem, theta[None])[:, 0]
    excess = 0.0
    if noisy:
        mean_P = np.mean(noisy, axis=0)
        excess = float(np.sum((np.array(noisy) - mean_P) ** 2)) / len(noisy)
        P = 2 * P - mean_P
    residual = problem.signals.P / problem.plant.conditions.P_s - P
    residual = np.where(np.isfinite(residual), residual, OFF)
    distance, prior = problem.prior_terms(theta)
    squares = float(np.sum(residual**2)) - (excess if np.isfinite(excess) else 0.0)
    return squares + float(prior @ distance**2)


def fit(problem: Problem, tolerance: float = 1e-5, most: int = 40, start: np.ndarray | None = None) -> Fit:
    """Fit a model: plain least squares first, then corrected for noise in the position.

    The correction needs `problem.noisy`; without it, the plain fit is returned.

    The search begins at `start`, on the scale of the search, or at `Problem.guess`. Plain least squares ends
    after `most` evaluations, or where the sum of squares or the parameters change by less than `tolerance`,
    relative. `InputError` if no flows were measured and the valve leaks or is partly laminar, which the
    replay of a fit does not model.
    """
    valve = problem.plant.valve
    if problem.signals.flow is None and not valve.paths.one_at_a_time:
        raise InputError(
            "valve: in a fit a chamber has one path open at a time, and all paths one b: leave out exhaust_b"
            " and commands at which a curve opens both"
        )
    if problem.signals.flow is None and (valve.leak or valve.laminar):
        raise InputError(
            f"valve: leak = {valve.leak:.4g} m2, laminar = {valve.laminar:.4g}: must both be 0 for a fit;"
            " leave leak_dm3_per_sbar out, or measure the flows m_A and m_B"
        )
    plain = problem._replace(noisy=None)

    # Each result holds the derivative at every sample: only that of the last point accepted is needed again.
    @lru_cache(maxsize=KEPT)
    def at(*theta: float) -> Fit:
        return evaluate(plain, np.array(theta))

    # The search reads only lengths and products of residual and derivative. The triangle of the QR
    # decomposition has the same, in a few rows instead of one for each sample.
    @lru_cache(maxsize=KEPT)
    def rotated(*theta: float) -> np.ndarray:
        distance, prior = problem.prior_terms(np.array(theta))
        now, root = at(*theta), np.sqrt(prior)
        of_record = np.column_stack([-now.jacobian.reshape(-1, len(theta)), now.residual.ravel()])
        of_priors = np.column_stack([np.diag(root), root * distance])
        return np.asarray(np.linalg.qr(np.concatenate([of_record, of_priors]), mode="r"))

    optimum = least_squares(
        lambda theta: rotated(*theta)[:, -1],
        problem.guess() if start is None else start,
        jac=lambda theta: rotated(*theta)[:, :-1],  # type: ignore[arg-type]
        bounds=problem.bounds(),
        x_scale="jac",
        ftol=tolerance,
        xtol=tolerance,
        gtol=None,  # type: ignore[arg-type]
        max_nfev=most,
    )
    return descend(problem, optimum.x) if problem.noisy is not None else at(*optimum.x)


def descend(
    problem: Problem, theta: np.ndarray, fixed: int | None = None, most: int = ROUNDS, negligible: float = 0.0
) -> Fit:
    """Minimise the corrected sum of squares from `theta`, near its minimum (Levenberg and Marquardt).

    The parameter with index `fixed` keeps its value; `most` is the largest number of steps. The search ends
    when the sum of squares changes by less than `negligible`, or by less than `SETTLED` times the variance of
    a residual. With a fixed parameter, the derivatives returned may be those of the step before.
    """
    # Where some parameters take replays of their own, or motions do, a sum alone is cheap beside derivatives.
    alone = fixed is not None and (problem.model.name == FULL_ORDER or problem.noisy is not None)
    low, high = problem.bounds()
    best, damping = evaluate(problem, np.clip(theta, low, high)), 1e-3
    negligible = max(negligible, SETTLED * best.squares / best.residual.size)
    for _ in range(most):
        slope = best.slope
        free = ((best.theta > low) | (slope > 0)) & ((best.theta < high) | (slope < 0))
        if fixed is not None:
            free[fixed] = False
        J = best.jacobian.reshape(-1, len(slope))[:, free]
        scale = np.sqrt(np.maximum(np.sum(J**2, axis=0) + best.prior[free], np.finfo(float).tiny))
        size, axes = np.linalg.eigh(best.curvature[np.ix_(free, free)] / np.outer(scale, scale))
        # In a direction without positive curvature, damping alone limits the step.
        move = axes @ ((axes.T @ (slope[free] / scale)) / (np.maximum(size, 0.0) + damping)) / scale
        if float(slope[free] @ move) < negligible:
            break
        theta = best.theta.copy()
        theta[free] += move
        theta = np.clip(theta, low, high)
        if alone:
            squares = squares_at(problem, theta)
            if squares >= best.squares:
                damping *= 10
                continue
            if best.squares - squares < negligible:
                return best._replace(theta=theta, squares=squares)
        trial = evaluate(problem, theta)
        if trial.squares < best.squares:
            gained, best, damping = best.squares - trial.squares, trial, damping / 10
            if gained < negligible:
                break
        else:
            damping *= 10
    return best


def fit_with_one_fixed(
    problem: Problem, best: Fit, index: int, value: float, start: np.ndarray | None, negligible: float
) -> Fit:
    """Fit the other parameters with parameter `index` fixed at `value`, on the scale of the search.

    `best` is the fit with none fixed; `negligible` is as in `descend`. The search starts at `start`, or else
    at the minimum of the linearised problem, with flat directions left out.
    """
    others = np.arange(len(best.theta)) != index
    if start is None:
        H, move = best.curvature, value - best.theta[index]
        J = best.jacobian.reshape(-1, len(H))
        scale = np.sqrt(np.diag(J.T @ J) + best.prior)[others]
        size, axes = np.linalg.eigh(H[np.ix_(others, others)] / np.outer(scale, scale))
        kept = np.where(size > FLAT * size.max(), size, np.inf)
        start = best.theta.copy()
        start[others] -= axes @ ((axes.T @ (H[others, index] * move / scale)) / kept) / scale
    start = start.copy()
    start[index] = value
    return descend(problem, start, fixed=index, negligible=negligible)
