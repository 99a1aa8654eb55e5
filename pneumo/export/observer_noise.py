"""Noise that an exported observer expects, from observer_noise.json."""

import json
from pathlib import Path
from typing import NamedTuple

from pneumo.equations.system import System
from pneumo.errors import InputError
from pneumo.linear.observer import DP, DT, DV, DX, FIRST_PRESSURE, FIRST_TEMPERATURE, PRESSURE_NOISE

FILE = Path(__file__).with_name("templates") / "observer_noise.json"
READINGS = {"none": ("x",), "one": ("x", "P_A"), "both": ("x", "P_A", "P_B")}  # by pressures measured
CONSTANTS = ("P_s", "P_atm", "P_0", "T_0", "stroke", "M", "k_f", "A_A", "A_B")  # that a filter needs
STEPS = {"x": DX, "v": DV, "P": DP, "T": DT}  # of its derivatives: x over the stroke, P over P_0
FIRST_VARIANCES = {"v": 1e-6, "P": FIRST_PRESSURE**2, "T": FIRST_TEMPERATURE**2}


class ObserverNoise(NamedTuple):
    """Noise that an observer assumes, and which signals it reads."""

    force: float  #: process noise, N s^0.5
    pressure: float  #: process noise of the rates, Pa/s^0.5
    x_deviation: float  #: standard deviation of a reading, m
    pressure_deviation: float  #: likewise, Pa
    readings: tuple[str, ...]  #: names of the signals read
    origin: str  #: phrase that says where the process noise of the pressures comes from, for a comment


def observer_noise(system: System, sensors: str) -> ObserverNoise:
    """Noise for an observer of a system, as tuned for docs/choose.md.

    `sensors` says how many pressures are measured: "none", "one" or "both"; `InputError` for any other text.
    A model that was not tuned gets the process noise that is the default of `pneumo.ekf`.
    """
    if sensors not in READINGS:
        raise InputError(f"--observer {sensors}: must name the pressures measured: {', '.join(READINGS)}")
    kept, plant = json.loads(FILE.read_text(encoding="utf-8")), system.plant
    tuned = kept["pressure_noise"][sensors].get(system.model_name)
    best = f"best in {kept['loop']} loop, mean of {kept['plants']} plants at 1 ms; tune it on yours"
    return ObserverNoise(
        kept["force_noise_over_P_s_A_A"] * plant.conditions.P_s * plant.cylinder.A_A,
        tuned or PRESSURE_NOISE,
        kept["x_deviation"],
        kept["pressure_deviation"],
        READINGS[sensors],
        best if tuned else "not tuned for this model; tune it",
    )
