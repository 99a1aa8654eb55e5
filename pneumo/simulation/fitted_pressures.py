# pyright: basic
"""Pressures of both chambers by several sets of parameters at once, on signals given at every stage.

A fit makes these replays hundreds of times. Each set of parameters is a lane, as in
`pneumo.simulation.vectorised` and with the equations there, but has dead volumes of its own. Sensors have
errors of a hundred pascal or more, so a third-order method is enough: its error with steps of 1 ms is below
1 Pa (paper/decisions/0056). A step in which a chamber meets the pressure of its open port, where the slope of
eq (1) is infinite, is implicit (paper/decisions/0058).
"""

from math import exp, log, sqrt

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.physics.cylinder import Chamber, chamber_of, heat_area, sign_of, volume
from pneumo.physics.models import temperature
from pneumo.physics.valve import Conditions
from pneumo.simulation.compiled import inlined, kernel
from pneumo.simulation.polynomials import flow_polynomial
from pneumo.simulation.reference import lane_of, lane_rate_with_flows
from pneumo.simulation.tableau import explicit
from pneumo.simulation.vectorised import (
    GROUP,
    HEAT,
    IN,
    IN_T,
    K_0,
    K_1,
    N_V,
    OUT,
    P_A,
    P_B,
    RATES_B,
    ROOT_T,
    ROW,
    WIDTH,
    P,
    needs,
    shared_terms,
    work_array,
    write_rates,
)

KUTTA = explicit([[1 / 2], [-1, 2]], [1 / 6, 2 / 3, 1 / 6], order=3)
A, B = KUTTA.A, KUTTA.b
STAGES = len(B)

# Rows of a second work array, for what differs between lanes beside their model. At one stage: the plant's
# volume over the lane's, the relative rate of the lane's volume, 1/s, its wall area over the plant's, less 1.
# Of the lane: temperature of the supply over T_0, and area of the exhaust over that of the plant.
VOLUME_RATIO, EXPANSION, AREA, INLET, EXHAUST = (np.uint64(ROW * row) for row in range(5))
# Of chamber A, then of chamber B: volume beyond the plant's, m^3; pressure before a step that met the open
# port's, else 0; temperature over T_0; its rate by stage.
BEYOND, MET, T, RATE_T = (np.uint64(ROW * (5 + row)) for row in range(4))
OFFSET_B = np.uint64(ROW * (3 + STAGES))
ROWS = 5 + 2 * (3 + STAGES)

# An explicit step that meets the open port's pressure is off by some (h K)^2; below this, over P_0, it stays.
NEAR = 1e-3
EQUAL = 1e-9  # relative difference of pressures whose logarithmic mean is either


@inlined
def _write_geometry(
    motions: np.ndarray,
    k: int,
    j: int,
    sign: float,
    chamber: Chamber,
    plant: Plant,
    e_A: float,
    width: np.uint64,
    count: np.uint64,
    offset: np.uint64,
    X: np.ndarray,
) -> float:
    """Write the rows `VOLUME_RATIO`, `EXPANSION` and `AREA` of the work array X for stage j of step k.

    Of the `count` lanes, each motion has `width` in turn, and the last motion also the lanes of padding.
    Returns the piston position of the first motion, m, positive where it enlarges the chamber.
    """
    x = sign * motions[0, k, j, 0]
    V, A_q = volume(x, chamber, plant.cylinder), heat_area(x, plant.cylinder)
    for m in range(len(motions)):
        x_m, v_m = sign * motions[m, k, j, 0], sign * motions[m, k, j, 1]
        V_m = volume(x_m, chamber, plant.cylinder)
        area_m = e_A * (heat_area(x_m, plant.cylinder) / A_q - 1)
        first = np.uint64(m) * width
        end = first + width if m + 1 < len(motions) else count
        for i in range(first, end):
            X[VOLUME_RATIO + i] = V_m
            X[EXPANSION + i] = chamber.area * v_m
            X[AREA + i] = area_m
    for i in range(count):
        inverse_V = 1 / (X[VOLUME_RATIO + i] + X[BEYOND + offset + i])
        X[VOLUME_RATIO + i] = V * inverse_V
        X[EXPANSION + i] *= inverse_V
    return x


