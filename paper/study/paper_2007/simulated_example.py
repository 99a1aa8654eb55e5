"""The simulated example: a closed chamber pushed to mid-stroke, and the seven steps applied to it.

The chamber is that of the full-order model, eqs (1) and (2); `READINGS` are the settings that the paper does
not print.
"""

import itertools
from math import pi
from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp

from paper.study.paper_2007.seven_steps import Conductance, Exponential, exponential, seven_steps
from pneumo.physics.chamber import dP_dt, dT_dt, wall_conductance, wall_heat
from pneumo.physics.cylinder import Cylinder, Side, chamber_of, heat_area, volume, wetted_area

# As printed: m, m^3, Pa, K, W/(m^2 K).
BORE, STROKE, V_D, P_AMB, T_AMB, LAMBDA_0 = 0.02, 0.1, 1.57e-6, 1e5, 293.0, 26.5
P_0, T_0 = 5.65e5, 293.0  # Pa, K
GAMMA, R, C_V = 1.4, 287.0, 718.0  # J/(kg K), ASSUME: not printed
PERIOD = 1e-3  # s, ASSUME: between samples of the regression
AREA = pi / 4 * BORE**2
CYLINDER = Cylinder(BORE, STROKE, AREA, AREA, V_D, V_D, M=1.5, k_f=100.0, x_min=0.0, x_max=STROKE / 2)
CHAMBER = chamber_of(CYLINDER, Side.A)
WALL_AREA = heat_area(0.0, CYLINDER)  # m^2, in mid-stroke
T_OVER_P = (
    volume(0.0, CHAMBER, CYLINDER) / volume(STROKE / 2, CHAMBER, CYLINDER) * T_AMB / P_AMB
)  # K/Pa, held
ACCURACY: dict[str, Any] = {"rtol": 1e-9, "atol": 1e-6, "method": "DOP853"}


Area = Literal["of 2006", "with dead volume"]  # wall in the simulation: without or with that of V_d


class Reading(NamedTuple):
    """One choice of the settings that the paper does not print."""

    area: Area
    final: Literal["free", "fixed"]  # final pressure of the regression: fitted, or that of the run
    push: float  # s, duration at constant speed
    window: float  # s, length of the regression, from the peak on


# Push and window were chosen with delta_P, tau and lambda_av in view.
TAKEN = Reading("of 2006", "free", 0.037, 5.05)
# Every combination is tried. A piston of 1.5 kg with 100 N s/m takes 30 to 50 ms under 150 to 250 N.
PUSHES, WINDOWS = (0.01, 0.02, TAKEN.push, 0.05, 0.1), (3.0, TAKEN.window, 8.0, 12.0)
AREAS: tuple[Area, ...] = ("of 2006", "with dead volume")
READINGS = [Reading(*r) for r in itertools.product(AREAS, ("free", "fixed"), PUSHES, WINDOWS)]
STEPS = ("P_f", "delta_P", "tau", *(name for name in Conductance._fields if name != "V_f"))


def wall_area(x: float, area: Area) -> float:
    """Heat transfer area of the simulation at x from mid-stroke, m^2."""
    if area == "of 2006":
        return heat_area(x, CYLINDER)
    return wetted_area(volume(x, CHAMBER, CYLINDER), BORE)


