# pyright: basic
"""Replay written to be read: one lane (a model at one n) and one chamber at a time.

`pneumo.simulation.vectorised` computes the same about 25 times as fast.
"""

from typing import Any

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.configuration.sampling import Sampling
from pneumo.physics.cylinder import Chamber, chamber_of, heat_area, sign_of, volume
from pneumo.physics.models import Lane, model_dP_dt, temperature
from pneumo.physics.valve import chamber_flows
from pneumo.simulation.compiled import inlined, kernel
from pneumo.simulation.full_order import Recording
from pneumo.simulation.runge_kutta import STAGES, dormand_prince, embedded_error
from pneumo.simulation.signals import replay_tolerance, stage_inputs

inlined(temperature)
inlined(model_dP_dt)


@inlined
def lane_of(row: np.ndarray) -> Lane:
    """Return a row of `pneumo.physics.models.lane_array` as a `Lane` with named coefficients."""
    return Lane(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8], row[9])


@inlined
def lane_rate(u: float, x: float, v: float, P: float, chamber: Chamber, plant: Plant, lane: Lane) -> float:
    """Rate of pressure of one chamber by a reduced model, Pa/s; `lane` holds the model's coefficients.

    Signs of the limited command u, V, x, m, and v, m/s, are those of chamber A; for B negate all three.
    """
    T = temperature(P, plant.conditions.P_0, plant.conditions.T_0, lane.a)
    m_in, m_out = chamber_flows(u, P, T, plant.valve, plant.gas, plant.conditions)
    return lane_rate_with_flows(m_in, m_out, x, v, P, T, chamber, plant, lane)


@inlined
def lane_rate_with_flows(
    m_in: float,
    m_out: float,
    x: float,
    v: float,
    P: float,
    T: float,
    chamber: Chamber,
    plant: Plant,
    lane: Lane,
) -> float:
    """Rate of pressure of one chamber by a reduced model, Pa/s, from known mass flows, kg/s.

    T, K, is the temperature that the model gives to P, Pa. For chamber B, negate x, m, and v, m/s.
    """
    conditions, gas = plant.conditions, plant.gas
    return model_dP_dt(
        P,
        T,
        volume(x, chamber, plant.cylinder),
        chamber.area * v,
        m_in,
        m_out,
        heat_area(x, plant.cylinder) / heat_area(0.0, plant.cylinder),
        plant.k_0,
        conditions.P_0,
        conditions.T_0,
        conditions.T_in,
        conditions.T_amb,
        gas.R,
        gas.gamma,
        lane,
    )


@inlined
def lane_rates(y: np.ndarray, i: int, context: Any, dy: np.ndarray) -> None:
    """Write the rate of a chamber's pressure y[0], Pa/s, by a reduced model at Runge-Kutta stage i into dy.

    `context` is the tuple (u, x and v at every stage; sign of the chamber; chamber; plant; lane).
    """
    inputs, sign, chamber, plant, lane = context
    u, x, v = sign * inputs[i, 0], sign * inputs[i, 1], sign * inputs[i, 2]
    dy[0] = lane_rate(u, x, v, y[0], chamber, plant, lane)


_step, _estimate = dormand_prince(lane_rates), embedded_error(lane_rates)


@inlined
def lane_step(
    P: np.ndarray, context: Any, h: float, estimated: bool, Y: np.ndarray, K: np.ndarray, error: np.ndarray
) -> float:
    """Advance a chamber's pressure P, shape (1,), in place by h s by a reduced model; NaN if not positive.

    Returns the estimated error over P_0; infinite where the step failed, 0 unless `estimated`.
    """
    _step(P, context, h, Y, K, P)
    if not P[0] > 0:
        P[0] = np.nan
        return np.inf
    if not estimated:
        return 0.0
    _estimate(P, context, h, K, error)
    relative = abs(error[0]) / context[3].conditions.P_0
    return relative if relative < np.inf else np.inf


@kernel
def replay_lanes(
    recording: Recording, lanes: np.ndarray, sampling: Sampling, stride: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Replay every lane (one model at one n) in both chambers on the signals of one run.

    Returns
    -------
    moments : numpy.ndarray
        Sums over all steps of the error (full-order minus reduced pressure), Pa, and of its square, Pa^2:
        shape (lane, chamber, 2).
    failure : numpy.ndarray
        Step at which a pressure was no longer positive, or -1: shape (lane, chamber).
    pressure : numpy.ndarray
        Pa, shape (lane, chamber, stored steps).
    """
    steps, count, plant = len(recording.states) - 1, len(lanes), recording.plant
    pressure = np.empty((count, 2, steps // stride + 1))
    moments = np.zeros((count, 2, 2))
    failure = np.full((count, 2), -1)
    P, P_before, error = np.full((count, 2, 1), plant.conditions.P_0), np.empty(1), np.empty(1)
    most, largest, tolerance = recording.most_halvings, 0.0, replay_tolerance(sampling)
    pressure[:, :, 0] = plant.conditions.P_0
    y, Y, K = np.empty(6), np.empty((STAGES + 1, 6)), np.empty((STAGES + 1, 6))
    # Of every part of a step, however often it is halved: parts 1, then 2 and 3, then 4 to 7, ...
    inputs = np.empty((2 << most, STAGES + 1, 3))
    Y_lane, K_lane = np.empty((STAGES, 1)), np.empty((STAGES + 1, 1))
    for k in range(steps):
        first = recording.halvings[k] if sampling.exact else 0
        known = first - 1  # halvings for which the inputs are known
        for side in range(2):
            sign = sign_of(side)
            chamber = chamber_of(plant.cylinder, side)
            P_full = recording.states[k + 1, 2 + 2 * side]
            for i in range(count):
                if failure[i, side] >= 0:
                    continue
                P_i, lane = P[i, side], lane_of(lanes[i])
                P_before[0] = P_i[0]
                for halvings in range(first, most + 1):
                    parts, largest, P_i[0] = 1 << halvings, 0.0, P_before[0]
                    for part in range(parts):
                        now = inputs[parts + part]
                        if halvings > known:
                            stage_inputs(recording, sampling, k, part, parts, y, Y, K, now)
                        context = (now, sign, chamber, plant, lane)
                        estimate = lane_step(
                            P_i, context, recording.h / parts, most > 0, Y_lane, K_lane, error
                        )
                        largest = max(largest, estimate)
                    known = max(known, halvings)
                    if largest <= tolerance:
                        break
                if not P_i[0] > 0:
                    failure[i, side] = k + 1
                difference = P_full - P_i[0]
                moments[i, side, 0] += difference
                moments[i, side, 1] += difference * difference
        if (k + 1) % stride == 0:
            pressure[:, :, (k + 1) // stride] = P[:, :, 0]
    return moments, failure, pressure
