"""Replays of the reduced models on recorded full-order runs, Fig. 6.

This is the readable reference: one lane (a model at one n) and one chamber at a time.
"""

from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable

from pneumo.configuration.experiment import Drive, Plant
from pneumo.physics.cylinder import heat_area, volume
from pneumo.physics.models import Lane, model_dP_dt, temperature
from pneumo.physics.valve import chamber_flows, limited
from pneumo.simulation.compiled import kernel
from pneumo.simulation.excitation import command
from pneumo.simulation.full_order import STAGES, A, B, C, Recording, stages

PUBLISHED, EXACT = "published", "exact"
OK, LEFT_RANGE, NO_RUN = 0, 1, 2
STATUS = {OK: "ok", LEFT_RANGE: "pressure left the positive numbers", NO_RUN: "no full-order run"}


class Replayed(NamedTuple):
    """What the replays of one experiment give; every array starts with (lane, chamber).

    Attributes
    ----------
    mean_error, mse : numpy.ndarray
        Mean, Pa, and mean square, Pa^2, of full-order minus reduced pressure over every step.
    variance : numpy.ndarray
        Population variance of the same error, Pa^2.
    status : numpy.ndarray
        Key of `STATUS`; anything but 0 makes the statistics NaN.
    failure_step : numpy.ndarray
        Step at which a lane failed, or -1.
    pressure : numpy.ndarray
        Reduced pressure, Pa, shape (lane, chamber, stored steps).
    """

    mean_error: np.ndarray
    variance: np.ndarray
    mse: np.ndarray
    status: np.ndarray
    failure_step: np.ndarray
    pressure: np.ndarray


@register_jitable
def lane_rate(u, x, v, P, area, plant, lane):
    """Rate of a reduced model's pressure, Pa/s, with u, x, v counted outward from the chamber."""
    T = temperature(P, plant.conditions.P_0, plant.conditions.T_0, lane.a)
    m_in, m_out = chamber_flows(u, P, T, plant.valve, plant.gas, plant.conditions)
    return rate_with_flows(m_in, m_out, x, v, P, T, area, plant, lane)


