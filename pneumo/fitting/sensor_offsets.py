"""Offsets of the pressure sensors that a fit shows without fitting them, to first order.

An offset moves k_0 and the dead volumes and leaves hardly a residual. The offset that would lower the sum of
squares most follows from the residual and the derivatives at the optimum, without another replay.
"""

from typing import NamedTuple

import numpy as np

from pneumo.fitting.engine import Solution, inverse_curvature, residual_scatter
from pneumo.fitting.fit_problem import LIMITS, Problem


class SensorOffset(NamedTuple):
    """Offset of the sensor of one chamber, Pa."""

    value: float
    deviation: float  # standard deviation of it by noise, remainder and what is configured
    shifts: np.ndarray  # of the parameters, on the scale of the search, if it were fitted too


def sensor_offsets(problem: Problem, best: Solution, changes: np.ndarray) -> dict[str, SensorOffset]:
    """Offsets by the name of their cause, each as if it alone were fitted too; fitted ones are left out.

    `changes`, from `changes_of`, are those of the residual if a configured quantity is off, in units of P_s.
    """
    J, inverse, P_s = best.jacobian, inverse_curvature(best), problem.plant.conditions.P_s
    flat_J, result = J.reshape(-1, J.shape[2]), dict[str, SensorOffset]()
    for side, name in enumerate(("offset_A", "offset_B")):
        if name in problem.also:
            continue
        column = np.zeros(J.shape[:2])
        column[side] = 1.0
        moves = inverse @ flat_J.T @ column.ravel()
        left = column - (flat_J @ moves).reshape(column.shape)  # what the parameters do not take up
        curvature = float(np.sum(left * column))
        value = float(np.sum(left * best.residual)) / curvature
        scatter = float(residual_scatter(best._replace(jacobian=left[..., None]))[0, 0])
        configured = np.sum(changes * left, axis=(1, 2)) / LIMITS
        deviation = float(np.sqrt(max(scatter, 0.0) + configured @ configured)) / curvature
        result[name] = SensorOffset(P_s * value, P_s * deviation, -value * moves)
    return result
