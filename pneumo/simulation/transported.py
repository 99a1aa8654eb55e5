"""What sampling does to a replay: replays on sampled signals, and the error they will have, from one run.

The chamber's own full-order equations are replayed, so that nothing but the transport of u, x and v errs.
"""

import numpy as np
from numba.extending import register_jitable

from pneumo.configuration.experiment import Drive, Plant
from pneumo.physics.models import Lane
from pneumo.physics.valve import limited
from pneumo.simulation.compiled import kernel
from pneumo.simulation.excitation import command
from pneumo.simulation.full_order import STAGES, A, B, C, Recording, chamber_rates
from pneumo.simulation.reference import exact_inputs, interpolated, lane_step

EXACTLY, LINEAR, HOLD, DELAY = 0, 1, 2, 3  # how signals get to a replay
SMALL_P, SMALL_T = 1.0, 1e-3  # Pa and K; steps of the differences that linearise the equations


@register_jitable
def sampled_inputs(samples, every, kind, k, u_max, inputs):
    """Write (u, x, v) at the six stages of step k, from samples `every` steps apart, limiter last."""
    for i in range(STAGES):
        if kind == LINEAR:
            at = (k + C[i]) / every
            for j in range(3):
                inputs[i, j] = interpolated(samples[:, j], at)
        else:
            at = k // every - (kind == DELAY)
            for j in range(3):
                inputs[i, j] = samples[max(at, 0), j]
        inputs[i, 0] = limited(inputs[i, 0], u_max)


