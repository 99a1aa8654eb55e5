"""Shifts of fitted parameters caused by errors of quantities that are configured and cannot be fitted.

A bore or a zero of the position that is off by its stated accuracy changes the replay or the measured
signals, and so the minimum of the sum of squares. Its shift is computed to first order, from the curvature.
"""

import numpy as np

from pneumo.configuration.parameters import Accuracy
from pneumo.fitting.engine import Solution, inverse_curvature
from pneumo.fitting.fit_problem import LIMITS, Problem, replayed_pressures, si_value
from pneumo.fitting.fitted_parameters import CONFIGURED, SHIFTING, UNFITTED


def changed(problem: Problem, known: Accuracy) -> tuple[Problem, ...]:
    """Problems in which one quantity is off by its accuracy, for each of `UNFITTED`."""
    plant, signals = problem.plant, problem.signals
    c, air, wider = plant.cylinder, plant.conditions, 1 + known.bore
    wide = c._replace(bore=c.bore * wider, A_A=c.A_A * wider**2, A_B=c.A_B * wider**2)
    plants = (
        plant._replace(cylinder=wide),
        plant._replace(cylinder=c._replace(stroke=c.stroke + known.stroke)),
        plant._replace(conditions=air._replace(T_amb=air.T_amb + known.T_amb)),
        plant._replace(conditions=air._replace(P_atm=air.P_atm * (1 + known.P_atm))),
    )
    bore, stroke, T_amb, P_atm = (problem._replace(plant=other) for other in plants)
    gains = (1 + known.P_gain * np.array([[1.0], [0.0]]), 1 + known.P_gain * np.array([[0.0], [1.0]]))
    P_s = signals.P_s if signals.P_s is None else signals.P_s * (1 + known.P_gain)
    records = (
        signals._replace(motion=signals.motion + np.array([known.x_zero, 0.0])),
        signals._replace(motion=signals.motion * (1 + known.x_scale)),
        *(signals._replace(P=signals.P * gain) for gain in gains),
        signals._replace(P_s=P_s),
    )
    zero, scale, P_A, P_B, supply = (problem._replace(signals=other) for other in records)
    return bore, stroke, zero, scale, T_amb, P_atm, P_A, P_B, supply


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

    def residual(other: Problem) -> np.ndarray:
        return other.signals.P - replayed_pressures(other, theta[None])[0]

    here = residual(problem)
    others = [residual(other) - here for other in changed(problem, known)]
    return np.nan_to_num(np.array(others)) / problem.plant.conditions.P_s


def configured_shifts(
    problem: Problem, best: Solution, changes: np.ndarray, known: Accuracy | None
) -> np.ndarray:
    """Shifts of the parameters if a configured quantity is off by its accuracy, for each of `SHIFTING`.

    On the scale of the search, shape (quantity, parameter); zero if `known` is None, and for a prior's centre
    that is not fitted.
    """
    result, inverse = np.zeros((len(SHIFTING), len(best.theta))), inverse_curvature(best)
    if known is None:
        return result
    result[: len(UNFITTED)] = shifts(changes, best.jacobian, inverse)
    for row, name in enumerate(CONFIGURED, len(UNFITTED)):
        if name in problem.names:
            index = problem.names.index(name)
            result[row] = inverse[:, index] * best.prior[index] * getattr(known, name)
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
