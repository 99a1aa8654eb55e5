"""Bench records whose truth is known: a cylinder, its valve and its sensors, with no code of pneumo.

The fit is judged on these records, so the physics stands here a second time: mass and internal energy of the
air in each chamber, a valve by ISO 6358, Coulomb friction, elastic stops. Numbers are in SI units.
"""

from math import exp, log, pi, sqrt, tanh
from typing import NamedTuple

import numpy as np
from numba import njit

R, C_V, C_P = 287.0, 717.5, 1004.5  # of air, J/(kg K)
RHO_REF, T_REF = 1.185, 293.15  # kg/m^3, K: reference atmosphere of ISO 6358
P_ATM = 101325.0
U_MAX = 10.0  # V, command at which the valve is fully open
STEP = 5e-5  # s, of the classical Runge-Kutta method
CONTROL = 1e-3  # s, period of the controller and of the record
LAMINAR = 0.999  # pressure ratio above which flow is proportional to the pressure difference
STOP_STIFFNESS, STOP_DAMPING = 1e6, 1e3  # N/m, N s/m
STICTION = 1e-3  # m/s, speed below which Coulomb friction falls to zero
AT_STOP = 1.2  # s for which a target is beyond an end of the stroke
BEYOND = 0.75  # strokes from mid-stroke to such a target
CAPACITY = 5e-4  # m^3, of the line behind a weak supply
PRESSURE_NOISE, POSITION_NOISE = 1e3, 2e-5  # Pa, m: standard deviations of the sensors


class Rig(NamedTuple):
    """A bench: all that is true of it."""

    bore: float
    rod: float
    stroke: float
    mass: float
    coulomb: float  # N
    viscous: float  # N s/m
    C: float  # m^3/(s Pa), sonic conductance, fully open
    b: float  # critical pressure ratio
    k_0: float  # W/K, conductance of a wall in mid-stroke at P_0 and T_amb
    V_A: float  # dead volumes, with tubes
    V_B: float
    P_s: float  # supply, absolute
    P_0: float
    T_amb: float = 293.15
    exhaust: float = 1.0  # area to the atmosphere over that from the supply
    lag: float = 0.0  # s, time constant of the valve's opening
    dead_time: float = 0.0  # s, from command to valve
    null: float = 0.0  # V, command at which the valve is shut
    weak_supply: float = 0.0  # conductance of the supply line over C; 0: the supply never sags
    e_A: float = 1.0  # exponents of the wall's area and of P T in the law of its conductance
    e_PT: float = 0.5
    side_B: float = 1.0  # C of the valve's side of B over that of A
    dead_band: float = 0.0  # V, command to either side of the null that opens nothing
    hysteresis: float = 0.0  # V, play between command and spool, to either side
    piston_leak: float = 0.0  # conductance past the piston over C
    valve_leak: float = 0.0  # conductance of each closed path over C
    warming: float = 0.0  # K/s, of wall and incoming air


def drawn_rig(rng: np.random.Generator) -> Rig:
    """Draw a bench of usual sizes."""
    bore = float(rng.choice([0.025, 0.032, 0.04, 0.05]))
    stroke, area = rng.uniform(0.15, 0.32), pi / 4 * bore**2
    speed = rng.uniform(0.4, 2.5)  # m/s, that the valve can feed at 0.8 P_s
    dead = rng.uniform(0.03, 0.08, 2) * area * stroke
    P_s = rng.uniform(5.5e5, 8.5e5)
    wall = pi / 2 * bore**2 + pi * bore * stroke / 2
    return Rig(
        bore=bore,
        rod=0.4 * bore,
        stroke=stroke,
        mass=rng.uniform(1.0, 5.0) * (bore / 0.032) ** 2,
        coulomb=rng.uniform(0.01, 0.04) * area * 5e5,
        viscous=rng.uniform(20.0, 80.0),
        C=0.8 * area * speed / (RHO_REF * R * T_REF),
        b=rng.uniform(0.2, 0.45),
        k_0=wall * exp(rng.uniform(log(20.0), log(80.0))),  # W/(m^2 K) times the area
        V_A=float(dead[0]),
        V_B=float(dead[1]),
        P_s=P_s,
        P_0=0.8 * P_s,
    )