@kernel
def _transported(recording, samples, every, kind, lanes, stride, drive, plant, h):
    steps, count = len(recording.states) - 1, len(lanes)
    pressure = np.empty((1 + count, 2, steps // stride + 1))
    inputs, Y, K = np.empty((STAGES, 3)), np.empty((STAGES, 6)), np.empty((STAGES, 6))
    rate, dP, dT = np.empty(STAGES), np.empty(STAGES), np.empty(STAGES)
    P, T, P_lane = np.empty(2), np.empty(2), np.full((count, 2), plant.conditions.P_0)
    for side in range(2):
        P[side], T[side] = recording.states[0, 2 + 2 * side], recording.states[0, 3 + 2 * side]
        pressure[0, side, 0] = P[side]
    pressure[1:, :, 0] = P_lane
    for k in range(steps):
        if kind == EXACTLY:
            exact_inputs(recording, k, drive, plant, h, Y, K, inputs)
        else:
            sampled_inputs(samples, every, kind, k, plant.valve.u_max, inputs)
        for side in range(2):
            sign = 1.0 - 2.0 * side
            area = plant.cylinder.A_A if side == 0 else plant.cylinder.A_B
            for i in range(STAGES):
                P_stage, T_stage = P[side], T[side]
                for j in range(i):
                    P_stage += h * A[i, j] * dP[j]
                    T_stage += h * A[i, j] * dT[j]
                u, x, v = sign * inputs[i, 0], sign * inputs[i, 1], sign * inputs[i, 2]
                dP[i], dT[i] = chamber_rates(u, x, v, P_stage, T_stage, area, plant)
            for i in range(STAGES):
                P[side] += h * B[i] * dP[i]
                T[side] += h * B[i] * dT[i]
            for i in range(count):
                row = lanes[i]
                lane = Lane(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7])
                P_lane[i, side] = lane_step(P_lane[i, side], inputs, sign, area, plant, lane, h, rate)
        if (k + 1) % stride == 0:
            pressure[0, :, (k + 1) // stride] = P
            pressure[1:, :, (k + 1) // stride] = P_lane
    return pressure


def transported(
    recording: Recording,
    every: int,
    kind: int,
    drive: Drive,
    plant: Plant,
    h: float,
    lanes: np.ndarray,
    stride: int = 1,
) -> np.ndarray:
    """Replay both chambers on signals of a run that were sampled.

    Parameters
    ----------
    recording : Recording
    every : int
        Steps between samples.
    kind : {LINEAR, HOLD, DELAY, EXACTLY}
        Straight lines between samples, the last sample, the one before it, or no sampling.
    drive, plant : Drive, Plant
        Those of the recorded run.
    h : float
        Step, s.
    lanes : numpy.ndarray
        Reduced models that are replayed too, shape (lane, 8).
    stride : int
        Steps between stored pressures.

    Returns
    -------
    numpy.ndarray
        Pressure, Pa, shape (1 + lanes, chamber, stored steps); first that of the full-order equations.
    """
    signals = np.column_stack([recording.u, recording.states[:, :2]])[::every]
    return _transported(recording, np.ascontiguousarray(signals), every, kind, lanes, stride, drive, plant, h)


@register_jitable
def opened(u, u_max):
    """Integral from 0 to u of the limited command's positive part, V^2."""
    if u <= 0:
        return 0.0
    return u * u / 2 if u < u_max else u_max * u - u_max * u_max / 2


@register_jitable
def mean_of_ramp(u, w, u_max):
    """Means of the positive and the negative part of a limited command that runs evenly from u to w, V."""
    positive = (opened(w, u_max) - opened(u, u_max)) / (w - u)
    negative = (opened(-u, u_max) - opened(-w, u_max)) / (w - u)
    return positive, negative


@register_jitable
def lateness(kind, f):
    """How late a jump at fraction 0 < f <= 1 between samples comes, in times between them; EXACTLY: one."""
    return 1.0 - f if kind == HOLD else 2.0 - f if kind == DELAY else 1.0


@register_jitable
def jump_rates(u, w, kind, f, x, v, P, T, area, plant):
    """Error (dP, dT) that a jump from u to w leaves, per second of the interval between samples.

    Rates are linear in the area of either restriction, so one of each says all.
    """
    u_max = plant.valve.u_max
    P_shut, T_shut = chamber_rates(0.0, x, v, P, T, area, plant)
    P_fill, T_fill = chamber_rates(1.0, x, v, P, T, area, plant)
    P_vent, T_vent = chamber_rates(-1.0, x, v, P, T, area, plant)
    before, after = limited(u, u_max), limited(w, u_max)
    if kind == LINEAR:
        fill, vent = mean_of_ramp(u, w, u_max)
        fill = f * max(before, 0.0) + (1 - f) * max(after, 0.0) - fill
        vent = f * max(-before, 0.0) + (1 - f) * max(-after, 0.0) - vent
    else:
        late = lateness(kind, f)
        fill = late * (max(after, 0.0) - max(before, 0.0))
        vent = late * (max(-after, 0.0) - max(-before, 0.0))
    return (
        fill * (P_fill - P_shut) + vent * (P_vent - P_shut),
        fill * (T_fill - T_shut) + vent * (T_vent - T_shut),
    )


@register_jitable
def relaxed(e_P, e_T, u, x, v, P, T, area, plant, h):
    """Errors of pressure and temperature one step later, by the linearised equations (implicit Euler)."""
    P_1, T_1 = chamber_rates(u, x, v, P + SMALL_P, T, area, plant)
    P_2, T_2 = chamber_rates(u, x, v, P - SMALL_P, T, area, plant)
    P_3, T_3 = chamber_rates(u, x, v, P, T + SMALL_T, area, plant)
    P_4, T_4 = chamber_rates(u, x, v, P, T - SMALL_T, area, plant)
    a, b = 1 - h * (P_1 - P_2) / (2 * SMALL_P), -h * (P_3 - P_4) / (2 * SMALL_T)
    c, d = -h * (T_1 - T_2) / (2 * SMALL_P), 1 - h * (T_3 - T_4) / (2 * SMALL_T)
    return (d * e_P - b * e_T) / (a * d - b * c), (a * e_T - c * e_P) / (a * d - b * c)


@kernel
def jump_errors(recording, every, kind, drive, plant, h, stride):
    """Pressure error that jumps of the command leave, per second between samples: linear theory, no replay.

    Parameters
    ----------
    recording : Recording
    every : int
        Steps between samples; says where between them a jump falls.
    kind : {LINEAR, HOLD, DELAY, EXACTLY}
        How the replay would read samples. EXACTLY: every jump, the start from rest too, comes a second late.
    drive : Drive
    plant : Plant
    h : float
        Step, s.
    stride : int
        Steps between stored errors.

    Returns
    -------
    numpy.ndarray
        Pa/s, shape (chamber, stored steps).
    """
    states, reference = recording.states, recording.reference
    steps = len(states) - 1
    result = np.zeros((2, steps // stride + 1))
    e_P, e_T = np.zeros(2), np.zeros(2)
    now = command(reference[0], states[0, 0], drive)
    if kind == EXACTLY:
        x, v, P_A, T_A, P_B, T_B = states[0]
        u = limited(now, plant.valve.u_max)
        e_P[0], e_T[0] = chamber_rates(u, x, v, P_A, T_A, plant.cylinder.A_A, plant)
        e_P[1], e_T[1] = chamber_rates(-u, -x, -v, P_B, T_B, plant.cylinder.A_B, plant)
        result[:, 0] = e_P
    for k in range(1, steps + 1):
        x, v = states[k, 0], states[k, 1]
        # In closed loop the command also moves between jumps, with x; then only the reference makes one.
        before = command(reference[k - 1], x, drive) if drive.closed_loop else now
        u = limited(before, plant.valve.u_max)
        now = command(reference[k], x, drive)
        f = ((k - 1) % every + 1) / every
        for side in range(2):
            sign = 1.0 - 2.0 * side
            area = plant.cylinder.A_A if side == 0 else plant.cylinder.A_B
            P, T = states[k, 2 + 2 * side], states[k, 3 + 2 * side]
            X, V = sign * x, sign * v
            e_P[side], e_T[side] = relaxed(e_P[side], e_T[side], sign * u, X, V, P, T, area, plant, h)
            if now != before:
                dP, dT = jump_rates(sign * before, sign * now, kind, f, X, V, P, T, area, plant)
                e_P[side] += dP
                e_T[side] += dT
        if k % stride == 0:
            result[:, k // stride] = e_P
    return result


@kernel
def pressure_rates(recording, drive, plant, stride):
    """Rate of pressure of a full-order run, Pa/s, shape (chamber, stored steps)."""
    states = recording.states
    result = np.empty((2, (len(states) - 1) // stride + 1))
    for i in range(result.shape[1]):
        x, v, P_A, T_A, P_B, T_B = states[i * stride]
        u = limited(command(recording.reference[i * stride], x, drive), plant.valve.u_max)
        result[0, i], _ = chamber_rates(u, x, v, P_A, T_A, plant.cylinder.A_A, plant)
        result[1, i], _ = chamber_rates(-u, -x, -v, P_B, T_B, plant.cylinder.A_B, plant)
    return result