def response(area: Area, push: float, window: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time from the peak, s, pressure, Pa, and temperature, K, of the chamber that is pushed and held."""

    def rates(t: float, state: np.ndarray, speed: float) -> list[float]:
        P, T = state
        x = STROKE / 2 - speed * t if speed else 0.0
        V, dV_dt = volume(x, CHAMBER, CYLINDER), -AREA * speed
        conductance = wall_conductance(LAMBDA_0 * wall_area(x, area), 1.0, P * T / (P_0 * T_0), 0.0, 0.5)
        heat = wall_heat(T, conductance, T_AMB)  # (1), (2) of 2007
        rate_P = dP_dt(P, T, V, dV_dt, 0.0, 0.0, T_AMB, heat, GAMMA, GAMMA, GAMMA, R, GAMMA)
        return [rate_P, dT_dt(P, T, V, dV_dt, 0.0, 0.0, T_AMB, heat, R, GAMMA)]

    pushed = solve_ivp(rates, (0.0, push), [P_AMB, T_AMB], args=(STROKE / 2 / push,), **ACCURACY)
    t = PERIOD * np.arange(round(window / PERIOD) + 1)
    held = solve_ivp(rates, (0.0, t[-1]), pushed.y[:, -1], args=(0.0,), t_eval=t, **ACCURACY)
    return t, held.y[0], held.y[1]


def estimated(t: np.ndarray, P: np.ndarray, final: str) -> tuple[Exponential, Conductance]:
    """Regression of P, `final` pressure fitted (``free``) or isothermal, and result of the seven steps."""
    isothermal = P_AMB * volume(STROKE / 2, CHAMBER, CYLINDER) / volume(0.0, CHAMBER, CYLINDER)
    fit = exponential(t, P, isothermal if final == "fixed" else None)
    gas = {"bore": BORE, "T_amb": T_AMB, "c_v": C_V, "R": R, "P_0": P_0, "T_0": T_0}
    return fit, seven_steps(P_AMB, AREA * STROKE, AREA * STROKE / 2, fit[:3], **gas)


def example() -> xr.Dataset:
    """Pressure of the reading `TAKEN`, by `t`; seven steps of every reading, by `reading`.

    SI units; variables of the steps have the names of `seven_steps`.
    """
    rows: dict[Reading, list[float]] = {}
    for area, push in itertools.product(AREAS, PUSHES):
        t, P, _ = response(area, push, max(WINDOWS))
        for reading in (r for r in READINGS if (r.area, r.push) == (area, push)):
            seen = t <= reading.window + PERIOD / 2
            fit, steps = estimated(t[seen], P[seen], reading.final)
            numbers = steps._asdict() | {"P_f": fit.P_f, "delta_P": fit.delta_P, "tau": fit.tau}
            rows[reading] = [numbers[name] for name in STEPS]
    columns = np.array([rows[reading] for reading in READINGS]).T
    t, P, _ = response(TAKEN.area, TAKEN.push, TAKEN.window)
    about = {
        "area": ("", "wall of the simulation"),
        "final": ("", "final pressure of the regression"),
        "push": ("s", "duration of the push at constant speed"),
        "window": ("s", "length of the regression, from the peak on"),
        "P_f": ("Pa", "final pressure"),
        "delta_P": ("Pa", "change of pressure of the regression"),
        "tau": ("s", "thermal time constant"),
        "m": ("kg", "mass of air"),
        "V_d": ("m3", "estimated dead volume"),
        "k_av": ("W K-1", "mean conductance of the wall"),
        "A_q": ("m2", "estimated heat transfer area"),
        "lambda_av": ("W m-2 K-1", "mean heat transfer coefficient"),
        "t_ss": ("s", "settling time to 1 per cent"),
        "P_av": ("Pa", "mean pressure over the settling time"),
        "T_av": ("K", "mean temperature over the settling time"),
        "lambda_0": ("W m-2 K-1", "heat transfer coefficient at equilibrium"),
        "k_0": ("W K-1", "conductance of the wall at equilibrium"),
    }
    settings = dict(zip(Reading._fields, map(list, zip(*READINGS, strict=True)), strict=True))
    by_reading = settings | dict(zip(STEPS, columns, strict=True))
    example = xr.Dataset({name: ("reading", values) for name, values in by_reading.items()})
    for name, (unit, long_name) in about.items():
        example[name].attrs = {"long_name": long_name} | ({"units": unit} if unit else {})
    time = {"units": "s", "long_name": "time from the peak"}
    example = example.assign_coords(t=("t", t, time)).set_coords(list(settings))
    example["P"] = "t", P, {"units": "Pa", "long_name": "pressure in the reading that is taken"}
    return example.assign_attrs(taken=READINGS.index(TAKEN))
