"""Shifts of fitted parameters caused by errors of quantities that are configured and cannot be fitted.

A bore or a zero of the position that is off by its stated accuracy changes the replay or the measured
signals, and so the minimum of the sum of squares. Its shift is computed to first order, from the curvature.
"""

from collections.abc import Callable

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.configuration.parameters import Accuracy
from pneumo.fit.engine import Solution, inverse_curvature
from pneumo.fit.fit_problem import LIMITS, Problem, replayed_pressures, si_value
from pneumo.fit.fitted_parameters import CONFIGURED, SHIFTING, UNFITTED


def _plant(change: Callable[[Plant, Accuracy], Plant]) -> Callable[[Problem, Accuracy], Problem]:
    return lambda problem, known: problem._replace(plant=change(problem.plant, known))


def _wider(plant: Plant, known: Accuracy) -> Plant:
    c, factor = plant.cylinder, 1 + known.bore
    return plant._replace(
        cylinder=c._replace(bore=c.bore * factor, A_A=c.A_A * factor**2, A_B=c.A_B * factor**2)
    )


def _longer(plant: Plant, known: Accuracy) -> Plant:
    return plant._replace(cylinder=plant.cylinder._replace(stroke=plant.cylinder.stroke + known.stroke))


def _moved(problem: Problem, known: Accuracy) -> Problem:
    motion = problem.signals.motion + np.array([known.x_zero, 0.0])
    return problem._replace(signals=problem.signals._replace(motion=motion))


def _stretched(problem: Problem, known: Accuracy) -> Problem:
    motion = problem.signals.motion * (1 + known.x_scale)
    return problem._replace(signals=problem.signals._replace(motion=motion))


def _warmer(plant: Plant, known: Accuracy) -> Plant:
    c = plant.conditions
    return plant._replace(conditions=c._replace(T_amb=c.T_amb + known.T_amb))


def _atmosphere(plant: Plant, known: Accuracy) -> Plant:
    c = plant.conditions
    return plant._replace(conditions=c._replace(P_atm=c.P_atm * (1 + known.P_atm)))


def _gain(side: int) -> Callable[[Problem, Accuracy], Problem]:
    def change(problem: Problem, known: Accuracy) -> Problem:
        P = problem.signals.P.copy()
        P[side] *= 1 + known.P_gain
        return problem._replace(signals=problem.signals._replace(P=P))

    return change


def _measured_supply(problem: Problem, known: Accuracy) -> Problem:
    P_s = problem.signals.P_s
    return (
        problem
        if P_s is None
        else problem._replace(signals=problem.signals._replace(P_s=P_s * (1 + known.P_gain)))
    )


_CHANGES = (
    *(_plant(_wider), _plant(_longer), _moved, _stretched, _plant(_warmer)),
    *(_plant(_atmosphere), _gain(0), _gain(1), _measured_supply),
)
# Of `UNFITTED`: the problem in which the quantity is off by its accuracy.
CHANGED = dict(zip(UNFITTED, _CHANGES, strict=True))


def shifts(changes: np.ndarray, J: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """Shifts of the parameters caused by `changes` of the residual, shape (quantity, parameter).

    They are on the scale of the search. `changes` are from `changes_of`; J is the derivative of the replayed
    pressures in units of P_s, by (chamber, sample, parameter); `inverse` is the inverse of the curvature.
    """
    return changes.reshape(len(changes), J[..., 0].size) @ J.reshape(-1, len(inverse)) @ inverse


def misfit(changes: np.ndarray, J: np.ndarray, inverse: np.ndarray) -> float:
    """Standard deviation of the residual that `changes` leave once parameters have shifted, in units of P_s.

    `changes`, J and `inverse` are those of `shifts`; the squares of all quantities' residuals add up.
    """
    left = (
        changes.reshape(len(changes), J[..., 0].size)
        - shifts(changes, J, inverse) @ J.reshape(-1, len(inverse)).T
    )
    return float(np.sqrt(np.sum(np.mean(left**2, axis=1)))) / LIMITS


def changes_of(problem: Problem, theta: np.ndarray, known: Accuracy) -> np.ndarray:
    """Changes of the residual if a quantity is off by its accuracy, for each of `UNFITTED`.

    In units of P_s, at the optimum `theta`, shape (quantity, chamber, sample).
    """
    replayed = replayed_pressures(problem, theta[None])[0]
    result = np.zeros((len(CHANGED), *replayed.shape))
    for row, change in enumerate(CHANGED.values()):
        changed = change(problem, known)
        if changed.signals.P is not problem.signals.P:
            result[row] = changed.signals.P - problem.signals.P
        elif changed is not problem:
            result[row] = np.nan_to_num(replayed - replayed_pressures(changed, theta[None])[0])
    return result / problem.plant.conditions.P_s


def prior_shifts(problem: Problem, inverse: np.ndarray, prior: np.ndarray, known: Accuracy) -> np.ndarray:
    """Shifts of the parameters if the centre of a prior is off by its accuracy, for each of `CONFIGURED`.

    On the scale of the search, shape (quantity, parameter); zero for a quantity that is not fitted.
    """
    result = np.zeros((len(CONFIGURED), len(problem.names)))
    for row, name in enumerate(CONFIGURED):
        if name in problem.names:
            index = problem.names.index(name)
            result[row] = inverse[:, index] * prior[index] * getattr(known, name)
    return result


def configured_shifts(
    problem: Problem, best: Solution, changes: np.ndarray, known: Accuracy | None
) -> np.ndarray:
    """Shifts of the parameters if a configured quantity is off by its accuracy, for each of `SHIFTING`.

    On the scale of the search, shape (quantity, parameter); zero if `known` is None.
    """
    if known is None:
        return np.zeros((len(SHIFTING), len(best.theta)))
    inverse = inverse_curvature(best)
    unfitted = shifts(changes, best.jacobian, inverse)
    result = np.append(unfitted, prior_shifts(problem, inverse, best.prior, known), axis=0)
    # A parameter that the record does not determine gets no limit from what is configured.
    low, high = problem.bounds()
    return np.clip(result, low - high, high - low)


def parameter_shifts(problem: Problem, best: Solution, moved: np.ndarray) -> dict[str, np.ndarray]:
    """`configured_shifts` in SI units by parameter, shape (quantity,)."""
    upper = best.theta + moved
    return {
        name: np.array([si_value(name, end) - si_value(name, best.theta[i]) for end in upper[:, i]])
        for i, name in enumerate(problem.names)
    }
