"""Configurations whose piston cannot move, or that no cylinder would survive: wrong units and signs.

In such a configuration each number is in its own range, but together they describe no actuator. No result
depends on this module: it only refuses configurations, and `--trust` skips it.
"""

from collections.abc import Iterator
from math import inf, radians, sin
from typing import Any

from pneumo.configuration.experiment import Plant
from pneumo.configuration.parameters import STANDARD_GRAVITY, Sources, plant_of
from pneumo.configuration.schema import Configuration, CylinderSection
from pneumo.errors import ConfigurationError

LEAST_MM = 1.0  # bore and stroke; the smallest of catalogues have 2.5 mm
ATMOSPHERE = (3e4, 1.2e5)  # Pa: on the highest mountain, and in a deep mine
FASTEST = 30.0  # m/s with the valve fully open: ten times the speed of fast pneumatic cylinders
SLOWEST = 1000.0  # s for a stroke
MOST_DEAD = 20.0  # volumes of a stroke, which then changes the pressure by 5 %
LEAST_ACCELERATION = 0.2  # m/s² of the mass by the air alone; axes reach 1 to 50
REMEDY = "correct it, or accept it with --trust (snakemake: --config trust=true)"

Path = tuple[Any, ...]
Implausible = tuple[Path, float, str]  # path, value and reason of a physically implausible value


def implausible(configuration: Configuration) -> Iterator[Implausible]:
    """Yield physically implausible values: of the supply if it has one, else the first of each cylinder.

    A piston is judged with the supply pressure on one side and the atmosphere on the other, and with the
    flow of the fully open valve.
    """
    P_atm, (low, high) = configuration.supply.P_atm_Pa, ATMOSPHERE
    if not low <= P_atm <= high:
        reason = f"no atmosphere, which has {low:g} to {high:g} Pa; is it in another unit?"
        yield ("supply", "P_atm_Pa"), P_atm, reason
        return
    c = configuration
    for cylinder, name in {c.experiments[name].cylinder: name for name in c.chosen}.items():
        for path, value, reason in _of_cylinder(c.cylinders[cylinder], plant_of(c, name)):
            yield ("cylinders", cylinder, *path), value, reason
            break


def _of_cylinder(section: CylinderSection, plant: Plant) -> Iterator[Implausible]:
    """Yield implausible values in a cylinder's section; their paths are relative to the section."""
    for key in ("bore_mm", "stroke_mm"):
        value = getattr(section, key)
        if value < LEAST_MM:
            yield (key,), value, f"below {LEAST_MM:g} mm"
    c, s = plant.cylinder, plant.conditions
    # Full supply pressure on one side of the piston, the atmosphere on the other.
    out, back = c.A_A * s.P_s - c.A_B * s.P_atm + c.load, c.A_B * s.P_s - c.A_A * s.P_atm - c.load
    bent = c.spring * c.stroke / 2  # lost towards either end: `load` has the spring's force in mid-stroke
    force = min(out, back) - bent - c.coulomb
    if force <= 0.0:
        air = (c.A_A if out < back else c.A_B) * (s.P_s - s.P_atm)
        against = {
            "load_N": abs(section.load_N),
            "mass_kg": abs(section.mass_kg * STANDARD_GRAVITY * sin(radians(section.incline_deg))),
            "coulomb_N": c.coulomb,
            "spring_N_per_m": 2 * bent + (section.spring_preload_N or 0.0),
        }
        key = max(against, key=lambda key: against[key])
        reason = f"the piston cannot move {'out' if out < back else 'back'}: at P_s_Pa = {s.P_s:g} the air"
        reason += f" pushes with {air:.3g} N, and load, weight, spring and Coulomb friction hold it"
        if key == "load_N":
            reason += "; is it a weight? then mass_kg and incline_deg"
        yield (key,), getattr(section, key), reason
        return
    speed = plant.speed
    opening: tuple[Path, float] = (("k_x_k_u_m2_per_V",), section.k_x_k_u_m2_per_V or 0.0)
    if section.valve is not None:
        key, value = section.valve.flow_as_given
        opening = (("valve", key), value)
    if speed > FASTEST:
        reason = f"fully open it moves the piston of {section.bore_mm:g} mm at {speed:.3g} m/s"
        yield *opening, f"{reason}, no cylinder survives {FASTEST:g} m/s"
    needed: dict[tuple[Path, float], float] = {  # s for a stroke, by what slows it down
        opening: c.stroke / speed if speed else inf,
        (("friction_Ns_per_m",), section.friction_Ns_per_m): c.stroke * c.k_f / force,
        (("mass_kg",), section.mass_kg): (2 * c.M * c.stroke / force) ** 0.5,
    }
    slowest = max(needed, key=lambda cause: needed[cause])
    if needed[slowest] > SLOWEST:
        reason = f"a stroke takes {needed[slowest]:.3g} s, more than {SLOWEST:g} s: the piston cannot move"
        yield *slowest, reason
    swept, air = c.A_A * c.stroke, min(c.A_A, c.A_B) * (s.P_s - s.P_atm)
    for key in ("dead_volume_m3", "dead_volume_B_m3"):
        volume = getattr(section, key) or 0.0
        if volume > MOST_DEAD * swept:
            reason = f"{volume / swept:.3g} times the {swept:.3g} m³ of a stroke; is it in litres?"
            yield (key,), volume, reason
    if air < LEAST_ACCELERATION * c.M:
        reason = f"the air, {air:.3g} N, accelerates it by {air / c.M:.3g} m/s² at most; is it in grams?"
        yield ("mass_kg",), section.mass_kg, reason


def checked(sources: Sources, *, trust: bool = False) -> Configuration:
    """Validate a configuration, as `Sources.validated`; unless `trust`, also refuse `implausible` values."""
    configuration, lines = sources.validated(), list[str]()
    for path, value, reason in [] if trust else implausible(configuration):
        about = {"value": value, "condition": reason, "fields": [path], "remedy": f"; {REMEDY}"}
        lines.append(sources.line({"type": "conflict", "loc": (), "input": value, "ctx": about}))
    if lines:
        raise ConfigurationError(*(lines if sources.table else lines[:1]))
    return configuration
