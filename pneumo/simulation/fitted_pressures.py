# pyright: basic
"""Pressures of both chambers by several sets of parameters at once, on signals given at every stage.

What a fit replays, hundreds of times. Sets are lanes of `pneumo.simulation.vectorised`, whose equations these
are; each has dead volumes of its own. Sensors are off by a hundred pascal or more, so a third-order method
is enough: steps of 1 ms are off by less than 1 Pa (paper/decisions/0056).
"""

from math import log, sqrt

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.physics.cylinder import volume
from pneumo.physics.models import temperature
from pneumo.simulation.compiled import kernel
from pneumo.simulation.polynomials import flow_polynomial
from pneumo.simulation.reference import lane_of, lane_rate_with_flows, piston_area
from pneumo.simulation.tableau import explicit
from pneumo.simulation.vectorised import (
    HEAT,
    K_0,
    K_1,
    N_V,
    P_A,
    P_B,
    RATES_B,
    ROOT_T,
    ROW,
    P,
    needs,
    shared_terms,
    work_array,
    write_rates,
)

KUTTA = explicit([[1 / 2], [-1, 2]], [1 / 6, 2 / 3, 1 / 6], order=3)
A, B = KUTTA.A, KUTTA.b
STAGES = len(B)

# Rows of a second work array: of chamber A, then of chamber B, what each lane's volume has beyond the
# plant's, m^3, temperature over T_0, and its rate at each stage.
BEYOND, T, RATE_T = (np.uint64(ROW * row) for row in (0, 1, 2))
OF_B = np.uint64(ROW * (2 + STAGES))


