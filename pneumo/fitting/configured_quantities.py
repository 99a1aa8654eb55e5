"""First-order effects of quantities that are configured and not fitted.

A bore or a zero of the position that is off by its stated accuracy changes the replay or the measured
signals, and so the minimum of the sum of squares: by the residual and the derivatives at the optimum.
"""

from dataclasses import replace

import numpy as np

from pneumo.configuration.priors import Accuracy
from pneumo.fitting.fit_problem import LIMITS, Problem, replayed_pressures
from pneumo.fitting.least_squares import Solution, inverse_curvature
from pneumo.fitting.on_signals import misread
from pneumo.quantities.applied import value_in, with_values
from pneumo.quantities.table import CONFIGURED, QUANTITIES, SHIFTING, UNFITTED


def changed(problem: Problem, name: str, off: float) -> Problem:
    """Problem in which one of `UNFITTED` is `off`, as `Accuracy` has it."""
    quantity, plant = QUANTITIES[name], problem.plant
    if not quantity.field:
        return replace(problem, signals=misread(problem.signals, name, off))
    value = value_in(plant, name)
    value = value * (1 + off) if quantity.relative else value + off
    return replace(problem, plant=with_values(plant, {name: value}))


def changes_of(problem: Problem, best: Solution, known: Accuracy | None) -> np.ndarray:
    """Changes of the residual if a quantity is off by its accuracy, for each of `UNFITTED`.

    In units of P_s, at the optimum, shape (quantity, chamber, sample); zero if nothing is `known`.
    """

    def residual(other: Problem) -> np.ndarray:
        return other.signals.residual(replayed_pressures(other, best.theta[None])[0])

    if known is None:
        return np.zeros((len(UNFITTED), *problem.signals.P.shape))
    here = residual(problem)
    others = [
        0 * here if name in problem.names else residual(changed(problem, name, known[name])) - here
        for name in UNFITTED
    ]
    return np.nan_to_num(np.array(others)) / problem.plant.conditions.P_s


def configured_shifts(
    problem: Problem, best: Solution, changes: np.ndarray, known: Accuracy | None
) -> tuple[np.ndarray, float]:
    """Shifts of the parameters if a quantity is off by its accuracy, and the residual that is left then.

    The shifts, for each of `SHIFTING`, are on the scale of the search, shape (quantity, parameter). The
    residual is the standard deviation over all quantities, in units of P_s.
    """
    result, inverse = np.zeros((len(SHIFTING), len(best.theta))), inverse_curvature(best)
    unfitted = np.tensordot(changes, best.jacobian, 2) @ inverse
    left = changes - np.tensordot(unfitted, best.jacobian, axes=(1, 2))
    misfit = float(np.sqrt(np.sum(np.mean(left**2, axis=(1, 2))))) / LIMITS
    result[: len(UNFITTED)] = unfitted
    for name in CONFIGURED:
        if name in problem.names and known is not None:
            row, index = SHIFTING.index(QUANTITIES[name].name), problem.names.index(name)
            result[row] = inverse[:, index] * best.prior[index] * known[name]
    # A parameter that the record does not determine gets no limit from what is configured.
    low, high = problem.bounds()
    return np.clip(result, low - high, high - low), misfit
