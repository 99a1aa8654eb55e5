"""Pressures of both chambers by several sets of parameters at once, on signals given at every stage.

A fit makes these replays hundreds of times. Each set of parameters is a lane, as in
`pneumo.simulation.replay` and with the equations there, but has dead volumes of its own. Sensors have errors
of a hundred pascal or more, so a third-order method is enough: its error with steps of 1 ms is below 1 Pa. A
step in which a chamber meets the pressure of its open port, where the slope of eq (1) is infinite, is
implicit.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

import pneumo.core as core
from pneumo.configuration.experiment import Plant
from pneumo.simulation.polynomials import flow_polynomial
from pneumo.simulation.replay import ROW, WIDTH, LanesSideBySide

NODES = np.array([0, 1 / 2, 1])  # of the stages of Kutta's third-order method, over the step
STAGES = len(NODES)


class Inputs(NamedTuple):
    """Signals at every stage, as in `NODES`, and the plant on which sets of parameters are replayed."""

    u: np.ndarray  # limited command, V, shape (steps, 3)
    motion: np.ndarray  # position, m, and velocity, m/s, shape (steps, 3, 2)
    plant: Plant  # without leak and laminar flow, since a polynomial replaces eq (1)
    P_s: np.ndarray | None = None  # supply pressure, Pa, shape (steps, 3), in place of the plant's


def pressures_of_sets(
    inputs: Sequence[Inputs],
    inputs_of: np.ndarray,
    lanes: np.ndarray,
    V_d: np.ndarray,
    h: float,
    stride: int,
    start: np.ndarray,
    start_T: np.ndarray | None = None,
    T_in: np.ndarray | None = None,
    exhaust: np.ndarray | None = None,
) -> np.ndarray:
    """Pressures of both chambers by several sets of parameters, Pa, on signals given at every stage.

    The result has shape (set, chamber, stored steps); NaN after a pressure was not positive. Eight sets take
    little more time than one.

    Parameters
    ----------
    inputs, inputs_of : sequence of Inputs, numpy.ndarray
        Signals and plants, and the index of those of each set. The plants may differ in valve, b, piston
        areas, T_in and the pressures of supply and atmosphere.
    lanes : numpy.ndarray
        Coefficients of one model, a row for each set of parameters, from `pneumo.physics.models.lane_array`:
        shape (set, 10).
    V_d : numpy.ndarray
        Dead volumes, m^3, shape (set, chamber), in place of the plant's.
    h, stride : float, int
        Step, s, and steps between stored pressures.
    start, start_T : numpy.ndarray
        Initial pressures, Pa, and temperatures, K, shape (set, chamber). With temperatures the full-order
        chambers are replayed, without them reduced models.
    T_in, exhaust : numpy.ndarray, optional
        Temperature of the supply, K, and `Valve.exhaust`, each of shape (set,), in place of the plant's.
    """
    steps, full = len(inputs[0].u), start_T is not None
    core_inputs = [_core_inputs(one, steps) for one in inputs]
    result = np.empty((len(lanes), 2, steps // core.whole("stride", stride, 1) + 1))
    order = np.argsort(inputs_of, kind="stable")
    for first in range(0, len(order), ROW):
        sets = order[first : first + ROW]
        present, count = np.unique(inputs_of[sets], return_counts=True)
        ends = zip(present, np.cumsum(count), strict=True)
        of_sets = core.ffi.new("Inputs[]", [core_inputs[j] | {"end": end} for j, end in ends])
        rows = np.append(sets, np.full(-len(sets) % WIDTH, sets[-1]))
        plant = inputs[present[0]].plant
        c = plant.conditions
        W, X = LanesSideBySide.of(lanes[rows], plant), core.zeroed("Sets")
        given = [(X.inlet, T_in), (X.exhaust, exhaust)]
        for side in range(2):
            given += [(W.struct.now[side], start[:, side] / c.P_0), (X.beyond[side], V_d[:, side])]
            given += [] if start_T is None else [(X.T[side], start_T[:, side] / c.T_0)]
        for row, values in given:
            if values is not None:
                W.row(row)[: len(rows)] = values[rows]
        pressure = np.empty((result.shape[2], 2, len(rows)))
        pressure[0] = start[rows].T
        core.lib.replay_sets(of_sets, len(present), steps, W.struct, X, full, stride, h, core.out(pressure))
        result[sets] = pressure[..., : len(sets)].T
    return result


def _core_inputs(inputs: Inputs, steps: int) -> dict[str, Any]:
    """Fields of the C struct of inputs, but for `end`."""
    plant, shape = inputs.plant, (steps, STAGES)
    P_s = np.full(shape, plant.conditions.P_s) if inputs.P_s is None else inputs.P_s
    psi, _ = flow_polynomial(plant.gas)
    return {
        "u": core.array("u", inputs.u, shape),
        "P_s": core.array("P_s", P_s, shape),
        "motion": core.array("motion", inputs.motion, (*shape, 2)),
        "psi": core.array("psi", psi, (None,)),
        "terms": core.whole("terms", len(psi), 2, core.lib.MOST_TERMS),
        "plant": tuple(plant),
    }


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