@inlined
def _step_across_port(
    W: np.ndarray,
    X: np.ndarray,
    now: np.uint64,
    offset: np.uint64,
    starts: tuple[np.uint64, ...],
    full: bool,
    exhausts: bool,
    shared: tuple[float, ...],
    plant: Plant,
    h: float,
    psi: tuple[float, ...],
    s_sonic: float,
) -> None:
    """Repeat a step by the implicit Euler method, for lanes whose pressure met that of the open port.

    For these lanes the row `MET` of X holds the pressure before the step, over P_0; for all others, 0. Near
    the port's pressure the flow's term in dp/dt is K sign(d) sqrt(|d|) with d = p_port - p, and the other
    terms, b, hardly change: d + h K sign(d) sqrt(|d|) = p_port - p_before - h b.
    """
    p_port, _, inward, outward, _, _, _ = shared
    count = GROUP * starts[3]
    root = psi[0] / sqrt(p_port)
    for i in range(count):
        W[P + i] = p_port
    if full:
        for i in range(count):
            W[ROOT_T + i] = sqrt(X[T + offset + i])
    write_rates(W, K_0, starts, shared, plant, psi, s_sonic)  # at the port's pressure there is no flow
    for i in range(count):
        if X[MET + offset + i] > 0:
            heated = W[K_0 + i] + X[AREA + i] * W[HEAT + i]
            b = X[VOLUME_RATIO + i] * heated - X[EXPANSION + i] * (W[N_V + i] * p_port)
            root_T, before = W[ROOT_T + i], X[MET + offset + i]
            rest = p_port - before - h * b
            energy = inward * (W[IN + i] + W[IN_T + i] * (root_T * root_T))
            if rest < 0:
                energy = -outward * (W[OUT + i] * p_port * root_T)
            area = X[EXHAUST + i] if exhausts else 1.0
            hK = h * X[VOLUME_RATIO + i] * (area * energy) * root
            if hK * hK < NEAR:
                X[T + offset + i] = X[RATE_T + offset + i]
                continue
            y = (sqrt(hK * hK + 4 * abs(rest)) - hK) / 2
            p = p_port - y * y if rest > 0 else p_port + y * y
            if full:
                T_now, flow = root_T * root_T, (p - before) / h - b
                T_flow = X[INLET + i] if flow > 0 else T_now
                change = p - before - h * flow / (plant.gas.gamma * T_flow) * T_now  # as at a stage
                mean = (p - before) / log(p / before) if abs(p - before) > EQUAL * p else p  # logarithmic
                X[T + offset + i] = T_now * exp(change / mean + h * X[EXPANSION + i])
            W[now + i] = p


