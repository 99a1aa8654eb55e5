"""Bench records whose truth is known: a cylinder, its valve and its sensors, with no code of pneumo.

The fit is judged on these records, so the physics stands here a second time: mass and internal energy of the
air in each chamber, a valve by ISO 6358, Coulomb friction, elastic stops. Numbers are in SI units.
"""

import subprocess
from ctypes import CDLL, c_double, c_long, c_void_p
from functools import cache
from math import exp, log, pi
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

R = 287.0  # of air, J/(kg K)
RHO_REF, T_REF = 1.185, 293.15  # kg/m^3, K: reference atmosphere of ISO 6358
P_ATM = 101325.0
U_MAX = 10.0  # V, command at which the valve is fully open
STEP = 5e-5  # s, of the classical Runge-Kutta method
CONTROL = 1e-3  # s, period of the controller and of the record
AT_STOP = 1.2  # s for which a target is beyond an end of the stroke
BEYOND = 0.75  # strokes from mid-stroke to such a target
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
    inlet: float = 0.0  # K, of the incoming air above T_amb
    stick: float = 0.0  # static over Coulomb friction, less 1
    bend: float = 0.0  # deviation of the opening from proportional at half command, over the largest


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


@cache
def _compiled() -> Any:
    """Function `bench_run` of bench_rig.c, compiled for this process."""
    with TemporaryDirectory() as folder:
        library = Path(folder, "bench_rig.so")
        source = Path(__file__).with_suffix(".c")
        command = [
            "cc",
            "-std=c99",
            "-O2",
            "-ffp-contract=off",
            "-shared",
            "-fPIC",
            "-o",
            library,
            source,
            "-lm",
        ]
        subprocess.run(command, check=True)
        return CDLL(str(library)).bench_run


def run_bench(
    rig: Rig, target: np.ndarray, gain: float, late: int, period: float, reverse: float = 0.0
) -> np.ndarray:
    """Follow a target of every control period, s; rows of u, x, P_A, P_B, P_s, v at the start of each.

    With a gain of 0 the target is the command, V, and points inward beyond `reverse`, m, from the centre.
    """
    rows, sent, target = (
        np.empty((len(target), 6)),
        np.empty(len(target)),
        np.ascontiguousarray(target, float),
    )
    numbers = np.array(rig, dtype=float)
    of = [a.ctypes.data_as(c_void_p) for a in (numbers, target, sent, rows)]
    count, steps = c_long(len(target)), c_long(round(period / STEP))
    of_time = c_double(gain), c_double(reverse), c_long(late), c_double(period), steps, c_double(STEP)
    _compiled()(of[0], of[1], count, *of_time, of[2], of[3])
    return rows


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
    rows = run_bench(rig, target, 1.5 * U_MAX / rig.stroke, round(rig.dead_time / period), period)[warm_up:]
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
