"""Supplies that sag where no record shows it, and the wider intervals of a fit without the sag.

A line lets the supply fall while a chamber fills. Where its pressure is not logged, a fit puts that into C,
b, the exhaust path and k_0. One step of the search says how far they would move if the supply may sag too.
"""

from dataclasses import replace

import numpy as np

from pneumo.fitting.fit_problem import LIMITS, Problem, replayed_pressures
from pneumo.fitting.fit_result import Estimate
from pneumo.fitting.least_squares import Solution, covariances, expected_shifts, inverse_curvature
from pneumo.quantities.table import FULL_ORDER, SAG

SMALL = 1e-3  # sag, of a difference
SHOWN = 5e-3  # sag that a note names


def sagging_supply(problem: Problem, best: Solution, moved: np.ndarray) -> tuple[float, np.ndarray]:
    """Sag of the supply, a fraction of P_s at full flow, and what intervals would then be.

    The sag is zero where its own interval contains zero. The ends, shape (2, parameter), are on the scale of
    the search; both are the minimum `best` where the supply does not sag, or can't. `moved`, shape
    (quantity, parameter), are the shifts by what is configured.
    """
    constant = np.array([best.theta, best.theta])
    if SAG in problem.names or problem.model.name != FULL_ORDER or problem.signals.P_s is not None:
        return 0.0, constant
    sagging = replace(problem, fixed={**problem.fixed, SAG: SMALL})
    P = replayed_pressures(sagging, best.theta[None])[0]
    slope = (best.residual - problem.signals.residual(P) / problem.plant.conditions.P_s) / SMALL
    slope = np.nan_to_num(slope, nan=0.0, posinf=0.0, neginf=0.0)  # where a replay failed
    J = np.concatenate([best.jacobian, slope[..., None]], axis=-1)
    joint = replace(
        best, theta=np.append(best.theta, 0.0), prior=np.append(best.prior, 0.0), derivatives=lambda: J
    )
    step = inverse_curvature(joint)[:, -1] * np.sum(slope * best.residual)
    *shift, sag = step.tolist()
    if not sag > 0:
        return 0.0, constant
    left = replace(joint, residual=best.residual - J @ step)
    both = covariances(left)
    of_sag = max(expected_shifts(covariance)[-1] for covariance in both)
    both = both[:, :-1, :-1] + moved.T @ moved / LIMITS**2
    halves = np.max([expected_shifts(covariance) for covariance in both], axis=0)
    low, high = constant + shift + np.array([-halves, halves])
    least, most = problem.bounds()  # of the search, beyond which an end is open
    found = sag if sag > of_sag else 0.0
    return found, np.array([np.where(low > least, low, -np.inf), np.where(high < most, high, np.inf)])


def sag_notes(full: Estimate) -> list[str]:
    """Note on the sag of the supply for which the intervals of a fit allow."""
    text = (
        f"with a supply that sags by {100 * full.sag:.2g} % at full flow the record is explained better:"
        " intervals allow for it, values do not; log P_s, or fit the sag (--also sag)"
    )
    return [text] if full.low and full.sag > SHOWN else []