@register_jitable
def rate_with_flows(m_in, m_out, x, v, P, T, area, plant, lane):
    """Rate of a reduced model's pressure, Pa/s, with known flows, kg/s; x and v count outward."""
    conditions, gas = plant.conditions, plant.gas
    return model_dP_dt(
        P,
        T,
        volume(x, area, plant.cylinder),
        area * v,
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


@register_jitable
def interpolated(series, position):
    """Linear interpolation between samples; `position` counts steps and is held at both ends."""
    if position <= 0:
        return series[0]
    k = min(int(position), len(series) - 2)
    return series[k] + (position - k) * (series[k + 1] - series[k])


@register_jitable
def published_inputs(recording, k, lag_steps, u_max, inputs):
    """Write (u, x, v) at the six stages of step k as the paper's replays read them.

    The samples of 1 ms are interpolated linearly and the limiter acts on the interpolated command.
    `lag_steps` says by how many steps each stage reads each signal late, shape (6, 3).
    """
    for i in range(STAGES):
        at = k + C[i]
        inputs[i, 0] = limited(interpolated(recording.u, at - lag_steps[i, 0]), u_max)
        inputs[i, 1] = interpolated(recording.states[:, 0], at - lag_steps[i, 1])
        inputs[i, 2] = interpolated(recording.states[:, 1], at - lag_steps[i, 2])


@register_jitable
def exact_inputs(recording, k, drive, plant, h, Y, K, inputs):
    """Write (u, x, v) at the six stages of step k as the full-order run saw them.

    A stored state determines the stages of its step, so they are computed again, never stored.
    """
    stages(recording.states[k], recording.reference[k], 0.0, drive, plant, h, Y, K)
    for i in range(STAGES):
        u = command(recording.reference[k], Y[i, 0], drive)
        inputs[i, 0] = limited(u, plant.valve.u_max)
        inputs[i, 1] = Y[i, 0]
        inputs[i, 2] = Y[i, 1]


@register_jitable
def lane_step(P, inputs, sign, area, plant, lane, h, rate):
    """Advance one lane by one Dormand-Prince step and return its new pressure."""
    for i in range(STAGES):
        total = 0.0
        for j in range(i):
            total += A[i, j] * rate[j]
        u, x, v = sign * inputs[i, 0], sign * inputs[i, 1], sign * inputs[i, 2]
        rate[i] = lane_rate(u, x, v, P + h * total, area, plant, lane)
    total = 0.0
    for i in range(STAGES):
        total += B[i] * rate[i]
    return P + h * total


@kernel
def _replay(recording, lanes, exact, lag_steps, stride, drive, plant, h):
    steps = len(recording.states) - 1
    count = len(lanes)
    pressure = np.empty((count, 2, steps // stride + 1))
    moments = np.zeros((count, 2, 2))  # running sums of e and e^2
    failure = np.full((count, 2), -1)
    P = np.full((count, 2), plant.conditions.P_0)
    pressure[:, :, 0] = plant.conditions.P_0
    inputs = np.empty((STAGES, 3))
    Y, K, rate = np.empty((STAGES, 6)), np.empty((STAGES, 6)), np.empty(STAGES)
    for k in range(steps):
        if exact:
            exact_inputs(recording, k, drive, plant, h, Y, K, inputs)
        else:
            published_inputs(recording, k, lag_steps, plant.valve.u_max, inputs)
        for side in range(2):
            sign = 1.0 - 2.0 * side
            area = plant.cylinder.A_A if side == 0 else plant.cylinder.A_B
            P_full = recording.states[k + 1, 2 + 2 * side]
            for i in range(count):
                if failure[i, side] >= 0:
                    continue
                row = lanes[i]
                lane = Lane(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7])
                P_new = lane_step(P[i, side], inputs, sign, area, plant, lane, h, rate)
                if not P_new > 0:
                    failure[i, side] = k + 1
                    P_new = np.nan
                P[i, side] = P_new
                error = P_full - P_new
                moments[i, side, 0] += error
                moments[i, side, 1] += error * error
        if (k + 1) % stride == 0:
            pressure[:, :, (k + 1) // stride] = P
    return moments, failure, pressure


def steps_late(lag: float | np.ndarray, h: float) -> np.ndarray:
    """Delays of `replay` in steps, one for each stage and signal, shape (6, 3)."""
    return np.array(np.broadcast_to(np.asarray(lag) / h, (STAGES, 3)))


def replay(
    recording: Recording,
    lanes: np.ndarray,
    drive: Drive,
    plant: Plant,
    h: float,
    *,
    transport: str,
    lag: float | np.ndarray = 0.0,
    stride: int = 1,
) -> Replayed:
    """Replay every lane in both chambers on one recording.

    Parameters
    ----------
    recording : Recording
    lanes : numpy.ndarray
        From `pneumo.physics.models.lane_array`, shape (lane, 8).
    drive, plant : Drive, Plant
        Those of the recorded run.
    h : float
        Step, s.
    transport : {"published", "exact"}
        How recorded signals reach the replayed model.
    lag : float or numpy.ndarray
        Delay of the recorded signals, s; `published` only. An array, shape (6, 3), has one for each
        stage of the integrator and each of u, x and v.
    stride : int
        Steps between stored pressures.

    Raises
    ------
    ValueError
        If `transport` is neither of the two, or a lag is asked of `exact`.
    """
    if transport not in (PUBLISHED, EXACT):
        raise ValueError(f"transport = {transport!r}: must be 'published' or 'exact'")
    if transport == EXACT and np.any(lag):
        raise ValueError(f"lag = {np.max(lag):g} s: the exact transport has none")
    moments, failure, pressure = _replay(
        recording, lanes, transport == EXACT, steps_late(lag, h), stride, drive, plant, h
    )
    samples = len(recording.states)  # the error at t = 0 is zero by construction and counts
    mean_error, mse = moments[..., 0] / samples, moments[..., 1] / samples
    status = np.where(failure >= 0, LEFT_RANGE, OK).astype(np.int8)
    return Replayed(mean_error, mse - mean_error**2, mse, status, failure, pressure)


def no_replay(recording: Recording, lanes: np.ndarray, step: int, stride: int = 1) -> Replayed:
    """What replays of every lane give on a run that failed at a step: `NO_RUN` everywhere."""
    shape, nothing = (len(lanes), 2), np.full((len(lanes), 2), np.nan)
    pressure = np.full((*shape, (len(recording.states) - 1) // stride + 1), np.nan)
    status, failed = np.full(shape, NO_RUN, dtype=np.int8), np.full(shape, step)
    return Replayed(nothing, nothing, nothing, status, failed, pressure)