@kernel(fastmath={"contract"})
def _on_inputs(
    u: np.ndarray,
    motions: np.ndarray,
    W: np.ndarray,
    X: np.ndarray,
    starts: tuple[np.uint64, ...],
    width: np.uint64,
    full: bool,
    e_A: float,
    stride: int,
    plant: Plant,
    h: float,
    psi: tuple[float, ...],
    P_s: np.ndarray,
    pressure: np.ndarray,
) -> None:
    c, s_sonic, count = plant.conditions, -log(plant.gas.critical_ratio), GROUP * starts[3]
    gamma = plant.gas.gamma
    for k in range(len(u)):
        for j in range(STAGES):
            a_0, a_1 = h * A[j, 0], h * A[j, 1]
            now_c = Conditions(P_s[k, j], c.P_atm, c.T_in, c.T_amb, c.P_0, c.T_0)
            supplied = Plant(plant.gas, plant.valve, now_c, plant.cylinder, plant.k_0)
            for side in range(2):
                sign, chamber = sign_of(side), chamber_of(plant.cylinder, side)
                now, r = (P_A, np.uint64(0)) if side == 0 else (P_B, RATES_B)
                offset = np.uint64(0) if side == 0 else OFFSET_B
                rate, rate_T = K_0 + r + np.uint64(ROW * j), RATE_T + offset + np.uint64(ROW * j)
                x = _write_geometry(motions, k, j, sign, chamber, plant, e_A, width, count, offset, X)
                shared = shared_terms(sign * u[k, j], x, 0.0, chamber, supplied)
                p_port = shared[0]
                for i in range(count):
                    p = W[now + i] + (a_0 * W[K_0 + r + i] + a_1 * W[K_1 + r + i])
                    met = 0.0 if j == 0 else X[MET + offset + i]
                    X[MET + offset + i] = W[now + i] if (p - p_port) * (W[now + i] - p_port) <= 0 else met
                    W[P + i] = p
                if full:
                    first, second, start = RATE_T + offset, RATE_T + offset + np.uint64(ROW), T + offset
                    for i in range(count):
                        W[ROOT_T + i] = sqrt(X[start + i] + (a_0 * X[first + i] + a_1 * X[second + i]))
                write_rates(W, rate, starts, shared, supplied, psi, s_sonic)  # at rest, in the plant's volume
                if sign * u[k, j] < 0:
                    for i in range(count):
                        W[rate + i] = W[HEAT + i] + X[EXHAUST + i] * (W[rate + i] - W[HEAT + i])
                if full:
                    for i in range(count):
                        T_now, energy = W[ROOT_T + i] * W[ROOT_T + i], W[rate + i] - W[HEAT + i]
                        T_flow = X[INLET + i] if energy > 0 else T_now
                        X[rate_T + i] = (
                            X[VOLUME_RATIO + i] * energy / (gamma * T_flow) * T_now
                        )  # p dm/dt over m
                for i in range(count):
                    heated = W[rate + i] + X[AREA + i] * W[HEAT + i]
                    W[rate + i] = X[VOLUME_RATIO + i] * heated - X[EXPANSION + i] * (W[N_V + i] * W[P + i])
                if full:
                    for i in range(count):
                        T_now, change = W[ROOT_T + i] * W[ROOT_T + i], W[rate + i] - X[rate_T + i]
                        X[rate_T + i] = T_now * (change / W[P + i] + X[EXPANSION + i])  # P V = m R T
        # The last stage was at the step's end; its supply is still the one in force.
        for side in range(2):
            sign, chamber = sign_of(side), chamber_of(plant.cylinder, side)
            now, r = (P_A, np.uint64(0)) if side == 0 else (P_B, RATES_B)
            offset, last, meeting = np.uint64(0) if side == 0 else OFFSET_B, STAGES - 1, 0
            p_port = (supplied.conditions.P_s if sign * u[k, last] >= 0 else c.P_atm) / c.P_0
            for i in range(count):
                k_0, k_1 = K_0 + r + i, K_1 + r + i
                p = W[now + i] + h * (B[0] * W[k_0] + B[1] * W[k_1] + B[2] * W[k_1 + np.uint64(ROW)])
                met = X[MET + offset + i]
                met = W[now + i] if (p - p_port) * (W[now + i] - p_port) <= 0 else met
                X[MET + offset + i] = met
                meeting += 1 if met > 0 else 0
                W[now + i] = p if p > 0 else np.nan
            if full:
                for i in range(count):
                    k_0 = RATE_T + offset + i
                    k_1 = k_0 + np.uint64(ROW)
                    change = h * (B[0] * X[k_0] + B[1] * X[k_1] + B[2] * X[k_1 + np.uint64(ROW)])
                    X[k_0] = X[T + offset + i] + change  # `_step_across_port` may find another
                    X[T + offset + i] = X[T + offset + i] if X[MET + offset + i] > 0 else X[k_0]
            if meeting > 0:
                x = _write_geometry(motions, k, last, sign, chamber, plant, e_A, width, count, offset, X)
                shared = shared_terms(sign * u[k, last], x, 0.0, chamber, supplied)
                exhausts = sign * u[k, last] < 0
                _step_across_port(
                    W, X, now, offset, starts, full, exhausts, shared, supplied, h, psi, s_sonic
                )
                for i in range(count):  # rates of a stage that failed would stay in the sums of the next step
                    W[K_0 + r + i] = W[K_1 + r + i] = 0.0
                    X[RATE_T + offset + i] = X[RATE_T + offset + np.uint64(ROW) + i] = 0.0
        if (k + 1) % stride == 0:
            for side in range(2):
                now = P_A if side == 0 else P_B
                for i in range(count):
                    pressure[(k + 1) // stride, side, i] = c.P_0 * W[now + i]


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
        Limited command, V, at every stage of `KUTTA`: shape (steps, 3).
    motions : numpy.ndarray
        Position, m, and velocity, m/s, at every stage: shape (motion, steps, 3, 2). Every set of parameters
        is replayed on each.
    lanes : numpy.ndarray
        Coefficients of one model, a row for each set of parameters, from `pneumo.physics.models.lane_array`:
        shape (set, 9), at most `vectorised.ROW` sets.
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
    T_in = np.full(len(lanes), plant.conditions.T_in) if T_in is None else T_in
    exhaust = np.full(len(lanes), plant.valve.exhaust) if exhaust is None else exhaust
    P_s = np.full(u.shape, plant.conditions.P_s) if P_s is None else P_s
    # Of one layout, since the kernel is compiled for each.
    u, motions, P_s = (np.ascontiguousarray(signal) for signal in (u, motions, P_s))
    count, full = len(lanes), start_T is not None
    need = 3 if full else int(needs(lanes).max())
    psi, _ = flow_polynomial(plant.gas)
    result = np.empty((len(motions), count, 2, len(u) // stride + 1))
    at_once = max(1, ROW // count)
    for first in range(0, len(motions), at_once):
        part = motions[first : first + at_once]
        rows = np.tile(np.arange(count), len(part))
        rows = np.append(rows, np.full(-len(rows) % WIDTH, count - 1))
        W, (*_, last) = work_array(lanes[rows], plant)
        # No temperature of the full order follows from its pressure.
        starts = tuple(np.uint64(0) if need >= least else last for least in (9 if full else 1, 2, 3))
        X = np.zeros((ROWS, ROW))
        X[int(INLET) // ROW, : len(rows)] = T_in[rows] / plant.conditions.T_0
        X[int(EXHAUST) // ROW, : len(rows)] = exhaust[rows] / plant.valve.exhaust
        # The flow's factor has the root of the plant's T_in as divisor.
        root = np.sqrt(T_in / plant.conditions.T_in)[rows]
        W[int(IN) : int(IN) + len(rows)] *= root
        W[int(IN_T) : int(IN_T) + len(rows)] /= root
        for side, now in enumerate((P_A, P_B)):
            W[int(now) : int(now) + len(rows)] = start[rows, side] / plant.conditions.P_0
            beyond, first_T = ((int(row) + side * int(OFFSET_B)) // ROW for row in (BEYOND, T))
            X[beyond, : len(rows)] = V_d[rows, side] - chamber_of(plant.cylinder, side).V_d
            if start_T is not None:
                X[first_T, : len(rows)] = start_T[rows, side] / plant.conditions.T_0
        pressure = np.empty((result.shape[3], 2, len(rows)))
        pressure[0] = start[rows].T
        e_A = float(lane_of(lanes[0]).e_A)
        lanes_of = (*starts, last), np.uint64(count), full, e_A
        _on_inputs(u, part, W, X.ravel(), *lanes_of, stride, plant, h, psi, P_s, pressure)
        by_motion = pressure[..., : len(part) * count].reshape(-1, 2, len(part), count)
        result[first : first + len(part)] = by_motion.transpose(2, 3, 1, 0)
    return result


@kernel
def _on_flows(
    motion: np.ndarray,
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
            sign, chamber = sign_of(side), chamber_of(plant.cylinder, side)
            beyond, p = V_d[index, side] - chamber.V_d, pressure[index, side, 0]
            K[:] = 0.0
            for k in range(len(flow)):
                for j in range(STAGES):
                    y = p + h * (A[j, 0] * K[0] + A[j, 1] * K[1])
                    x, v, m = sign * motion[k, j, 0], sign * motion[k, j, 1], flow[k, j, side]
                    T_now = temperature(y, c.P_0, c.T_0, lane.a)
                    rate = lane_rate_with_flows(
                        max(m, 0.0), max(-m, 0.0), x, v, y, T_now, chamber, plant, lane
                    )
                    V = volume(x, chamber, plant.cylinder)
                    K[j] = rate * (V / (V + beyond))
                p += h * (B[0] * K[0] + B[1] * K[1] + B[2] * K[2])
                if not p > 0:
                    p = np.nan
                if (k + 1) % stride == 0:
                    pressure[index, side, (k + 1) // stride] = p


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
    pressure = np.empty((len(lanes), 2, len(flow) // stride + 1))
    pressure[:, :, 0] = start
    _on_flows(motion, flow, lanes, V_d, plant, h, stride, pressure)
    return pressure
