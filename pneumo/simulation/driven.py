"""Reduced models on inputs given as data, and together with the full-order system as one set of equations.

What the study of numerical errors needs beyond the two transports: any other transport is an array of the
inputs at every Runge-Kutta stage, and an adaptive solver sees full-order and reduced models as one system.
"""

from math import log

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.physics.models import Lane, temperature
from pneumo.physics.valve import limited
from pneumo.simulation.compiled import kernel
from pneumo.simulation.excitation import command
from pneumo.simulation.full_order import STAGES, A, B, rates
from pneumo.simulation.reference import lane_rate, rate_with_flows
from pneumo.simulation.vectorised import P_A, P_B, ROW, advance, flow_polynomial, needs, work_array


@kernel(fastmath={"contract"})
def _driven(inputs, W, starts, stride, plant, h, psi, pressure):
    P_0, s_sonic, count = plant.conditions.P_0, -log(plant.gas.critical_ratio), starts[3]
    for k in range(len(inputs)):
        advance(W, inputs[k], starts, plant, h, psi, s_sonic)
        if (k + 1) % stride == 0:
            for side in range(2):
                now = P_A if side == 0 else P_B
                for i in range(count):
                    pressure[(k + 1) // stride, side, i] = P_0 * W[now + i]


def driven(
    inputs: np.ndarray,
    lanes: np.ndarray,
    plant: Plant,
    h: float,
    stride: int,
    start: np.ndarray | None = None,
) -> np.ndarray:
    """Run reduced models on given inputs.

    Parameters
    ----------
    inputs : numpy.ndarray
        Limited command, V, position, m, and velocity, m/s, at every stage: shape (steps, 6, 3).
    lanes : numpy.ndarray
        From `pneumo.physics.models.lane_array`, shape (lane, 8), at most `lanes.ROW` of them.
    plant : Plant
        Without leak or laminar share: its flow is a polynomial here.
    h : float
        Step, s.
    stride : int
        Steps between stored pressures.
    start : numpy.ndarray, optional
        Pressure of every lane at first, Pa, shape (lane, chamber); P_0 where left out.

    Returns
    -------
    numpy.ndarray
        Pressure, Pa, shape (lane, chamber, stored steps); NaN from where a lane left the positive numbers.
    """
    laminar, leak = plant.valve.laminar, plant.valve.leak
    if len(lanes) > ROW or laminar or leak:
        raise ValueError(
            f"{len(lanes)} lanes, laminar = {laminar:g}, leak = {leak:g}: at most {ROW} lanes, 0, 0"
        )
    order = np.argsort(needs(lanes), kind="stable")
    W, starts = work_array(lanes[order], plant)
    pressure = np.full((len(inputs) // stride + 1, 2, int(starts[3])), plant.conditions.P_0)
    if start is not None:
        pressure[0, :, : len(lanes)] = start[order].T
        for row, first in zip((P_A, P_B), pressure[0, :, : len(lanes)], strict=True):
            W[int(row) : int(row) + len(lanes)] = first / plant.conditions.P_0
    psi, _ = flow_polynomial(plant.gas)
    _driven(inputs, W, starts, stride, plant, h, psi, pressure)
    result = np.empty((len(lanes), 2, len(pressure)))
    result[order] = pressure[:, :, : len(lanes)].transpose(2, 1, 0)
    return result


@kernel
def _driven_by_flow(inputs, flow, lanes, plant, h, stride, pressure):
    P_0, T_0 = plant.conditions.P_0, plant.conditions.T_0
    rate = np.empty(STAGES)
    for index in range(len(lanes)):
        row = lanes[index]
        lane = Lane(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7])
        for side in range(2):
            sign = 1.0 - 2.0 * side
            area = plant.cylinder.A_A if side == 0 else plant.cylinder.A_B
            P = pressure[index, side, 0]
            for k in range(len(inputs)):
                for i in range(STAGES):
                    P_i = P
                    for j in range(i):
                        P_i += h * A[i, j] * rate[j]
                    x, v, m = sign * inputs[k, i, 1], sign * inputs[k, i, 2], flow[k, i, side]
                    T = temperature(P_i, P_0, T_0, lane.a)
                    rate[i] = rate_with_flows(max(m, 0.0), max(-m, 0.0), x, v, P_i, T, area, plant, lane)
                for i in range(STAGES):
                    P += h * B[i] * rate[i]
                if not P > 0:
                    P = np.nan
                done = k + 1
                if done % stride == 0:
                    pressure[index, side, done // stride] = P


def driven_by_flow(
    inputs: np.ndarray,
    flow: np.ndarray,
    lanes: np.ndarray,
    plant: Plant,
    h: float,
    stride: int,
    start: np.ndarray,
) -> np.ndarray:
    """Run reduced models on given mass flows in place of a valve.

    Parameters
    ----------
    inputs : numpy.ndarray
        As `driven` takes them; the command plays no role.
    flow : numpy.ndarray
        Mass flows into chambers A and B, negative out of them, kg/s, at every stage: shape (steps, 6, 2).
    lanes, plant, h, stride, start
        As for `driven`; any number of lanes.

    Returns
    -------
    numpy.ndarray
        Pressure, Pa, shape (lane, chamber, stored steps); NaN from where a lane left the positive numbers.
    """
    pressure = np.empty((len(lanes), 2, len(inputs) // stride + 1))
    pressure[:, :, 0] = start
    _driven_by_flow(inputs, flow, lanes, plant, h, stride, pressure)
    return pressure


@kernel
def joint_rates(y, reference, lanes, drive, plant):
    """Rates of the six full-order states and of every lane's two pressures, all in one vector.

    Parameters
    ----------
    y : numpy.ndarray
        (x, v, P_A, T_A, P_B, T_B), then P_A and P_B of each lane: shape (6 + 2 lanes,).
    reference : float
        Reference in force: m in closed loop, V in open loop.
    lanes : numpy.ndarray
        Shape (lane, 8).
    drive : Drive
    plant : Plant
    """
    dy = np.empty_like(y)
    rates(y, reference, 0.0, drive, plant, dy)
    x, v = y[0], y[1]
    u = limited(command(reference, x, drive), plant.valve.u_max)
    for i in range(len(lanes)):
        row = lanes[i]
        lane = Lane(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7])
        dy[6 + 2 * i] = lane_rate(u, x, v, y[6 + 2 * i], plant.cylinder.A_A, plant, lane)
        dy[7 + 2 * i] = lane_rate(-u, -x, -v, y[7 + 2 * i], plant.cylinder.A_B, plant, lane)
    return dy
