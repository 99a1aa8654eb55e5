# pyright: basic
"""The fast replay kernel: lanes side by side in vector registers, some 25 times as fast as the reference.

It computes the same as `pneumo.simulation.reference`, which is the one to read. It is fast because lanes are
innermost, in short loops over the rows of one work array, which the compiler turns into vector instructions;
because exponential and logarithm are polynomials without branches; and because each evaluation takes one
logarithm, lp = ln(P / P_0), for both the temperature of eq (6) and the pressure ratio of eq (1). Pressures
are in units of P_0.

A lane outside the range of the polynomials becomes NaN, and the reference replays it again.
"""

from math import log, sqrt

import numpy as np
from numba.extending import register_jitable

from pneumo.configuration.experiment import Plant
from pneumo.physics.cylinder import Chamber, chamber_of, heat_area, sign_of, volume
from pneumo.physics.models import Lane
from pneumo.simulation.compiled import inlined, inlined_first
from pneumo.simulation.polynomials import (
    EXP_REACH,
    FLOW_TOLERANCE,
    exponential,
    flow_polynomial,
    logarithm,
    polynomial,
)
from pneumo.simulation.runge_kutta import STAGES, A, B

WIDTH = 8  # lanes are padded to a multiple of this; a vector register holds 2, 4 or 8
ROW = 136  # lanes at once; 17 cache lines, an odd number, so that rows do not compete for places in the cache

# Where each row of the work array begins. Unsigned, as is every index of the kernel: an index that might be
# negative, and so count from the end, keeps the compiler from vectorising.
# fmt: off
(
    N_V, A_HALF, IN, IN_T, OUT, WALL, WALL_A, WALL_APT,  # a lane's coefficients
    P_A, P_B, SUM_A, _, SQUARES_A, _, SUM_B, _, SQUARES_B, _,  # pressures; sums, each before its carry
    P, LP, ROOT_T, HEAT,  # within one stage
    # Rates within one step, chamber A's and B's, the last of each at the step's end.
    K_0, K_1, K_2, K_3, K_4, K_5, K_6, _, _, _, _, _, _, _,
    # Both chambers' pressures before the step, and after as many halvings as a lane needs; whether it needs
    # one more; largest error estimate of the step's parts.
    BEFORE, _, AFTER, _, COARSE, _, LARGEST, _, END,
) = (np.uint64(ROW * row) for row in range(45))
# fmt: on
CARRY = np.uint64(ROW)
# Numbers of lanes are products with this one, so that the compiler sees multiples of a register's width. For
# any other number it adds a loop over the lanes left over, whose constants take registers from the vectors.
GROUP = np.uint64(WIDTH)
RATES_B = np.uint64((STAGES + 1) * ROW)  # from chamber A's rates to chamber B's
SIDE_B = np.uint64(ROW)  # from a row of chamber A to chamber B's, where they follow one another


@inlined
def shared_terms(u: float, x: float, v: float, chamber: Chamber, plant: Plant) -> tuple[float, ...]:
    """Terms of the pressure rate at one stage that are the same for all lanes of a chamber.

    Returns, in units of P_0: pressure of the open port and its logarithm; factors of inflow, outflow,
    compression, wall heat with a constant conductance, and wall heat with a conductance proportional to A_q.
    For chamber B, negate u, x, v.
    """
    c, inverse_V = plant.conditions, 1 / volume(x, chamber, plant.cylinder)
    throat = plant.gas.R * plant.valve.k_xu * abs(u) * inverse_V  # (2)
    if u < 0:
        throat *= plant.valve.exhaust
    # Both logarithms, of constants, are found once; one of the choice would be found at every stage.
    l_s, l_atm = log(c.P_s / c.P_0), log(c.P_atm / c.P_0)
    p_port, l_port = (c.P_s / c.P_0, l_s) if u >= 0 else (c.P_atm / c.P_0, l_atm)
    wall = (plant.gas.gamma - 1) * plant.k_0 / c.P_0 * inverse_V
    return (
        p_port,
        l_port,
        throat * (p_port * (1 / sqrt(c.T_in))),
        -throat,
        -chamber.area * v * inverse_V,
        wall,
        wall * (heat_area(x, plant.cylinder) * (1 / heat_area(0.0, plant.cylinder))),
    )


