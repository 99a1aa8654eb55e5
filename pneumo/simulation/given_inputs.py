# pyright: basic
"""Pressures of reduced models on inputs given at every Runge-Kutta stage; joint rates for other solvers."""

from math import log

import numpy as np

from pneumo.configuration.experiment import Drive, Plant
from pneumo.physics.cylinder import Side, chamber_of
from pneumo.physics.valve import limited
from pneumo.simulation.compiled import kernel
from pneumo.simulation.excitation import command
from pneumo.simulation.full_order import full_order_rates
from pneumo.simulation.polynomials import flow_polynomial
from pneumo.simulation.reference import lane_of, lane_rate
from pneumo.simulation.vectorised import GROUP, P_A, P_B, ROW, WIDTH, advance, needs, work_array


@kernel(fastmath={"contract"})
def _on_inputs(
    inputs: np.ndarray,
    W: np.ndarray,
    starts: tuple[np.uint64, ...],
    stride: int,
    plant: Plant,
    h: float,
    psi: tuple[float, ...],
    pressure: np.ndarray,
) -> None:
    P_0, s_sonic, count = plant.conditions.P_0, -log(plant.gas.critical_ratio), GROUP * starts[3]
    for k in range(len(inputs)):
        advance(W, inputs[k], starts, plant, h, psi, s_sonic)
        if (k + 1) % stride == 0:
            for side in range(2):
                now = P_A if side == 0 else P_B
                for i in range(count):
                    pressure[(k + 1) // stride, side, i] = P_0 * W[now + i]


def pressures_on_inputs(
    inputs: np.ndarray,
    lanes: np.ndarray,
    plant: Plant,
    h: float,
    stride: int,
    start: np.ndarray | None = None,
) -> np.ndarray:
    """Pressures of reduced models, Pa, on inputs given at every Runge-Kutta stage.

    The result has shape (lane, chamber, stored steps), where a lane is one model at one n; it is NaN after a
    pressure was not positive.

    Parameters
    ----------
    inputs : numpy.ndarray
        Limited command, V, position, m, and velocity, m/s, at every stage: shape (steps, 6, 3).
    lanes : numpy.ndarray
        Coefficients from `pneumo.physics.models.lane_array`, shape (lane, 9), at most `vectorised.ROW` lanes.
    plant : Plant
        Its valve must have neither leak nor laminar flow, since a polynomial replaces eq (1).
    h, stride : float, int
        Step, s, and steps between stored pressures.
    start : numpy.ndarray, optional
        First pressures, Pa, shape (lane, chamber); the plant's P_0 by default.
    """
    laminar, leak = plant.valve.laminar, plant.valve.leak
    if len(lanes) > ROW or laminar or leak:
        raise ValueError(
            f"{len(lanes)} lanes, laminar = {laminar:g}, leak = {leak:g}:"
            f" at most {ROW} lanes, both others must be 0"
        )
    order = np.argsort(needs(lanes), kind="stable")
    W, starts = work_array(lanes[order], plant)
    pressure = np.full((len(inputs) // stride + 1, 2, WIDTH * int(starts[3])), plant.conditions.P_0)
    if start is not None:
        pressure[0, :, : len(lanes)] = start[order].T
        for row, first in zip((P_A, P_B), pressure[0, :, : len(lanes)], strict=True):
            W[int(row) : int(row) + len(lanes)] = first / plant.conditions.P_0
    psi, _ = flow_polynomial(plant.gas)
    _on_inputs(inputs, W, starts, stride, plant, h, psi, pressure)
    result = np.empty((len(lanes), 2, len(pressure)))
    result[order] = pressure[:, :, : len(lanes)].transpose(2, 1, 0)
    return result


@kernel
def joint_rates(y: np.ndarray, reference: float, lanes: np.ndarray, drive: Drive, plant: Plant) -> np.ndarray:
    """Rates of the six full-order states and of both pressures of several reduced models, in one vector.

    y holds (x, v, P_A, T_A, P_B, T_B), then P_A and P_B of each row of `lanes` (coefficients from
    `pneumo.physics.models.lane_array`): shape (6 + 2 lanes,). `reference` is its present value, m in closed
    loop or V in open loop.
    """
    dy = np.empty_like(y)
    full_order_rates(y, 0, (reference, 0.0, drive, plant), dy)
    x, v = y[0], y[1]
    A, B = chamber_of(plant.cylinder, Side.A), chamber_of(plant.cylinder, Side.B)
    u = limited(command(reference, x, drive), plant.valve.u_max)
    for i in range(len(lanes)):
        lane = lane_of(lanes[i])
        dy[6 + 2 * i] = lane_rate(u, x, v, y[6 + 2 * i], A, plant, lane)
        dy[7 + 2 * i] = lane_rate(-u, -x, -v, y[7 + 2 * i], B, plant, lane)
    return dy
