# pyright: basic
"""Extended Kalman filter with a reduced model: estimates piston motion and both pressures.

States (x, v, P_A, P_B) by eq (3) and the model; one step of the midpoint rule from sample to sample.
"""

from typing import NamedTuple

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.evidence.at_work.sampled_plant import PRESSURE_VARIANCE, X_VARIANCE
from pneumo.linear.linear_model import linearise
from pneumo.physics.cylinder import Side, acceleration, chamber_of, motion, sign_of, stopped
from pneumo.physics.models import MODELS, Lane, temperature
from pneumo.physics.valve import chamber_flows
from pneumo.simulation.compiled import inlined, kernel
from pneumo.simulation.full_order import copy_state
from pneumo.simulation.reference import lane_of, lane_rate, lane_rate_with_flows

STATES = 4
FIRST_PRESSURE = 2e4  # Pa, standard deviation of the first estimate of either pressure
DX, DV, DP = 1e-4, 1e-2, 1e-3  # steps of the derivatives: over the stroke; m/s; over P_0


class Noise(NamedTuple):
    """Process noise of a filter, white."""

    force: float  #: N s^0.5, on the piston
    pressure: float  #: Pa/s^0.5, on the rate of either pressure


@inlined
def model_rates(y: np.ndarray, u: float, plant: Plant, lane: Lane, dy: np.ndarray) -> None:
    """Write the rates of (x, v, P_A, P_B) at the limited command u, V, into dy: eq (3) and the model."""
    c = plant.cylinder
    dy[0], dy[1] = motion(y[0], y[1], acceleration(y[1], y[2], y[3], 0.0, c), c)
    dy[2] = lane_rate(u, y[0], y[1], y[2], chamber_of(c, Side.A), plant, lane)
    dy[3] = lane_rate(-u, -y[0], -y[1], y[3], chamber_of(c, Side.B), plant, lane)


@inlined
def _derivatives(
    y: np.ndarray, u: float, plant: Plant, lane: Lane, h: float, A: np.ndarray, dy: np.ndarray
) -> None:
    """Write the rates of `model_rates` into dy and their derivatives by the states into A.

    A pressure's rate has no derivative by that pressure at equal pressures, eq (1): it is limited to -1/h.
    """
    c, conditions = plant.cylinder, plant.conditions
    dy[0], dy[1] = motion(y[0], y[1], acceleration(y[1], y[2], y[3], 0.0, c), c)
    A[:] = 0.0
    A[0, 1] = 1.0
    A[1, 1], A[1, 2], A[1, 3] = -c.k_f / c.M, c.A_A / c.M, -c.A_B / c.M  # of eq (3) in motion
    dx, dP = DX * c.stroke, DP * conditions.P_0
    for side in range(2):
        sign, s = sign_of(side), 2 + side
        chamber = chamber_of(c, side)
        own_u, x, v, P = sign * u, sign * y[0], sign * y[1], y[s]
        T = temperature(P, conditions.P_0, conditions.T_0, lane.a)
        m_in, m_out = chamber_flows(own_u, P, T, plant.valve, plant.gas, conditions)
        rate = lane_rate_with_flows(m_in, m_out, x, v, P, T, chamber, plant, lane)
        by_x = (lane_rate_with_flows(m_in, m_out, x + dx, v, P, T, chamber, plant, lane) - rate) / dx
        by_v = (lane_rate_with_flows(m_in, m_out, x, v + DV, P, T, chamber, plant, lane) - rate) / DV
        by_P = (lane_rate(own_u, x, v, P + dP, chamber, plant, lane) - rate) / dP
        A[s, 0], A[s, 1], A[s, s] = sign * by_x, sign * by_v, min(max(by_P, -1 / h), 1 / h)
        dy[s] = rate


@inlined
def predict(
    y: np.ndarray, C: np.ndarray, u: float, plant: Plant, lane: Lane, noise: Noise, h: float, W: np.ndarray
) -> None:
    """Advance the estimate y and its covariance C by a sample of h s; W, shape (4, 4, 4), is work space."""
    A, F, FC, rates = W[0], W[1], W[2], W[3]
    _derivatives(y, u, plant, lane, h, A, rates[0])
    v = y[1]
    for s in range(STATES):
        rates[1, s] = y[s] + h / 2 * rates[0, s]
    model_rates(rates[1], u, plant, lane, rates[0])
    for s in range(STATES):
        y[s] += h * rates[0, s]
    y[0], y[1] = stopped(y[0], y[1], v, plant.cylinder)
    for i in range(STATES):
        for j in range(STATES):
            square = 0.0
            for k in range(STATES):
                square += A[i, k] * A[k, j]
            F[i, j] = (1.0 if i == j else 0.0) + h * A[i, j] + h * h / 2 * square
    for i in range(STATES):
        for j in range(STATES):
            total = 0.0
            for k in range(STATES):
                total += F[i, k] * C[k, j]
            FC[i, j] = total
    for i in range(STATES):
        for j in range(i + 1):
            total = 0.0
            for k in range(STATES):
                total += FC[i, k] * F[j, k]
            C[i, j] = total
            C[j, i] = total
    C[1, 1] += h * (noise.force / plant.cylinder.M) ** 2
    C[2, 2] += h * noise.pressure**2
    C[3, 3] += h * noise.pressure**2
    _keep_possible(y, plant)