@register_jitable
def write_rates(
    W: np.ndarray,
    rate: np.uint64,
    starts: tuple[np.uint64, ...],
    shared: tuple[float, ...],
    plant: Plant,
    psi: tuple[float, ...],
    s_sonic: float,
) -> None:
    """Write the rate of every lane's pressure, P_0 per second, into the row of W that begins at `rate`.

    `shared` is from `shared_terms`, `starts` from `work_array`, `psi` from `flow_polynomial`; s_sonic is
    ln(P_u / P_d) from which on flow is sonic.
    """
    p_port, l_port, inward, outward, compression, wall, wall_A = shared
    polytropic, heated, heated_PT, end = starts
    count = GROUP * end
    T_0, T_amb, sonic = plant.conditions.T_0, plant.conditions.T_amb, plant.gas.sonic_coefficient
    for i in range(count):
        W[LP + i] = logarithm(W[P + i])
    for k in range(GROUP * (end - polytropic)):
        i = GROUP * polytropic + k
        W[ROOT_T + i] = exponential(W[A_HALF + i] * W[LP + i])  # (6): sqrt(T / T_0)
    for k in range(GROUP * (end - heated)):
        i = GROUP * heated + k
        T = T_0 * (W[ROOT_T + i] * W[ROOT_T + i])
        W[HEAT + i] = (wall * W[WALL + i] + wall_A * W[WALL_A + i]) * (T_amb - T)  # (13), (11)
    for k in range(GROUP * (end - heated_PT)):
        i = GROUP * heated_PT + k
        T = T_0 * (W[ROOT_T + i] * W[ROOT_T + i])
        W[HEAT + i] += wall_A * W[WALL_APT + i] * sqrt(W[P + i]) * W[ROOT_T + i] * (T_amb - T)  # (7), (8)
    for i in range(count):
        p, root_T = W[P + i], W[ROOT_T + i]
        s = abs(W[LP + i] - l_port)
        subsonic = sqrt(s) * polynomial(psi, s)
        flow = sonic if s >= s_sonic else subsonic  # (1)
        inflow = inward * (W[IN + i] + W[IN_T + i] * (root_T * root_T))
        outflow = (outward * p) * (W[OUT + i] * root_T)
        energy = inflow if p_port >= p else outflow
        W[rate + i] = (compression * p) * W[N_V + i] + (flow * energy + W[HEAT + i])


@inlined_first  # not by LLVM as `inlined`: a tenth faster with AVX2
def advance(
    W: np.ndarray,
    inputs: np.ndarray,
    starts: tuple[np.uint64, ...],
    plant: Plant,
    h: float,
    psi: tuple[float, ...],
    s_sonic: float,
) -> None:
    """Advance every lane's pressures in both chambers by one step of h s; NaN where not positive.

    `inputs` holds limited u, x and v at every stage; the other parameters are those of `write_rates`.
    """
    count = GROUP * starts[3]
    # One chamber's stage does not wait for the other's, so the processor works on both.
    for j in range(STAGES):
        a_0, a_1, a_2, a_3, a_4 = h * A[j, 0], h * A[j, 1], h * A[j, 2], h * A[j, 3], h * A[j, 4]
        for side in range(2):
            sign = sign_of(side)
            chamber = chamber_of(plant.cylinder, side)
            now, r = (P_A, np.uint64(0)) if side == 0 else (P_B, RATES_B)
            if j < 3:
                for i in range(count):
                    W[P + i] = W[now + i] + (a_0 * W[K_0 + r + i] + a_1 * W[K_1 + r + i])
            else:
                for i in range(count):
                    early = a_0 * W[K_0 + r + i] + a_1 * W[K_1 + r + i] + a_2 * W[K_2 + r + i]
                    W[P + i] = W[now + i] + (early + a_3 * W[K_3 + r + i] + a_4 * W[K_4 + r + i])
            u, x, v = sign * inputs[j, 0], sign * inputs[j, 1], sign * inputs[j, 2]
            shared = shared_terms(u, x, v, chamber, plant)
            write_rates(W, K_0 + r + np.uint64(ROW * j), starts, shared, plant, psi, s_sonic)
    for side in range(2):
        now, r = (P_A, np.uint64(0)) if side == 0 else (P_B, RATES_B)
        for i in range(count):
            early = B[0] * W[K_0 + r + i] + B[1] * W[K_1 + r + i] + B[2] * W[K_2 + r + i]
            late = B[3] * W[K_3 + r + i] + B[4] * W[K_4 + r + i] + B[5] * W[K_5 + r + i]
            p = W[now + i] + h * (early + late)
            W[now + i] = p if p > 0 else np.nan