def purpose_rig() -> Rig:
    """The bench that a first user tried: 32 x 200 mm, rod 12 mm, 2.4 dm^3/(s bar), 0.6 W/K."""
    return Rig(0.032, 0.012, 0.2, 2.0, 15.0, 40.0, 2.4e-8, 0.28, 0.6, 9e-6, 11e-6, 7e5, 5.6e5)


@njit(cache=True)
def _flow(C: float, b: float, P_1: float, P_2: float, T_1: float) -> float:
    """ISO 6358: mass flow from P_1 to the lower P_2, kg/s."""
    sonic, ratio = C * RHO_REF * P_1 * sqrt(T_REF / T_1), P_2 / P_1
    if ratio <= b:
        return sonic
    if ratio > LAMINAR:
        return sonic * sqrt(1 - ((LAMINAR - b) / (1 - b)) ** 2) * (1 - ratio) / (1 - LAMINAR)
    return sonic * sqrt(1 - ((ratio - b) / (1 - b)) ** 2)


@njit(cache=True)
def _spool(u: float, rig: Rig) -> float:
    """Opening of the valve at rest, -1 to 1, at a command, V."""
    beyond = u - rig.null
    return max(abs(beyond) - rig.dead_band, 0.0) * (1.0 if beyond > 0 else -1.0) / U_MAX


@njit(cache=True)
def _through(C: float, b: float, P_1: float, P_2: float, T_1: float, T_2: float) -> float:
    """Mass flow from 1 to 2, kg/s, negative where it goes back."""
    return _flow(C, b, P_1, P_2, T_1) if P_1 >= P_2 else -_flow(C, b, P_2, P_1, T_2)


@njit(cache=True)
def _rates(y: np.ndarray, u: float, time: float, rig: Rig, dy: np.ndarray) -> None:
    """Rates of x, v, opening, supply pressure, and mass and internal energy of the air in A and B."""
    x, v, opening, P_s = y[0], y[1], y[2], y[3]
    T_amb = rig.T_amb + rig.warming * time
    pressures, temperatures = (0.0, 0.0), (0.0, 0.0)
    area = pi / 4 * rig.bore**2
    areas = (area, area - pi / 4 * rig.rod**2)
    wall_mid = pi / 2 * rig.bore**2 + pi * rig.bore * rig.stroke / 2
    drawn, force = 0.0, -P_ATM * (areas[0] - areas[1])
    for side in range(2):
        sign = 1.0 - 2.0 * side
        dead = rig.V_A if side == 0 else rig.V_B
        reach = rig.stroke / 2 + sign * x
        V, m, U = dead + areas[side] * reach, y[4 + 2 * side], y[5 + 2 * side]
        T = U / (m * C_V)
        P = m * R * T / V
        gain = rig.C * abs(opening) * (1.0 if side == 0 else rig.side_B)
        from_supply = rig.valve_leak * rig.C + (gain if sign * opening >= 0 else 0.0)
        to_exhaust = rig.valve_leak * rig.C + (rig.exhaust * gain if sign * opening < 0 else 0.0)
        fed = _through(from_supply, rig.b, P_s, P, T_amb, T)
        vented = _through(to_exhaust, rig.b, P, P_ATM, T, T_amb)
        drawn += fed
        enthalpy = C_P * (fed * (T_amb if fed > 0 else T) - vented * (T if vented > 0 else T_amb))
        wall = pi / 2 * rig.bore**2 + pi * rig.bore * reach
        k = rig.k_0 * (wall / wall_mid) ** rig.e_A * (P * T / (rig.P_0 * rig.T_amb)) ** rig.e_PT
        dy[4 + 2 * side] = fed - vented
        dy[5 + 2 * side] = enthalpy + k * (T_amb - T) - P * sign * areas[side] * v
        force += sign * P * areas[side]
        pressures, temperatures = (pressures[1], P), (temperatures[1], T)
    if rig.piston_leak > 0:
        (P_A, P_B), (T_A, T_B) = pressures, temperatures
        leak = _through(rig.piston_leak * rig.C, rig.b, P_A, P_B, T_A, T_B)
        enthalpy = C_P * leak * (T_A if leak > 0 else T_B)
        dy[4] -= leak
        dy[5] -= enthalpy
        dy[6] += leak
        dy[7] += enthalpy
    beyond = max(x - rig.stroke / 2, 0.0) + min(x + rig.stroke / 2, 0.0)
    if beyond != 0:
        force -= STOP_STIFFNESS * beyond + STOP_DAMPING * v
    dy[0] = v
    dy[1] = (force - rig.coulomb * tanh(v / STICTION) - rig.viscous * v) / rig.mass
    wanted = _spool(u, rig)
    dy[2] = (wanted - opening) / rig.lag if rig.lag > 0 else 0.0
    dy[3] = 0.0
    if rig.weak_supply > 0:
        feed = _flow(rig.weak_supply * rig.C, rig.b, rig.P_s, P_s, T_amb) if rig.P_s > P_s else 0.0
        dy[3] = R * T_amb / CAPACITY * (feed - drawn)


