"""Kalman filters that use a model, and the observability of their states.

The states are (x, v, P_A, P_B), with rates by eq (3) and a reduced model.
"""

from typing import NamedTuple

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.evidence.at_work.sampled_plant import PRESSURE_VARIANCE, X_VARIANCE
from pneumo.linear.linear_model import linearise
from pneumo.physics.models import MODELS, Lane
from pneumo.simulation.full_order_replay import FullRow
from pneumo.simulation.kalman_filter import FilterModel, Noise

STATES = 4


def reduced(lane: Lane) -> FilterModel:
    """Filter model that uses a reduced model and does not estimate k_0."""
    return FilterModel(False, False, lane, FullRow())


def filter_noise(force: float, pressure: float) -> Noise:
    """Noise of a filter: process noise `force`, N s^0.5, and `pressure`, Pa/s^0.5, as given.

    The variances of the readings are those of the sensors in `sampled_plant`.
    """
    return Noise(force, pressure, X_VARIANCE, PRESSURE_VARIANCE)


class Observability(NamedTuple):
    """Observability of an actuator from a set of sensors, by linear models."""

    rank: int  #: least rank of the scaled observability matrix; 4 is observable
    #: Standard deviation of P_A and P_B, Pa, that the samples leave to a perfect linear model without process
    #: noise; root mean square over the operating points.
    deviation: np.ndarray


def observability(
    model: str, n: float, plant: Plant, measured_pressures: int, duration: float = 0.5, h: float = 1e-3
) -> Observability:
    """Observability of (x, v, P_A, P_B) from x and no, one (P_A) or both pressures, by linear models.

    The model is linearised at six points: x = -0.3, 0, 0.3 strokes and u = -0.1, 0.1 u_max, at P_0 and
    0.05 m/s. The sensors are sampled every `h` s for `duration` s.
    """
    scale = np.array([plant.cylinder.stroke, 1.0, plant.conditions.P_0, plant.conditions.P_0])
    variance = np.array([X_VARIANCE, PRESSURE_VARIANCE, PRESSURE_VARIANCE])[: 1 + measured_pressures]
    outputs = np.eye(STATES)[[0, 2, 3][: 1 + measured_pressures]]
    P_0, squares, ranks = plant.conditions.P_0, list[np.ndarray](), list[int]()
    index = n if MODELS[model].has_n else None
    for x in (-0.3, 0.0, 0.3):
        for u in (-0.1, 0.1):
            place, open_valve = x * plant.cylinder.stroke, u * plant.valve.u_max
            point = linearise(
                model, index, plant, u=open_valve, x=place, v=0.05, P_A=P_0, P_B=P_0, states="actuator"
            )
            A = np.asarray(point.A)
            F = np.eye(STATES) + h * A + h**2 / 2 * A @ A
            information, reach = np.zeros((STATES, STATES)), outputs.copy()
            for _ in range(round(duration / h)):
                weighted = reach * scale / np.sqrt(variance)[:, None]
                information += weighted.T @ weighted
                reach = reach @ F
            squares.append(scale[2:] ** 2 * np.diag(np.linalg.inv(information))[2:])
            scaled, rate = A * scale / scale[:, None], np.abs(np.linalg.eigvals(A)).max()
            powers = [outputs @ np.linalg.matrix_power(scaled / rate, k) for k in range(STATES)]
            ranks.append(int(np.linalg.matrix_rank(np.vstack(powers))))
    return Observability(min(ranks), np.sqrt(np.mean(squares, axis=0)))
