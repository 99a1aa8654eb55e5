"""Pressure error that jumps of the command cause in a replay on sampled signals: linear theory."""

from typing import TypeAlias

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.physics.cylinder import Chamber, chamber_of, sign_of
from pneumo.physics.valve import limited
from pneumo.simulation.compiled import inlined, kernel
from pneumo.simulation.excitation import command
from pneumo.simulation.full_order import Recording, chamber_rates, full_order_rates

ChamberState: TypeAlias = tuple[float, float, float, float, Chamber]  # x and v outward, P, T
SMALL_P, SMALL_T = 1.0, 1e-3  # Pa and K; steps of the differences that linearise the equations


@inlined
def opened(u: float, u_max: float) -> float:
    """Integral of the positive part of the limited command over the command, from 0 V to u, V^2."""
    if u <= 0:
        return 0.0
    return u * u / 2 if u < u_max else u_max * u - u_max * u_max / 2


@inlined
def mean_of_ramp(u: float, w: float, u_max: float) -> tuple[float, float]:
    """Means of the positive and the negative part of a limited command on a ramp from u to w, V."""
    positive = (opened(w, u_max) - opened(u, u_max)) / (w - u)
    negative = (opened(-u, u_max) - opened(-w, u_max)) / (w - u)
    return positive, negative


@inlined
def jump_rates(
    u: float, w: float, linear: bool, late: float, f: float, state: ChamberState, plant: Plant
) -> tuple[float, float]:
    """Errors of pressure, Pa/s, and temperature, K/s, from a jump of the command, per second between samples.

    The command jumps from u to w. If `linear`, the jump falls at the fraction 0 < f <= 1 between two samples
    that are interpolated; else it is delayed by `late` times between samples. Rates are linear in the area of
    each restriction: one area of each is enough.
    """
    u_max = plant.valve.u_max
    P_shut, T_shut = chamber_rates(0.0, *state, plant)
    P_fill, T_fill = chamber_rates(1.0, *state, plant)
    P_vent, T_vent = chamber_rates(-1.0, *state, plant)
    before, after = limited(u, u_max), limited(w, u_max)
    if linear:
        fill, vent = mean_of_ramp(u, w, u_max)
        fill = f * max(before, 0.0) + (1 - f) * max(after, 0.0) - fill
        vent = f * max(-before, 0.0) + (1 - f) * max(-after, 0.0) - vent
    else:
        fill = late * (max(after, 0.0) - max(before, 0.0))
        vent = late * (max(-after, 0.0) - max(-before, 0.0))
    return (
        fill * (P_fill - P_shut) + vent * (P_vent - P_shut),
        fill * (T_fill - T_shut) + vent * (T_vent - T_shut),
    )


@inlined
def relaxed(
    e_P: float, e_T: float, u: float, state: ChamberState, plant: Plant, h: float
) -> tuple[float, float]:
    """Deviations of pressure and temperature one step later, linearised at the run (implicit Euler)."""
    x, v, P, T, chamber = state
    P_1, T_1 = chamber_rates(u, x, v, P + SMALL_P, T, chamber, plant)
    P_2, T_2 = chamber_rates(u, x, v, P - SMALL_P, T, chamber, plant)
    P_3, T_3 = chamber_rates(u, x, v, P, T + SMALL_T, chamber, plant)
    P_4, T_4 = chamber_rates(u, x, v, P, T - SMALL_T, chamber, plant)
    a, b = 1 - h * (P_1 - P_2) / (2 * SMALL_P), -h * (P_3 - P_4) / (2 * SMALL_T)
    c, d = -h * (T_1 - T_2) / (2 * SMALL_P), 1 - h * (T_3 - T_4) / (2 * SMALL_T)
    return (d * e_P - b * e_T) / (a * d - b * c), (a * e_T - c * e_P) / (a * d - b * c)


@kernel
def jump_errors(
    recording: Recording, every: int, linear: bool, late: float, uniform: bool, stride: int
) -> np.ndarray:
    """Pressure error that jumps of the command cause, per second between samples, Pa/s: linear theory.

    Shape (chamber, stored steps), an error every `stride` steps. `every` is the number of steps between
    samples; jumps may fall on or between them. If `linear`, the replay interpolates the samples linearly;
    else it holds the sample that is `late` samples older than the last. If `uniform`, every jump, and the
    start from rest, is delayed by one second instead.
    """
    states, reference, drive, plant = recording.states, recording.reference, recording.drive, recording.plant
    steps = len(states) - 1
    result = np.zeros((2, steps // stride + 1))
    e_P, e_T, dy = np.zeros(2), np.zeros(2), np.empty(6)
    now = command(reference[0], states[0, 0], drive)
    if uniform:
        full_order_rates(states[0], 0, (reference[0], 0.0, drive, plant), dy)
        e_P[0], e_T[0], e_P[1], e_T[1] = dy[2], dy[3], dy[4], dy[5]
        result[:, 0] = e_P
    for k in range(1, steps + 1):
        x, v = states[k, 0], states[k, 1]
        # In closed loop the command also moves between jumps, with x; then only the reference makes one.
        before = command(reference[k - 1], x, drive) if drive.closed_loop else now
        u = limited(before, plant.valve.u_max)
        now = command(reference[k], x, drive)
        f = ((k - 1) % every + 1) / every
        delay = 1.0 if uniform else late + 1.0 - f
        for side in range(2):
            sign = sign_of(side)
            P, T = states[k, 2 + 2 * side], states[k, 3 + 2 * side]
            state = (sign * x, sign * v, P, T, chamber_of(plant.cylinder, side))
            e_P[side], e_T[side] = relaxed(e_P[side], e_T[side], sign * u, state, plant, recording.h)
            if now != before:
                dP, dT = jump_rates(sign * before, sign * now, linear, delay, f, state, plant)
                e_P[side] += dP
                e_T[side] += dT
        if k % stride == 0:
            result[:, k // stride] = e_P
    return result


@kernel
def pressure_rates(recording: Recording, stride: int) -> np.ndarray:
    """Rate of pressure of a full-order run, Pa/s, shape (chamber, stored steps)."""
    result, dy = np.empty((2, (len(recording.states) - 1) // stride + 1)), np.empty(6)
    for i in range(result.shape[1]):
        context = (recording.reference[i * stride], 0.0, recording.drive, recording.plant)
        full_order_rates(recording.states[i * stride], i, context, dy)
        result[0, i], result[1, i] = dy[2], dy[4]
    return result