@inlined
def _keep_possible(y: np.ndarray, plant: Plant) -> None:
    """Keep the pressures between half the atmosphere's and twice the supply's."""
    for s in range(2, STATES):
        y[s] = min(max(y[s], plant.conditions.P_atm / 2), 2 * plant.conditions.P_s)


@inlined
def correct(y: np.ndarray, C: np.ndarray, s: int, measured: float, variance: float) -> None:
    """Correct the estimate by a measurement of state s of this variance."""
    S, difference = C[s, s] + variance, measured - y[s]
    gain = C[:, s] / S
    for i in range(STATES):
        y[i] += gain[i] * difference
        for j in range(i + 1):
            C[i, j] -= gain[i] * gain[j] * S
            C[j, i] = C[i, j]


@inlined
def first_covariance() -> np.ndarray:
    """Covariance of the first estimate: at rest, position read, pressures uncertain."""
    C = np.zeros((STATES, STATES))
    C[0, 0], C[1, 1] = X_VARIANCE, 1e-6
    C[2, 2] = C[3, 3] = FIRST_PRESSURE**2
    return C


@inlined
def correct_all(
    y: np.ndarray, C: np.ndarray, x: float, P: np.ndarray, measured_pressures: int, plant: Plant
) -> None:
    """Correct the estimate by the position, m, and by no, one (P_A) or both pressures, Pa."""
    correct(y, C, 0, x, X_VARIANCE)
    for side in range(measured_pressures):
        correct(y, C, 2 + side, P[side], PRESSURE_VARIANCE)
    _keep_possible(y, plant)


@kernel
def estimated(
    x: np.ndarray,
    P: np.ndarray,
    u: np.ndarray,
    measured_pressures: int,
    first: np.ndarray,
    row: np.ndarray,
    plant: Plant,
    noise: Noise,
    h: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Estimates of (x, v, P_A, P_B) at every sample, and the last covariance.

    Parameters
    ----------
    x, P : numpy.ndarray
        Readings: position, m, shape (samples,), and pressures, Pa, shape (samples, 2).
    u : numpy.ndarray
        Limited command held from each sample on, V.
    measured_pressures : int
        0: none; 1: P_A; 2: both.
    first : numpy.ndarray
        First estimate of P_A and P_B, Pa.
    row : numpy.ndarray
        The model: a row of `pneumo.physics.models.lane_array`.
    """
    lane, estimates = lane_of(row), np.empty((len(x), STATES))
    y, C, W = np.empty(STATES), first_covariance(), np.empty((4, STATES, STATES))
    y[0], y[1], y[2], y[3] = x[0], 0.0, first[0], first[1]
    for k in range(len(x)):
        correct_all(y, C, x[k], P[k], measured_pressures, plant)
        copy_state(y, estimates[k])
        predict(y, C, u[k], plant, lane, noise, h, W)
    return estimates, C


class Observability(NamedTuple):
    """Observability of an actuator from a set of sensors, by linear models."""

    rank: int  #: least rank of the scaled observability matrix; 4 is observable
    #: Standard deviation of P_A and P_B, Pa, that the samples leave to a perfect linear model without process
    #: noise; root mean square over the operating points.
    deviation: np.ndarray


def observability(
    model: str, n: float, plant: Plant, measured_pressures: int, duration: float = 0.5, h: float = 1e-3
) -> Observability:
    """Observability of (x, v, P_A, P_B) from x and no, one (P_A) or both pressures, by linear models.

    They are linearised at six points: x = -0.3, 0, 0.3 strokes and u = -0.1, 0.1 u_max, at P_0 and 0.05 m/s.
    """
    scale = np.array([plant.cylinder.stroke, 1.0, plant.conditions.P_0, plant.conditions.P_0])
    variance = np.array([X_VARIANCE, PRESSURE_VARIANCE, PRESSURE_VARIANCE])[: 1 + measured_pressures]
    outputs = np.eye(STATES)[[0, 2, 3][: 1 + measured_pressures]]
    P_0, squares, ranks = plant.conditions.P_0, list[np.ndarray](), list[int]()
    index = n if MODELS[model].has_n else None
    for x in (-0.3, 0.0, 0.3):
        for u in (-0.1, 0.1):
            place, open_valve = x * plant.cylinder.stroke, u * plant.valve.u_max
            point = {"u": open_valve, "x": place, "v": 0.05, "P_A": P_0, "P_B": P_0}
            A = np.asarray(linearise(model, index, plant, **point, states="actuator").A)
            F = np.eye(STATES) + h * A + h**2 / 2 * A @ A
            information, reach = np.zeros((STATES, STATES)), outputs.copy()
            for _ in range(round(duration / h)):
                weighted = reach * scale / np.sqrt(variance)[:, None]
                information += weighted.T @ weighted
                reach = reach @ F
            squares.append(scale[2:] ** 2 * np.diag(np.linalg.inv(information))[2:])
            scaled, rate = A * scale / scale[:, None], np.abs(np.linalg.eigvals(A)).max()
            powers = [outputs @ np.linalg.matrix_power(scaled / rate, k) for k in range(STATES)]
            ranks.append(int(np.linalg.matrix_rank(np.vstack(powers))))
    return Observability(min(ranks), np.sqrt(np.mean(squares, axis=0)))
