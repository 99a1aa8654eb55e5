# pyright: basic
"""Pressures of the full-order chambers on inputs given at every Runge-Kutta stage."""

from typing import Any

import numpy as np
from numba.extending import register_jitable

from pneumo.configuration.experiment import Plant
from pneumo.simulation.compiled import kernel
from pneumo.simulation.full_order import chamber_rates
from pneumo.simulation.reference import piston_area
from pneumo.simulation.runge_kutta import STAGES, dormand_prince


@register_jitable
def _state_rates(y: np.ndarray, i: int, context: Any, dy: np.ndarray) -> None:
    u, inputs, sign, area, plant = context
    dy[0], dy[1] = chamber_rates(sign * u, sign * inputs[i, 1], sign * inputs[i, 2], y[0], y[1], area, plant)


_step = dormand_prince(_state_rates)


@kernel
def full_order_chamber(
    u: np.ndarray,
    inputs: np.ndarray,
    side: int,
    plant: Plant,
    h: float,
    stride: int,
    P: float,
    T: float,
) -> np.ndarray:
    """Pressure of chamber A (side 0) or B (side 1) from (P, T) on, Pa, shape (stored steps,).

    `u` is the valve's command in each step, V, shape (steps,); `inputs` hold position, m, and velocity, m/s,
    of every stage: shape (steps, 6, 3), of which the first plays no role. `stride` is the number of steps of
    h s between stored pressures. They are NaN from where pressure or temperature left the positive numbers.
    """
    pressure = np.full(len(u) // stride + 1, np.nan)
    y, Y, K = np.array([P, T]), np.empty((STAGES, 2)), np.empty((STAGES, 2))
    sign, area = 1.0 - 2.0 * side, piston_area(plant.cylinder, side)
    pressure[0] = P
    for k in range(len(u)):
        _step(y, (u[k], inputs[k], sign, area, plant), h, Y, K, y)
        if not (y[0] > 0 and y[1] > 0):
            break
        if (k + 1) % stride == 0:
            pressure[(k + 1) // stride] = y[0]
    return pressure