def needs(lanes: np.ndarray) -> np.ndarray:
    """Terms of the pressure rate that each lane needs, as a number from 0 to 3.

    0: no temperature and no wall heat; 1: temperature by eq (6); 2: that temperature and wall heat; 3: as 2,
    with a wall conductance that depends on the square root of P T.
    """
    lane = Lane(*lanes.T)
    wall = np.where(lane.e_PT != 0, 3, 2)
    return np.where(lane.wall_scale != 0, wall, np.where(lane.a != 0, 1, 0))


def followed(lanes: np.ndarray, plant: Plant) -> np.ndarray:
    """Whether this kernel can replay each lane, shape (lane,).

    It can where wall heat follows one of `pneumo.physics.models.WALL_LAWS`, the exponent a of eq (6) is 0 or
    above 0.002 in magnitude, and the valve has neither leak nor laminar flow.
    """
    _, error = flow_polynomial(plant.gas)
    if error > FLOW_TOLERANCE or plant.valve.laminar or plant.valve.leak:
        return np.zeros(len(lanes), dtype=bool)
    _, _, _, a, _, _, wall_scale, e_A, e_PT, _ = lanes.T
    law = (e_PT == 0) & ((e_A == 0) | (e_A == 1)) | (e_PT == 0.5) & (e_A == 1)
    # |lp| > 700, which is P <= 0, has to be outside the reach of the exponential.
    return ((wall_scale == 0) | law) & ((a == 0) | (np.abs(a) / 2 * 700 > EXP_REACH))


def work_array(lanes: np.ndarray, plant: Plant) -> tuple[np.ndarray, tuple[np.uint64, ...]]:
    """Copy the coefficients of lanes, sorted by `needs`, into the work array of the kernel.

    Returns
    -------
    W : numpy.ndarray
        The work array, aligned to a cache line; all first pressures are P_0.
    starts : tuple of numpy.uint64
        Index of the first lane with `needs` of at least 1, 2 and 3, and the number of lanes, all divided by
        `WIDTH`.
    """
    c, count = plant.conditions, -(-len(lanes) // WIDTH) * WIDTH
    lanes = lanes[np.minimum(np.arange(count), len(lanes) - 1)]
    n_V, n_in, n_out, a, mixing, flow_scale, wall_scale, e_A, e_PT, _ = lanes.T
    n_in, n_out = n_in * flow_scale, n_out * flow_scale
    rows = {
        N_V: n_V,
        A_HALF: a / 2,
        IN: n_in * mixing * c.T_in,
        IN_T: n_in * (1 - mixing) * c.T_0,
        OUT: n_out * sqrt(c.T_0),
        WALL: wall_scale * (1 - e_A),
        WALL_A: wall_scale * e_A * (e_PT == 0),
        WALL_APT: wall_scale * e_A * (e_PT != 0),
        **dict.fromkeys((P_A, P_B, ROOT_T), 1.0),
    }
    W = np.zeros(int(END) + 8)
    W = W[-(W.ctypes.data // 8) % 8 :][: int(END)]
    for start, values in rows.items():
        W[int(start) : int(start) + count] = values
    starts = [int(np.searchsorted(needs(lanes), need)) // WIDTH for need in (1, 2, 3)]
    return W, tuple(np.uint64(start) for start in (*starts, count // WIDTH))
