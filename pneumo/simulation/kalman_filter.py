# pyright: basic
"""Extended Kalman filter that estimates motion, pressures and, optionally, temperatures and k_0.

It predicts by eq (3) and a reduced model or the full order, with one step of the midpoint rule per sample.
"""

from math import exp, log
from typing import NamedTuple

import numpy as np

import pneumo.core as core
from pneumo.configuration.experiment import Plant
from pneumo.physics.cylinder import Chamber, Side, acceleration, chamber_of, motion, sign_of, stopped
from pneumo.physics.models import Lane, full_order_lane, temperature
from pneumo.physics.valve import chamber_flows
from pneumo.simulation.compiled import inlined
from pneumo.simulation.full_order_replay import FullRow, full_row_rates
from pneumo.simulation.reference import lane_rate_with_flows

# Temperatures are states of the full order only, k_0 only where it is asked for.
STATES = ("x", "v", "P_A", "P_B", "T_A", "T_B", "ln k_0")
SIZE, LN_K_0 = len(STATES), 6
FIRST_PRESSURE = 2e4  # Pa, standard deviation of the first estimate of either pressure
FIRST_TEMPERATURE = 5.0  # K, likewise
FIRST_LN_K_0 = log(2.7)  # likewise: the catalogue's interval
K_0_RANGE = log(10.0)  # of ln k_0 around its first value: k_0 cannot run away where nothing tells it
K_0_NOISE = 0.01  # s^-0.5, process noise of ln k_0
DX, DV, DP, DT, DK = 1e-4, 1e-2, 1e-3, 0.1, 1e-3  # steps of derivatives: strokes; m/s; P_0; K; ln k_0


class Noise(NamedTuple):
    """White noise that a filter assumes, of the process and of the readings."""

    force: float  #: N s^0.5, on the piston
    pressure: float  #: Pa/s^0.5, on the rate of either pressure, and over P_0 on T/T_0
    x_variance: float  #: m^2, of the position's readings
    pressure_variance: float  #: Pa^2, of the pressures' readings


class FilterModel(NamedTuple):
    """The model by which a filter predicts."""

    full: bool  #: the full order, with both temperatures as states; else the reduced model of `lane`
    estimates_k_0: bool  #: whether ln k_0 is a state, relative to the plant's
    lane: Lane  #: plays no role in the full order
    full_row: FullRow  #: plays no role in a reduced model


@inlined
def state_count(model: FilterModel) -> int:
    """Number of states that a model uses: 4, with temperatures 6, and one more for ln k_0."""
    return 4 + (2 if model.full else 0) + (1 if model.estimates_k_0 else 0)


@inlined
def place(i: int, model: FilterModel) -> int:
    """Index in `STATES` of the i-th state that a model uses; a reduced model has no temperatures."""
    return LN_K_0 if model.estimates_k_0 and i == state_count(model) - 1 else i


@inlined
def _with_k_0(model: FilterModel, ln_k_0: float) -> tuple[Lane, FullRow]:
    """Coefficients of a model, reduced and full order, whose wall heat is that of the estimated k_0."""
    lane, row = model.lane, model.full_row
    k = exp(ln_k_0) if model.estimates_k_0 else 1.0
    return (
        Lane(
            lane.n_V,
            lane.n_in,
            lane.n_out,
            lane.a,
            lane.mixing,
            lane.flow_scale,
            k * lane.wall_scale,
            lane.e_A,
            lane.e_PT,
            lane.full,
        ),
        FullRow(k * row.wall_scale, row.flow_scale, row.e_A, row.e_PT),
    )


@inlined
def chamber_rates(
    u: float,
    x: float,
    v: float,
    P: float,
    T: float,
    chamber: Chamber,
    plant: Plant,
    lane: Lane,
    row: FullRow,
    full: bool,
) -> tuple[float, float]:
    """Rates of a chamber's pressure, Pa/s, and temperature, K/s, by the full order or a reduced model.

    `lane` holds the coefficients of the reduced model, which takes T from eq (6); its second rate is 0. For
    chamber B, negate u, x and v.
    """
    if full:
        return full_row_rates(u, x, v, P, T, chamber, plant, row)
    T = temperature(P, plant.conditions.P_0, plant.conditions.T_0, lane.a)
    m_in, m_out = chamber_flows(u, P, T, plant.valve, plant.gas, plant.conditions)
    return lane_rate_with_flows(m_in, m_out, x, v, P, T, chamber, plant, lane), 0.0


@inlined
def model_rates(y: np.ndarray, u: float, plant: Plant, model: FilterModel, dy: np.ndarray) -> None:
    """Write the rates of `STATES` at the limited command u, V, into dy: eq (3) and the model."""
    c = plant.cylinder
    lane, row = _with_k_0(model, y[LN_K_0])
    dy[0], dy[1] = motion(y[0], y[1], acceleration(y[1], y[2], y[3], 0.0, c), c)
    A, B = chamber_of(c, Side.A), chamber_of(c, Side.B)
    dy[2], dy[4] = chamber_rates(u, y[0], y[1], y[2], y[4], A, plant, lane, row, model.full)
    dy[3], dy[5] = chamber_rates(-u, -y[0], -y[1], y[3], y[5], B, plant, lane, row, model.full)
    dy[LN_K_0] = 0.0


