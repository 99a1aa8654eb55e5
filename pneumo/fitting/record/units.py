"""Units as sensors, data sheets and loggers print them, and what they are in SI units.

The factors are compared with those of pint in the tests; pint itself takes 0.3 s to import.
"""

import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from pneumo.configuration.valve_conversions import ANR_RHO, ANR_T
from pneumo.physics.valve import GASES

LENGTHS = {
    **dict.fromkeys(("mm", "millimeter", "millimetre"), 1e-3),
    **{"m": 1.0, "cm": 1e-2, "um": 1e-6},
    **dict.fromkeys(("in", "inch", "inches"), 0.0254),
}
TIMES = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "usec", "microsecond", "microseconds"), 1e-6),
    **dict.fromkeys(("ns", "nsec", "nanosecond", "nanoseconds"), 1e-9),
    "100 ns": 1e-7,  # FILETIME, of Windows
    **dict.fromkeys(("min", "minute", "minutes"), 60.0),
    **dict.fromkeys(("h", "hr", "hour", "hours"), 3600.0),
    **dict.fromkeys(("d", "day", "days"), 86400.0),
}
PRESSURES = {
    **{"kPa": 1e3, "bar": 1e5, "Pa": 1.0, "MPa": 1e6, "mbar": 1e2, "hPa": 1e2, "psi": 6894.757293168361},
    **dict.fromkeys(("kgf/cm2", "kg/cm2", "kp/cm2"), 98066.5),
    **dict.fromkeys(("lbf/in2", "lb/in2"), 6894.757293168361),
    **{"N/mm2": 1e6, "inHg": 25.4 * 133.322387415},
    **{"atm": 101325.0, "Torr": 101325 / 760, "mmHg": 133.322387415},
    **{"mmH2O": 9.80665, "cmH2O": 98.0665, "inH2O": 25.4 * 9.80665},
}
TEMPERATURES = {  # factor and offset
    **dict.fromkeys(("K", "kelvin"), (1.0, 0.0)),
    **dict.fromkeys(("degC", "deg C", "C", "celsius"), (1.0, 273.15)),
    **dict.fromkeys(("degF", "deg F", "F", "fahrenheit"), (5 / 9, 273.15 - 32 * 5 / 9)),
}
MASSES = {"kg": 1.0, "g": 1e-3, "mg": 1e-6, "lb": 0.45359237}
VOLUMES = {
    **dict.fromkeys(("l", "L", "dm3", "liter", "litre"), 1e-3),
    **dict.fromkeys(("cm3", "ml", "mL", "cc"), 1e-6),
    "m3": 1.0,
    "ft3": 0.3048**3,
}
VOLTAGES = {"V": 1.0, "mV": 1e-3, **dict.fromkeys(("volt", "volts", "VDC", "V DC"), 1.0)}
QUANTITIES = ("t", "u", "x", "P_A", "P_B", "P_s", "m_A", "m_B", "T")
CHOICES = {  # written in messages, by quantity
    "t": "s, ms, us, ns, min, h",
    "u": "V, mV, %, mA 4..20, V 0..10, 0/1",
    "x": "mm, cm, m, um, in",
    **dict.fromkeys(
        ("P_A", "P_B", "P_s"),
        "Pa, hPa, kPa, MPa, mbar, bar, psi, kgf/cm2, atm, mmHg, Torr, cmH2O, inH2O, for a gauge bar(g)",
    ),
    **dict.fromkeys(
        ("m_A", "m_B"), "kg/s, g/s, mg/s, kg/h, Nl/min (0 degC, 1.01325 bar), l/min(ANR) (20 degC, 1 bar)"
    ),
    "T": "K, degC, degF",
}
PLAIN = str.maketrans(
    {"°": "deg", "µ": "u", "μ": "u", "²": "2", "³": "3", "–": "-", "−": "-", "…": "...", "℃": "degC"}
)
MARKED = re.compile(
    r"(?P<unit>.+?)[\s_.,-]*[\[(]?(?P<mark>absolute|abs|a|gauge|gage|g|relative|rel|ü|eff|e)\.?[\])]?",
    re.IGNORECASE,
)
VOLUME_FLOW = re.compile(
    rf"(?P<normal>norm|n)?\.?\s?(?P<volume>{'|'.join(VOLUMES)})(?P<behind>_?n)?/(?P<time>[a-z]+)"
    r"\s*(?P<anr>[\[(]?ANR[\])]?)?",
    re.IGNORECASE,
)
NUMBER = r"[+-]?\d+(?:\.\d+)?"
RANGE = re.compile(
    rf"(?P<before>V|mA|%)?\s*[\[(]?(?P<low>{NUMBER})\s*(?:\.\.\.?|to|-)\s*(?P<high>{NUMBER})[\])]?\s*(?P<behind>V|mA|%)?"
)
ON_OFF = "0/1"
RANGES = {"mA": "mA 4..20", **dict.fromkeys((ON_OFF, "bool", "boolean", "logical", "on/off"), "0..1")}
FULL_SCALE = re.compile(r"(?:%|percent)(?:\s*(?:of\s+)?(?:FS|F\.S|full[\s-]?scale))?", re.IGNORECASE)


class Surroundings(NamedTuple):
    """Constants of a rig that some units refer to."""

    P_atm: float = 101325.0  # Pa
    u_max: float = 1.0  # V, command at the end of the valve's range
    R: float = GASES["air"].R  # J/(kg K), of the gas whose volume flow was measured


