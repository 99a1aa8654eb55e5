"""Pressures of both chambers by several sets of parameters at once, on signals given at every stage.

A fit makes these replays hundreds of times. Each set of parameters is a lane, as in
`pneumo.simulation.replay` and with the equations there, but has dead volumes of its own. Sensors have errors
of a hundred pascal or more, so a third-order method is enough: its error with steps of 1 ms is below 1 Pa. A
step in which a chamber meets the pressure of its open port, where the slope of eq (1) is infinite, is
implicit.
"""

from typing import Any

import numpy as np

import pneumo.core as core
from pneumo.configuration.experiment import Plant
from pneumo.physics.cylinder import chamber_of
from pneumo.physics.models import Lane
from pneumo.simulation.replay import ROW, WIDTH, LanesSideBySide

NODES = np.array([0, 1 / 2, 1])  # of the stages of Kutta's third-order method, over the step
STAGES = len(NODES)


def pressures_of_sets(
    u: np.ndarray,
    motions: np.ndarray,
    lanes: np.ndarray,
    V_d: np.ndarray,
    plant: Plant,
    h: float,
    stride: int,
    start: np.ndarray,
    start_T: np.ndarray | None = None,
    P_s: np.ndarray | None = None,
    T_in: np.ndarray | None = None,
    exhaust: np.ndarray | None = None,
) -> np.ndarray:
    """Pressures of both chambers by several sets of parameters, Pa, on signals given at every stage.

    The result has shape (motion, set, chamber, stored steps); NaN after a pressure was not positive.

    Parameters
    ----------
    u : numpy.ndarray
        Limited command, V, at every stage, as in `NODES`: shape (steps, 3).
    motions : numpy.ndarray
        Position, m, and velocity, m/s, at every stage: shape (motion, steps, 3, 2). Every set of parameters
        is replayed on each.
    lanes : numpy.ndarray
        Coefficients of one model, a row for each set of parameters, from `pneumo.physics.models.lane_array`:
        shape (set, 10), at most `replay.ROW` sets.
    V_d : numpy.ndarray
        Dead volumes, m^3, shape (set, chamber), in place of the plant's.
    plant : Plant
        Its valve must have neither leak nor laminar flow, since a polynomial replaces eq (1).
    h, stride : float, int
        Step, s, and steps between stored pressures.
    start, start_T : numpy.ndarray
        Initial pressures, Pa, and temperatures, K, shape (set, chamber). With temperatures the full-order
        chambers are replayed, without them reduced models.
    P_s : numpy.ndarray, optional
        Supply pressure, Pa, at every stage, shape (steps, 3), in place of the plant's.
    T_in, exhaust : numpy.ndarray, optional
        Temperature of the supply, K, and `Valve.exhaust`, each of shape (set,), in place of the plant's.
    """
    steps = len(u)
    count = len(lanes)
    full = start_T is not None
    motions = np.ascontiguousarray(motions, dtype=float)
    T_in = np.full(count, plant.conditions.T_in) if T_in is None else T_in
    exhaust = np.full(count, plant.valve.exhaust) if exhaust is None else exhaust
    P_s = np.full((steps, STAGES), plant.conditions.P_s) if P_s is None else P_s
    signals = core.array("u", u, (steps, STAGES)), core.array("P_s", P_s, (steps, STAGES))
    core.array("motions", motions, (None, steps, STAGES, 2))
    core.whole("stride", stride, 1)
    result = np.empty((len(motions), count, 2, steps // stride + 1))
    at_once = max(1, ROW // core.whole("sets", count, 1, ROW))
    for first in range(0, len(motions), at_once):
        part = motions[first : first + at_once]
        rows = np.tile(np.arange(count), len(part))
        rows = np.append(rows, np.full(-len(rows) % WIDTH, count - 1))
        W, X = LanesSideBySide.of(lanes[rows], plant), core.zeroed("Sets")

        def fill(row: Any, values: np.ndarray, W: LanesSideBySide = W, padded: int = len(rows)) -> None:
            W.row(row)[:padded] = values

        fill(X.inlet, T_in[rows] / plant.conditions.T_0)
        fill(X.exhaust, exhaust[rows] / plant.valve.exhaust)
        # The flow's factor has the root of the plant's T_in as divisor.
        root = np.sqrt(T_in / plant.conditions.T_in)[rows]
        fill(getattr(W.struct, "in"), W.row(getattr(W.struct, "in"))[: len(rows)] * root)
        fill(W.struct.in_T, W.row(W.struct.in_T)[: len(rows)] / root)
        for side in range(2):
            fill(W.struct.now[side], start[rows, side] / plant.conditions.P_0)
            fill(X.beyond[side], V_d[rows, side] - chamber_of(plant.cylinder, side).V_d)
            if start_T is not None:
                fill(X.T[side], start_T[rows, side] / plant.conditions.T_0)
        pressure = np.empty((result.shape[3], 2, len(rows)))
        pressure[0] = start[rows].T
        core.lib.replay_sets(
            signals[0],
            core.array("motions", part, (None, steps, STAGES, 2)),
            len(part),
            steps,
            W.struct,
            X,
            count,
            full,
            float(lanes[0, Lane._fields.index("e_A")]),
            stride,
            core.struct("Plant", plant),
            h,
            W.psi,
            W.terms,
            signals[1],
            core.out(pressure),
        )
        by_motion = pressure[..., : len(part) * count].reshape(-1, 2, len(part), count)
        result[first : first + len(part)] = by_motion.transpose(2, 3, 1, 0)
    return result


def pressures_on_flows(
    motion: np.ndarray,
    flow: np.ndarray,
    lanes: np.ndarray,
    V_d: np.ndarray,
    plant: Plant,
    h: float,
    stride: int,
    start: np.ndarray,
) -> np.ndarray:
    """Pressures of reduced models, Pa, from given mass flows instead of a valve and its command.

    `flow`, shape (steps, 3, 2), is the mass flow into chambers A and B, kg/s, at every stage; it is negative
    out of a chamber. `motion`, shape (steps, 3, 2), is one motion; the other parameters are those of
    `pressures_of_sets`, with any number of sets. The result has shape (set, chamber, stored steps).
    """
    steps, count = len(flow), len(lanes)
    core.whole("stride", stride, 1)
    pressure = np.empty((count, 2, steps // stride + 1))
    pressure[:, :, 0] = start
    core.lib.replay_flows(
        core.array("motion", motion, (steps, STAGES, 2)),
        core.array("flow", flow, (steps, STAGES, 2)),
        steps,
        core.rows("lanes", lanes, "Lane"),
        count,
        core.array("V_d", V_d, (count, 2)),
        stride,
        core.struct("Plant", plant),
        h,
        core.out(pressure),
    )
    return pressure