@inlined
def _limited(slope: float, most: float) -> float:
    return min(max(slope, -most), most)


@inlined
def _derivatives(
    y: np.ndarray, u: float, plant: Plant, model: FilterModel, h: float, A: np.ndarray, dy: np.ndarray
) -> None:
    """Write the rates of `model_rates` into dy, and their derivatives with respect to the states into A.

    Where a chamber has the pressure of its open port, the slope of eq (1) is infinite. So derivatives with
    respect to a chamber's pressure, and of its temperature's rate with respect to the temperature, are
    limited to 1 / h, in units of P_0 and T_0.
    """
    c, conditions = plant.cylinder, plant.conditions
    model_rates(y, u, plant, model, dy)
    A[:] = 0.0
    A[0, 1] = 1.0
    A[1, 1], A[1, 2], A[1, 3] = -c.k_f / c.M, c.A_A / c.M, -c.A_B / c.M  # of eq (3) in motion
    dx, dP = DX * c.stroke, DP * conditions.P_0
    lane, row = _with_k_0(model, y[LN_K_0])
    for side in range(2):
        sign, s = sign_of(side), 2 + side
        chamber = chamber_of(c, side)
        own_u, x, v, P, T = sign * u, sign * y[0], sign * y[1], y[s], y[s + 2]
        if model.full:
            P_x, T_x = full_row_rates(own_u, x + dx, v, P, T, chamber, plant, row)
            P_v, T_v = full_row_rates(own_u, x, v + DV, P, T, chamber, plant, row)
            P_P, T_P = full_row_rates(own_u, x, v, P + dP, T, chamber, plant, row)
            P_T, T_T = full_row_rates(own_u, x, v, P, T + DT, chamber, plant, row)
            A[s + 2, 0], A[s + 2, 1] = sign * (T_x - dy[s + 2]) / dx, sign * (T_v - dy[s + 2]) / DV
            steepest = conditions.T_0 / conditions.P_0 / h
            A[s + 2, s] = _limited((T_P - dy[s + 2]) / dP, steepest)
            A[s, s + 2], A[s + 2, s + 2] = (P_T - dy[s]) / DT, _limited((T_T - dy[s + 2]) / DT, 1 / h)
        else:
            T = temperature(P, conditions.P_0, conditions.T_0, lane.a)
            m_in, m_out = chamber_flows(own_u, P, T, plant.valve, plant.gas, conditions)
            P_x = lane_rate_with_flows(m_in, m_out, x + dx, v, P, T, chamber, plant, lane)
            P_v = lane_rate_with_flows(m_in, m_out, x, v + DV, P, T, chamber, plant, lane)
            P_P, _ = chamber_rates(own_u, x, v, P + dP, T, chamber, plant, lane, row, False)
        A[s, 0], A[s, 1] = sign * ((P_x - dy[s]) / dx), sign * ((P_v - dy[s]) / DV)
        A[s, s] = _limited((P_P - dy[s]) / dP, 1 / h)
        if model.estimates_k_0:
            other_lane, other_row = _with_k_0(model, y[LN_K_0] + DK)
            P_k, T_k = chamber_rates(own_u, x, v, P, T, chamber, plant, other_lane, other_row, model.full)
            A[s, LN_K_0] = (P_k - dy[s]) / DK
            A[s + 2, LN_K_0] = (T_k - dy[s + 2]) / DK


@inlined
def predict(
    y: np.ndarray,
    C: np.ndarray,
    u: float,
    plant: Plant,
    model: FilterModel,
    noise: Noise,
    h: float,
    W: np.ndarray,
) -> None:
    """Advance the estimate y and its covariance C in place by one sample, h s.

    u is the limited command held over the sample, V; W, shape (4, 7, 7), is work space.
    """
    A, F, FC, rates = W[0], W[1], W[2], W[3]
    count = state_count(model)
    _derivatives(y, u, plant, model, h, A, rates[0])
    v = y[1]
    for s in range(SIZE):
        rates[1, s] = y[s] + h / 2 * rates[0, s]
    model_rates(rates[1], u, plant, model, rates[0])
    for s in range(SIZE):
        y[s] += h * rates[0, s]
    y[0], y[1] = stopped(y[0], y[1], v, plant.cylinder)
    for a in range(count):
        i = place(a, model)
        for b in range(count):
            j, square = place(b, model), 0.0
            for c in range(count):
                k = place(c, model)
                square += A[i, k] * A[k, j]
            F[i, j] = (1.0 if i == j else 0.0) + h * A[i, j] + h * h / 2 * square
    for a in range(count):
        i = place(a, model)
        for b in range(count):
            j, total = place(b, model), 0.0
            for c in range(count):
                k = place(c, model)
                total += F[i, k] * C[k, j]
            FC[i, j] = total
    for a in range(count):
        i = place(a, model)
        for b in range(a + 1):
            j, total = place(b, model), 0.0
            for c in range(count):
                k = place(c, model)
                total += FC[i, k] * F[j, k]
            C[i, j] = total
            C[j, i] = total
    C[1, 1] += h * (noise.force / plant.cylinder.M) ** 2
    C[2, 2] += h * noise.pressure**2
    C[3, 3] += h * noise.pressure**2
    if model.full:
        T_noise = noise.pressure * plant.conditions.T_0 / plant.conditions.P_0
        C[4, 4] += h * T_noise**2
        C[5, 5] += h * T_noise**2
    if model.estimates_k_0:
        C[LN_K_0, LN_K_0] += h * K_0_NOISE**2
    _keep_possible(y, plant)


