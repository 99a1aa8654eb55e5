"""First-order effects of quantities that are configured and not fitted.

A bore or a zero of the position that is off by its stated accuracy changes the replay or the measured
signals, and so the minimum of the sum of squares: by the residual and the derivatives at the optimum.
"""

from dataclasses import replace

import numpy as np

from pneumo.configuration.parameters import Accuracy
from pneumo.fitting.fit_problem import LIMITS, Problem, replayed_pressures
from pneumo.fitting.fitted_parameters import CONFIGURED, SHIFTING, UNFITTED
from pneumo.fitting.least_squares import Solution, inverse_curvature


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
    bore, stroke, T_amb, P_atm = (replace(problem, plant=other) for other in plants)
    gains = 1 + known.P_gain * np.eye(2)[..., None]
    P_s = signals.P_s if signals.P_s is None else signals.P_s * (1 + known.P_gain)
    records = (
        signals._replace(motion=signals.motion + np.array([known.x_zero, 0.0])),
        signals._replace(motion=signals.motion * (1 + known.x_scale)),
        *(signals._replace(P=signals.P * gain) for gain in gains),
        signals._replace(P_s=P_s),
    )
    zero, scale, P_A, P_B, supply = (replace(problem, signals=other) for other in records)
    return bore, stroke, zero, scale, T_amb, P_atm, P_A, P_B, supply


def changes_of(problem: Problem, best: Solution, known: Accuracy | None) -> np.ndarray:
    """Changes of the residual if a quantity is off by its accuracy, for each of `UNFITTED`.

    In units of P_s, at the optimum, shape (quantity, chamber, sample); zero if nothing is `known`.
    """

    def residual(other: Problem) -> np.ndarray:
        return other.signals.residual(replayed_pressures(other, best.theta[None])[0])

    if known is None:
        return np.zeros((len(UNFITTED), *problem.signals.P.shape))
    here = residual(problem)
    others = [residual(other) - here for other in changed(problem, known)]
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
    for row, name in enumerate(CONFIGURED, len(UNFITTED)):
        if name in problem.names and known is not None:
            index = problem.names.index(name)
            result[row] = inverse[:, index] * best.prior[index] * getattr(known, name)
    # A parameter that the record does not determine gets no limit from what is configured.
    low, high = problem.bounds()
    return np.clip(result, low - high, high - low), misfit
