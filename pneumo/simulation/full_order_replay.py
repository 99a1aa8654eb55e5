# pyright: basic
"""Replay of the full-order chambers with parameters that differ from the run's: the full order as a model.

A row is one set of parameters of the full order; it corresponds to a lane, one reduced model at one n.
"""

from typing import Any, NamedTuple

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.configuration.sampling import Sampling
from pneumo.physics.chamber import dP_dt, dT_dt, wall_conductance, wall_heat
from pneumo.physics.cylinder import Chamber, chamber_of, heat_area, sign_of, volume
from pneumo.physics.models import WALL_LAWS
from pneumo.physics.valve import chamber_flows
from pneumo.simulation.compiled import inlined, kernel
from pneumo.simulation.full_order import RAN, Recording, failure
from pneumo.simulation.runge_kutta import STAGES, dormand_prince, embedded_error
from pneumo.simulation.signals import replay_in_blocks, replay_tolerance


class FullRow(NamedTuple):
    """A full-order model of the chambers, by the parameters in which it differs from the plant."""

    wall_scale: float = 1.0  #: its k_0 over the plant's; 0: adiabatic
    flow_scale: float = 1.0  #: its mass flows over those of the plant's valve
    e_A: float = WALL_LAWS["lambda A_q"][1]  #: exponent of A_q / A_q0 in the wall law; 0: constant
    e_PT: float = WALL_LAWS["lambda A_q"][2]  #: exponent of PT / (P_0 T_0) in the wall law; 0: constant


@inlined
def full_row_rates(
    u: float, x: float, v: float, P: float, T: float, chamber: Chamber, plant: Plant, row: FullRow
) -> tuple[float, float]:
    """Full-order rates of one chamber with a row's parameters: dP/dt, Pa/s, and dT/dt, K/s.

    Signs of the limited command u, V, x, m, and v, m/s, are those of chamber A; for B negate all three.
    """
    gas, conditions = plant.gas, plant.conditions
    V, g = volume(x, chamber, plant.cylinder), gas.gamma
    m_in, m_out = chamber_flows(u, P, T, plant.valve, gas, conditions)
    m_in, m_out, dV_dt = row.flow_scale * m_in, row.flow_scale * m_out, chamber.area * v
    area_ratio = heat_area(x, plant.cylinder) / heat_area(0.0, plant.cylinder)
    PT_ratio = P * T / (conditions.P_0 * conditions.T_0)
    k = row.wall_scale * wall_conductance(plant.k_0, area_ratio, PT_ratio, row.e_A, row.e_PT)
    heat = wall_heat(T, k, conditions.T_amb)
    return (
        dP_dt(P, T, V, dV_dt, m_in, m_out, conditions.T_in, heat, g, g, g, gas.R, g),
        dT_dt(P, T, V, dV_dt, m_in, m_out, conditions.T_in, heat, gas.R, g),
    )


@inlined
def _rates(y: np.ndarray, i: int, context: Any, dy: np.ndarray) -> None:
    inputs, sign, chamber, plant, row = context
    u, x, v = sign * inputs[i, 0], sign * inputs[i, 1], sign * inputs[i, 2]
    dy[0], dy[1] = full_row_rates(u, x, v, y[0], y[1], chamber, plant, row)


_step, _estimate = dormand_prince(_rates), embedded_error(_rates)


@inlined
def _row_step(
    y: np.ndarray, context: Any, h: float, estimated: bool, Y: np.ndarray, K: np.ndarray, error: np.ndarray
) -> float:
    """Advance y = (P, T) of one chamber in place by h s.

    Returns the larger estimated error, of P over P_0 or of T over T_0; infinite where the step failed, 0
    unless `estimated`.
    """
    _step(y, context, h, Y, K, y)
    if not (y[0] > 0 and y[1] > 0):
        return np.inf
    if not estimated:
        return 0.0
    conditions = context[3].conditions
    _estimate(y, context, h, K, error)
    largest = max(abs(error[0]) / conditions.P_0, abs(error[1]) / conditions.T_0)
    return largest if largest < np.inf else np.inf


@kernel
def _replay_rows(
    first: int,
    inputs: np.ndarray,
    halvings: np.ndarray,
    again: bool,
    states: np.ndarray,
    plant: Plant,
    h: float,
    most: int,
    tolerance: float,
    rows: np.ndarray,
    before: np.ndarray,
    after: np.ndarray,
    coarse: np.ndarray,
    squares: np.ndarray,
) -> int:
    """Replay consecutive steps of all rows, and add their squared errors, Pa^2, to `squares`, (row, chamber).

    This is `advance` of `pneumo.simulation.signals.replay_in_blocks`, and returns the number of steps done.
    States (P, T) `before` and `after` a step have shape (row, chamber, 2); `coarse`, shape (row, chamber),
    says for which of them the step has to be halved.
    """
    Y, K, error = np.empty((STAGES, 2)), np.empty((STAGES + 1, 2)), np.empty(2)
    place = 0
    for j in range(len(halvings)):
        parts, some_coarse = 1 << halvings[j], False
        for side in range(2):
            sign, chamber = sign_of(side), chamber_of(plant.cylinder, side)
            for i in range(len(rows)):
                row, start, now = (
                    FullRow(rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3]),
                    before[i, side],
                    after[i, side],
                )
                if not again:
                    start[0], start[1] = now[0], now[1]
                    coarse[i, side] = start[0] > 0
                if not coarse[i, side]:
                    continue
                largest, now[0], now[1] = 0.0, start[0], start[1]
                for part in range(place, place + parts):
                    context = (inputs[part], sign, chamber, plant, row)
                    largest = max(largest, _row_step(now, context, h / parts, most > 0, Y, K, error))
                coarse[i, side] = not largest <= tolerance
                some_coarse = some_coarse or coarse[i, side]
        if some_coarse and halvings[j] < most:
            return j
        place += parts
        for side in range(2):
            for i in range(len(rows)):
                now = after[i, side]
                if not (now[0] > 0 and now[1] > 0):
                    now[0] = now[1] = np.nan
                difference = states[first + j + 1, 2 + 2 * side] - now[0]
                squares[i, side] += difference * difference
                if not difference * difference < np.inf:
                    squares[i, side] = np.nan
    return len(halvings)


def full_order_mse(recording: Recording, rows: list[FullRow], sampling: Sampling) -> np.ndarray:
    """Mean square pressure error of full-order models with other parameters, Pa^2, shape (row, chamber).

    Each row is replayed from the run's first state on the run's signals and compared with the run's
    pressures. A step whose estimated error is too large is halved, as in `pneumo.simulation.replay.replay`.
    NaN where a replay or the run itself failed.
    """
    if failure(recording.states)[0] != RAN:
        return np.full((len(rows), 2), np.nan)
    states, plant, h, most = recording.states, recording.plant, recording.h, recording.most_halvings
    after, squares = np.tile(states[0, 2:].reshape(2, 2), (len(rows), 1, 1)), np.zeros((len(rows), 2))
    work = np.array(rows, dtype=float), np.empty_like(after), after, np.empty((len(rows), 2), bool), squares
    common = states, plant, h, most, replay_tolerance(sampling), *work
    replay_in_blocks(recording, sampling, lambda *steps: _replay_rows(*steps, *common))
    return squares / len(states)