@inlined
def _keep_possible(y: np.ndarray, plant: Plant) -> None:
    """Limit the estimate y, in place, to plausible values.

    Pressures lie between half the atmosphere's and twice the supply's, temperatures between half and twice
    T_0, k_0 within a factor of ten of its first value.
    """
    for s in range(2, 4):
        y[s] = min(max(y[s], plant.conditions.P_atm / 2), 2 * plant.conditions.P_s)
    for s in range(4, 6):
        y[s] = min(max(y[s], plant.conditions.T_0 / 2), 2 * plant.conditions.T_0)
    y[LN_K_0] = _limited(y[LN_K_0], K_0_RANGE)


@inlined
def correct(
    y: np.ndarray, C: np.ndarray, s: int, measured: float, variance: float, model: FilterModel
) -> None:
    """Correct the estimate y and its covariance C in place by a reading of state s with a given variance."""
    S, difference, count = C[s, s] + variance, measured - y[s], state_count(model)
    gain = C[:, s] / S
    for a in range(count):
        i = place(a, model)
        y[i] += gain[i] * difference
        for b in range(a + 1):
            j = place(b, model)
            C[i, j] -= gain[i] * gain[j] * S
            C[j, i] = C[i, j]


@inlined
def correct_all(
    y: np.ndarray, C: np.ndarray, x: float, P: np.ndarray, plant: Plant, model: FilterModel, noise: Noise
) -> None:
    """Correct the estimate y and its covariance C in place by readings of position, m, and pressures, Pa.

    A reading that is NaN was not taken.
    """
    if x == x:
        correct(y, C, 0, x, noise.x_variance, model)
    for side in range(2):
        if P[side] == P[side]:
            correct(y, C, 2 + side, P[side], noise.pressure_variance, model)
    _keep_possible(y, plant)


@inlined
def first_estimate(x: float, first: np.ndarray, plant: Plant, noise: Noise) -> tuple[np.ndarray, np.ndarray]:
    """First estimate and its covariance: at rest at x, m, pressures `first`, Pa, T_0 and the plant's k_0."""
    y, C = np.zeros(SIZE), np.zeros((SIZE, SIZE))
    y[0], y[2], y[3] = x, first[0], first[1]
    y[4] = y[5] = plant.conditions.T_0
    C[0, 0], C[1, 1] = noise.x_variance, 1e-6
    C[2, 2] = C[3, 3] = FIRST_PRESSURE**2
    C[4, 4] = C[5, 5] = FIRST_TEMPERATURE**2
    C[LN_K_0, LN_K_0] = FIRST_LN_K_0**2
    return y, C


def estimated(
    x: np.ndarray,
    P: np.ndarray,
    u: np.ndarray,
    first: np.ndarray,
    model: FilterModel,
    plant: Plant,
    noise: Noise,
    h: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Estimates of `STATES` at every sample, corrected by its readings, and their variances: (samples, 7).

    Parameters
    ----------
    x, P : numpy.ndarray
        Readings: position, m, shape (samples,), and pressures, Pa, shape (samples, 2); NaN: not measured.
    u : numpy.ndarray
        Limited command held from each sample on, V.
    first : numpy.ndarray
        First estimate of P_A and P_B, Pa.
    """
    row, lane, samples = model.full_row, model.lane, len(x)
    if model.full:
        lane = full_order_lane(plant.gas.gamma, row.wall_scale, row.e_A, row.e_PT)
        lane = lane._replace(flow_scale=row.flow_scale)
    estimates, variances = np.empty((samples, SIZE)), np.zeros((samples, SIZE))
    core.lib.kalman_filter(
        core.array("x", x, (samples,)),
        core.array("P", P, (samples, 2)),
        core.array("u", u, (samples,)),
        core.array("first", first, (2,)),
        samples,
        core.struct("FilterModel", (model.estimates_k_0, lane)),
        core.struct("Plant", plant),
        core.struct("Noise", noise),
        h,
        core.out(estimates),
        core.out(variances),
    )
    return estimates, variances
