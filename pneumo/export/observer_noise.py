"""Noise that an exported observer expects, from observer_noise.json.

`python -m benchmarks.observer_noise` writes that file.
"""

import json
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from pneumo.equations.system import System
from pneumo.errors import InputError
from pneumo.linear.observer import DP, DT, DV, DX, FIRST_PRESSURE, FIRST_TEMPERATURE, PRESSURE_NOISE

FILE = Path(__file__).with_name("templates") / "observer_noise.json"
SENSORS = {"none": 0, "one": 1, "both": 2}  # pressures measured beside the position


class ObserverNoise(NamedTuple):
    """Noise that an observer assumes, and which pressures it reads.

    Where `tuned` is false, the process noise of the pressures is the default of `pneumo.ekf`.
    """

    force: float  #: process noise, N s^0.5
    pressure: float  #: process noise of the rates, Pa/s^0.5
    x_deviation: float  #: standard deviation of a reading, m
    pressure_deviation: float  #: likewise, Pa
    pressures: int  #: number of pressures read: 0, 1 (P_A) or 2
    tuned: bool

    @property
    def readings(self) -> tuple[str, ...]:
        """Names of the signals that the observer reads: x, and no pressure, P_A, or P_A and P_B."""
        return READINGS[: 1 + self.pressures]

    @property
    def origin(self) -> str:
        """Phrase that says where the process noise of the pressures comes from, for a comment."""
        kept = _kept()
        best = f"best in {kept['loop']} loop, mean of {kept['plants']} plants at 1 ms; tune it on yours"
        return best if self.tuned else "not tuned for this model; tune it"


READINGS = ("x", "P_A", "P_B")
CONSTANTS = ("P_s", "P_atm", "P_0", "T_0", "stroke", "M", "k_f", "A_A", "A_B")  # that a filter needs
STEPS = {"x": DX, "v": DV, "P": DP, "T": DT}  # of its derivatives: x over the stroke, P over P_0
FIRST_VARIANCES = {"v": 1e-6, "P": FIRST_PRESSURE**2, "T": FIRST_TEMPERATURE**2}


@cache
def _kept() -> dict[str, Any]:
    return json.loads(FILE.read_text(encoding="utf-8"))


def observer_noise(system: System, sensors: str) -> ObserverNoise:
    """Noise for an observer of a system, as tuned for docs/choose.md.

    `sensors` says how many pressures are measured: "none", "one" or "both"; `InputError` for any other text.
    A model that was not tuned gets the process noise that is the default of `pneumo.ekf`.
    """
    if sensors not in SENSORS:
        raise InputError(f"--observer {sensors}: must name the pressures measured: {', '.join(SENSORS)}")
    kept, plant = _kept(), system.plant
    pressure = kept["pressure_noise"][sensors].get(system.name)
    return ObserverNoise(
        kept["force_noise_over_P_s_A_A"] * plant.conditions.P_s * plant.cylinder.A_A,
        pressure or PRESSURE_NOISE,
        kept["x_deviation"],
        kept["pressure_deviation"],
        SENSORS[sensors],
        pressure is not None,
    )