STANDARD = Surroundings()


class Reading(NamedTuple):
    """How numbers are read: ``factor * number + offset`` in SI units."""

    factor: float
    offset: float
    text: str  # the unit in full


def plain_unit(text: str) -> str:
    """Unit without brackets, in ASCII: `degC` for `[°C]` or `(°C)`, `m/s` for `m s-1`."""
    text = " ".join(text.translate(PLAIN).split()).rstrip(".")
    if re.fullmatch(r"\[.*\]|\([^()]*\)", text):
        text = text[1:-1].strip()
    text = text.split(" since ")[0].replace("^", "").replace("**", "")
    return text.replace(" s-1", "/s").replace("_per_", "/")


def unit_name(unit: str, units: Iterable[str]) -> str:
    """Name of a unit in a table, its case ignored where that is not ambiguous (mPa); empty if unknown."""
    if unit in units:
        return unit
    alike = [name for name in units if name.lower() == unit.lower()]
    return alike[0] if len(alike) == 1 and unit != "mPa" else ""


def _pressure(unit: str, P_atm: float) -> Reading | None:
    """Reading of a pressure, absolute without a mark, gauge for `bar rel`."""
    marked = None if unit_name(unit, PRESSURES) else MARKED.fullmatch(unit)
    named = unit_name(marked["unit"].strip() if marked else unit, PRESSURES)
    mark = marked["mark"].lower() if marked else "a"
    if not named:
        return None
    absolute = mark.startswith("a")
    offset, kind = (0.0, "absolute") if absolute else (P_atm, "gauge")
    return Reading(PRESSURES[named], offset, f"{named} {kind}")


def _rate(unit: str, units: Mapping[str, float]) -> Reading | None:
    """Reading of one of some units over a time, such as kg/h."""
    above, _, below = unit.rpartition("/")
    named, time = unit_name(above.strip(), units), unit_name(below.strip(), TIMES)
    return Reading(units[named] / TIMES[time], 0.0, f"{named}/{time}") if named and time else None


def _command(unit: str, u_max: float) -> Reading | None:
    if named := unit_name(unit, VOLTAGES):
        return Reading(VOLTAGES[named], 0.0, named)
    unit = re.sub(r"(?:±|\+/-)\s*(\d+)", r"-\1..\1", unit)
    if FULL_SCALE.fullmatch(unit):
        return Reading(u_max / 100, 0.0, f"% of {u_max:g} V")
    match = RANGE.fullmatch(RANGES.get(unit_name(unit, RANGES), unit))
    if not match or not float(match["low"]) < float(match["high"]):
        return None
    low, high = float(match["low"]), float(match["high"])
    factor = 2 * u_max / (high - low)
    text = f"{match['before'] or match['behind'] or ''} {low:g}..{high:g} for {-u_max:g}..{u_max:g} V"
    return Reading(factor, -u_max - factor * low, text.strip())


def _flow(unit: str, R: float) -> Reading | None:
    """Reading of a mass flow, or of a volume flow at 0 degC and 1.01325 bar or in the state ANR."""
    if found := _rate(unit, MASSES):
        return found
    match = VOLUME_FLOW.fullmatch(unit)
    per = _rate(f"{match['volume']}/{match['time']}", VOLUMES) if match else None
    if not match or not per:
        return None
    if match["anr"]:
        density = ANR_RHO if abs(R / GASES["air"].R - 1) < 0.01 else 1e5 / (R * ANR_T)
        return Reading(per.factor * density, 0.0, f"{unit}: {density:.4g} kg/m3")
    if match["normal"] or match["behind"]:
        density = 101325.0 / (R * 273.15)
        return Reading(per.factor * density, 0.0, f"{unit}: 0 degC, 1.01325 bar, {density:.4g} kg/m3")
    return None


def reading(quantity: str, text: str, around: Surroundings = STANDARD) -> Reading | str:
    """How numbers of a quantity in a unit are read; else one line on what to write instead."""
    unit = plain_unit(text)
    found: Reading | None = None
    table = {"t": TIMES, "x": LENGTHS}.get(quantity, {})
    if named := unit_name(unit, table):
        found = Reading(table[named], 0.0, named)
    elif quantity.startswith("P_"):
        found = _pressure(unit, around.P_atm)
    elif quantity == "T" and (named := unit_name(unit, TEMPERATURES)):
        found = Reading(*TEMPERATURES[named], named)
    elif quantity.startswith("m_"):
        found = _flow(unit, around.R)
    elif quantity == "u":
        found = _command(unit, around.u_max)
    if found is not None:
        return found
    problem = f"unknown unit {unit[:40]!r}" if unit else "no unit in the header"
    hint = ""
    if unit in ("mA", "V", "mV", "%", "counts"):
        hint = "; of a converter, give the unit it measures, and `scale` and `offset`, in --columns"
    return f"{problem}; the units are {CHOICES[quantity]}{hint}"


def is_unit(text: str) -> bool:
    """Whether some quantity may have this unit."""
    unit = plain_unit(text)
    quantities = ("t", "u", "x", "P_A", "m_A", "T")
    return bool(unit) and any(isinstance(reading(quantity, unit), Reading) for quantity in quantities)