@kernel(fastmath={"contract"})
def _on_inputs(
    inputs: np.ndarray,
    W: np.ndarray,
    X: np.ndarray,
    starts: tuple[np.uint64, ...],
    full: bool,
    stride: int,
    plant: Plant,
    h: float,
    psi: tuple[float, ...],
    pressure: np.ndarray,
) -> None:
    c, s_sonic, count = plant.conditions, -log(plant.gas.critical_ratio), starts[3]
    gamma, inlet = plant.gas.gamma, c.T_in / c.T_0
    for k in range(len(inputs)):
        for j in range(STAGES):
            a_0, a_1 = h * A[j, 0], h * A[j, 1]
            for side in range(2):
                sign, area = 1.0 - 2.0 * side, piston_area(plant.cylinder, side)
                now, r = (P_A, np.uint64(0)) if side == 0 else (P_B, RATES_B)
                own = np.uint64(0) if side == 0 else OF_B
                rate, rate_T = K_0 + r + np.uint64(ROW * j), RATE_T + own + np.uint64(ROW * j)
                u, x, v = sign * inputs[k, j, 0], sign * inputs[k, j, 1], sign * inputs[k, j, 2]
                inverse_V = 1 / volume(x, area, plant.cylinder)
                for i in range(count):
                    W[P + i] = W[now + i] + (a_0 * W[K_0 + r + i] + a_1 * W[K_1 + r + i])
                if full:
                    first, second, start = RATE_T + own, RATE_T + own + np.uint64(ROW), T + own
                    for i in range(count):
                        W[ROOT_T + i] = sqrt(X[start + i] + (a_0 * X[first + i] + a_1 * X[second + i]))
                shared = shared_terms(u, x, v, area, plant)
                write_rates(W, rate, starts, shared, plant, psi, s_sonic)
                expansion, wall = shared[4], shared[5]
                if full:
                    for i in range(count):
                        p, T_now = W[P + i], W[ROOT_T + i] * W[ROOT_T + i]
                        energy = W[rate + i] - expansion * (W[N_V + i] * p) - wall * W[HEAT + i]
                        T_flow = inlet if energy > 0 else T_now
                        mass = energy / (gamma * T_flow) * T_now  # dm/dt over m, times p
                        X[rate_T + i] = T_now * ((W[rate + i] - mass) / p - expansion)  # P V = m R T
                for i in range(count):
                    share = 1 / (1 + X[BEYOND + own + i] * inverse_V)  # every rate is one over the volume
                    W[rate + i] *= share
                    X[rate_T + i] *= share
        for side in range(2):
            now, r = (P_A, np.uint64(0)) if side == 0 else (P_B, RATES_B)
            own = np.uint64(0) if side == 0 else OF_B
            for i in range(count):
                k_0, k_1 = K_0 + r + i, K_1 + r + i
                p = W[now + i] + h * (B[0] * W[k_0] + B[1] * W[k_1] + B[2] * W[k_1 + np.uint64(ROW)])
                W[now + i] = p if p > 0 else np.nan
            if full:
                for i in range(count):
                    k_0 = RATE_T + own + i
                    k_1 = k_0 + np.uint64(ROW)
                    X[T + own + i] += h * (B[0] * X[k_0] + B[1] * X[k_1] + B[2] * X[k_1 + np.uint64(ROW)])
        if (k + 1) % stride == 0:
            for i in range(count):
                pressure[0, i, (k + 1) // stride] = c.P_0 * W[P_A + i]
                pressure[1, i, (k + 1) // stride] = c.P_0 * W[P_B + i]


def pressures_of_sets(
    inputs: np.ndarray,
    lanes: np.ndarray,
    V_d: np.ndarray,
    plant: Plant,
    h: float,
    stride: int,
    start: np.ndarray,
    start_T: np.ndarray | None = None,
) -> np.ndarray:
    """Pressures, Pa, shape (set, chamber, stored steps), on given signals.

    They are NaN from where a set left the positive numbers.

    Parameters
    ----------
    inputs : numpy.ndarray
        Limited command, V, position, m, and velocity, m/s, at every stage of `KUTTA`: shape (steps, 3, 3).
    lanes : numpy.ndarray
        From `pneumo.physics.models.lane_array`, shape (set, 8), at most `vectorised.ROW` of them.
    V_d : numpy.ndarray
        Dead volumes, m^3, shape (set, chamber), in place of the plant's.
    plant : Plant
        Without leak or laminar share: its flow is a polynomial here.
    h, stride : float, int
        Step, s, and steps between stored pressures.
    start, start_T : numpy.ndarray
        Pressures, Pa, and temperatures, K, at first, shape (set, chamber). With temperatures the full-order
        chambers are replayed, else reduced models.
    """
    count, full = len(lanes), start_T is not None
    order = np.argsort(needs(lanes), kind="stable")
    W, starts = work_array(lanes[order], plant)
    padded = order[np.minimum(np.arange(int(starts[3])), count - 1)]
    X = np.zeros((2, 2 + STAGES, ROW))
    X[:, 0, : len(padded)] = (V_d[padded] - plant.cylinder.V_d).T
    for row, first in zip((P_A, P_B), start[padded].T, strict=True):
        W[int(row) : int(row) + len(padded)] = first / plant.conditions.P_0
    if start_T is not None:
        X[:, 1, : len(padded)] = start_T[padded].T / plant.conditions.T_0
        starts = (starts[3], *starts[1:])  # no temperature follows from the pressure
    pressure = np.empty((2, len(padded), len(inputs) // stride + 1))
    pressure[:, :, 0] = start[padded].T
    psi, _ = flow_polynomial(plant.gas)
    _on_inputs(inputs, W, X.ravel(), starts, full, stride, plant, h, psi, pressure)
    result = np.empty((count, 2, pressure.shape[2]))
    result[order] = pressure[:, :count].transpose(1, 0, 2)
    return result


@kernel
def _on_flows(
    inputs: np.ndarray,
    flow: np.ndarray,
    lanes: np.ndarray,
    V_d: np.ndarray,
    plant: Plant,
    h: float,
    stride: int,
    pressure: np.ndarray,
) -> None:
    c, K = plant.conditions, np.empty(STAGES)
    for index in range(len(lanes)):
        lane = lane_of(lanes[index])
        for side in range(2):
            sign, area = 1.0 - 2.0 * side, piston_area(plant.cylinder, side)
            beyond, p = V_d[index, side] - plant.cylinder.V_d, pressure[index, side, 0]
            K[:] = 0.0
            for k in range(len(inputs)):
                for j in range(STAGES):
                    y = p + h * (A[j, 0] * K[0] + A[j, 1] * K[1])
                    x, v, m = sign * inputs[k, j, 1], sign * inputs[k, j, 2], flow[k, j, side]
                    T_now = temperature(y, c.P_0, c.T_0, lane.a)
                    rate = lane_rate_with_flows(max(m, 0.0), max(-m, 0.0), x, v, y, T_now, area, plant, lane)
                    V = volume(x, area, plant.cylinder)
                    K[j] = rate * (V / (V + beyond))
                p += h * (B[0] * K[0] + B[1] * K[1] + B[2] * K[2])
                if not p > 0:
                    p = np.nan
                if (k + 1) % stride == 0:
                    pressure[index, side, (k + 1) // stride] = p


def pressures_on_flows(
    inputs: np.ndarray,
    flow: np.ndarray,
    lanes: np.ndarray,
    V_d: np.ndarray,
    plant: Plant,
    h: float,
    stride: int,
    start: np.ndarray,
) -> np.ndarray:
    """Pressures of reduced models as from `pressures_of_sets`, on given mass flows in place of a valve.

    `flow`, shape (steps, 3, 2), goes into chambers A and B, negative out of them, kg/s, at every stage. The
    command plays no role; there may be any number of sets.
    """
    pressure = np.empty((len(lanes), 2, len(inputs) // stride + 1))
    pressure[:, :, 0] = start
    _on_flows(inputs, flow, lanes, V_d, plant, h, stride, pressure)
    return pressure