@njit(cache=True)
def _run(rig: Rig, target: np.ndarray, gain: float, late: int, period: float) -> np.ndarray:
    """Follow a target of every control period, s; rows of u, x, P_A, P_B, P_s at the start of each."""
    area = pi / 4 * rig.bore**2
    areas = (area, area - pi / 4 * rig.rod**2)
    y, dy, k, trial = np.zeros(8), np.zeros(8), np.zeros((4, 8)), np.zeros(8)
    y[3] = rig.P_s
    for side in range(2):
        dead = rig.V_A if side == 0 else rig.V_B
        y[4 + 2 * side] = rig.P_0 * (dead + areas[side] * rig.stroke / 2) / (R * rig.T_amb)
        y[5 + 2 * side] = y[4 + 2 * side] * C_V * rig.T_amb
    result, spool = np.empty((len(target), 5)), 0.0
    sent = np.empty(len(target))
    for n in range(len(target)):
        for side in range(2):
            sign = 1.0 - 2.0 * side
            dead = rig.V_A if side == 0 else rig.V_B
            V = dead + areas[side] * (rig.stroke / 2 + sign * y[0])
            result[n, 2 + side] = y[5 + 2 * side] * (R / C_V) / V
        sent[n] = min(max(gain * (target[n] - y[0]), -U_MAX), U_MAX)
        result[n, 0], result[n, 1] = sent[n], y[0]
        result[n, 4] = y[3]
        u = sent[max(n - late, 0)]
        spool = min(max(spool, u - rig.hysteresis), u + rig.hysteresis)
        if rig.lag == 0:
            y[2] = _spool(spool, rig)
        for step in range(round(period / STEP)):
            for stage in range(4):
                part = (0.0, 0.5, 0.5, 1.0)[stage] * STEP
                trial[:] = y + part * k[stage - 1] if stage > 0 else y
                _rates(trial, spool, n * period + step * STEP, rig, dy)
                k[stage] = dy
            y += STEP / 6 * (k[0] + 2 * k[1] + 2 * k[2] + k[3])
    return result


def bench_record(
    rig: Rig,
    rng: np.random.Generator,
    duration: float,
    period: float = CONTROL,
    noise: tuple[float, float] = (PRESSURE_NOISE, POSITION_NOISE),
    stops: bool = False,
) -> dict[str, np.ndarray]:
    """Columns t, u, x, P_A, P_B, P_s: random targets under a proportional controller, noise on top.

    The controller's `period`, s, is that of the record; `noise` is in Pa and m. The run is one second longer;
    its start from rest is cut off. With `stops`, the last two targets are beyond both ends of the stroke.
    """
    warm_up = round(1.0 / period)
    target = np.empty(warm_up + round(duration / period) + 1)
    at = 0
    while at < len(target):
        hold = round(rng.uniform(0.2, 1.0) / period)
        target[at : at + hold] = rng.uniform(-0.42, 0.42) * rig.stroke
        at += hold
    if stops:
        held = round(AT_STOP / period)
        target[-2 * held : -held], target[-held:] = BEYOND * rig.stroke, -BEYOND * rig.stroke
    rows = _run(rig, target, 1.5 * U_MAX / rig.stroke, round(rig.dead_time / period), period)[warm_up:]
    count = len(rows)
    return {
        "t": period * np.arange(count),
        "u": rows[:, 0],
        "x": rows[:, 1] + rng.normal(0.0, noise[1], count),
        **{
            name: rows[:, 2 + i] + rng.normal(0.0, noise[0], count)
            for i, name in enumerate(("P_A", "P_B", "P_s"))
        },
    }
