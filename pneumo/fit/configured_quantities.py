"""Shifts of fitted parameters by quantities that are configured and cannot be fitted.

A bore, or the zero of the position, that is off by its stated accuracy changes the replay or the measured
signals. The least squares then move; here by the curvature at the optimum, to first order.
"""

from collections.abc import Callable

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.configuration.parameters import Accuracy
from pneumo.fit.fit_problem import LIMITS, Problem, replayed_pressures
from pneumo.fit.fitted_parameters import CONFIGURED, UNFITTED


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


def _warmer(surroundings: bool) -> Callable[[Plant, Accuracy], Plant]:
    def change(plant: Plant, known: Accuracy) -> Plant:
        c = plant.conditions
        warmer = (
            c._replace(T_amb=c.T_amb + known.T_amb) if surroundings else c._replace(T_in=c.T_in + known.T_in)
        )
        return plant._replace(conditions=warmer)

    return change


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
    *(_plant(_wider), _plant(_longer), _moved, _stretched, _plant(_warmer(True)), _plant(_warmer(False))),
    *(_plant(_atmosphere), _gain(0), _gain(1), _measured_supply),
)
# Of `UNFITTED`: the problem in which the quantity is off by its accuracy.
CHANGED = dict(zip(UNFITTED, _CHANGES, strict=True))


def shifts(
    problem: Problem, theta: np.ndarray, J: np.ndarray, inverse: np.ndarray, known: Accuracy
) -> np.ndarray:
    """Shifts of the parameters by each of the `UNFITTED`, off by its accuracy; shape (quantity, parameter).

    They are on the scale of the search, at the optimum `theta`. J is the derivative of the pressures, in
    units of P_s, `inverse` that of the curvature.
    """
    change = _changes(problem, theta, known)
    return change.reshape(len(change), -1) @ J.reshape(-1, len(theta)) @ inverse


def misfit(problem: Problem, theta: np.ndarray, J: np.ndarray, inverse: np.ndarray, known: Accuracy) -> float:
    """Residual that errors of the `UNFITTED` within their accuracy leave, Pa: standard deviation.

    It is what the shifts of the parameters, as from `shifts`, do not take up.
    """
    change = _changes(problem, theta, known)
    taken = shifts(problem, theta, J, inverse, known) @ J.reshape(-1, len(theta)).T
    left = change.reshape(len(change), -1) - taken
    return problem.plant.conditions.P_s * float(np.sqrt(np.sum(np.mean(left**2, axis=1)))) / LIMITS


def _changes(problem: Problem, theta: np.ndarray, known: Accuracy) -> np.ndarray:
    """Change of the residual by each of the `UNFITTED`, in units of P_s, by (quantity, chamber, sample)."""
    plain = problem._replace(noisy=None)

    def residual(changed: Problem) -> np.ndarray:
        return changed.signals.P - replayed_pressures(changed, theta[None])[0, 0]

    before = residual(plain)
    changes = [np.nan_to_num(residual(changed(plain, known)) - before) for changed in CHANGED.values()]
    return np.array(changes) / problem.plant.conditions.P_s


def prior_shifts(problem: Problem, inverse: np.ndarray, prior: np.ndarray, known: Accuracy) -> np.ndarray:
    """Shifts of the parameters by each of `CONFIGURED`, whose prior is off by its accuracy."""
    result = np.zeros((len(CONFIGURED), len(problem.names)))
    for row, name in enumerate(CONFIGURED):
        if name in problem.names:
            index = problem.names.index(name)
            result[row] = inverse[:, index] * prior[index] * getattr(known, name)
    return result
