"""A rig as its user writes it: every quantity is a number, or two numbers between which it is fitted.

`quantities.csv` is the one table of what a rig may have. Parts that are not named are not there: without
`hose_volume_mL` there is no hose, without `dead_volume_B_mL` one chamber.
"""

from collections.abc import Mapping
from csv import DictReader
from difflib import get_close_matches
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

from pneumo.configuration.plain_yaml import read_yaml
from pneumo.errors import ConfigurationError, printable, shown
from pneumo.physics.valve import GASES, Gas
from pneumo.quantities import table

SENSORS = ("valve", "chamber")  # ends of a hose
UNITS = {  # by the end of a key: factor to SI units, SI unit, and unit in tables
    "": (1.0, "1", ""),
    "L": (1e-3, "m3", "L"),
    "mL": (1e-6, "m3", "mL"),
    "mm": (1e-3, "m", "mm"),
    "ms": (1e-3, "s", "ms"),
    "s": (1.0, "s", "s"),
    "K": (1.0, "K", "K"),
    "bar": (1e5, "Pa", "bar"),
    "dm3_per_sbar": (1e-8, "m3 s-1 Pa-1", "dm³/(s bar)"),
    "W_per_K": (1.0, "W K-1", "W/K"),
    "J_per_K": (1.0, "J K-1", "J/K"),
}
Ends = tuple[float, float]  # of a quantity; equal where it is known


class Quantity(NamedTuple):
    """Quantity that a rig may have; its key in the file is name_unit."""

    unit: str
    low: float  # least allowed, in that unit
    high: float
    default: float | None  # in that unit; None: absent
    meaning: str
    needs: tuple[str, ...] = ()  # quantities that must be given with it


def _quantity(row: Mapping[str, str]) -> Quantity:
    default = float(row["default"]) if row["default"] else None
    needs = tuple(row["needs"].split())
    return Quantity(row["unit"], float(row["low"]), float(row["high"]), default, row["meaning"], needs)


with Path(__file__).with_name("quantities.csv").open(encoding="utf-8", newline="") as _file:
    QUANTITIES = {row["name"]: _quantity(row) for row in DictReader(_file)}
AT_MOST_ONE = (("volume", "bore"), ("orifice", "valve_C_in"))
TEXTS = {"gas": tuple(GASES), "sensor": SENSORS}


def key(name: str) -> str:
    """Key of a quantity in a file, with its unit."""
    unit = QUANTITIES[name].unit
    return f"{name}_{unit}" if unit else name


def factor(name: str) -> float:
    """Factor from the unit of a quantity's key to SI units."""
    return UNITS[QUANTITIES[name].unit][0]


def fitted_quantity(name: str) -> table.Quantity:
    """Names and units of a fitted quantity, in warnings and tables."""
    _, unit, shown = UNITS[QUANTITIES[name].unit]
    return table.Quantity(key(name), name, unit, shown, 1 / factor(name))


class Rig(NamedTuple):
    """Quantities of a rig, known or fitted, in SI units, with its gas and sensor."""

    gas: Gas
    sensor: str  # end of the hose at which the pressure is measured
    ends: dict[str, Ends]  # of every quantity that it has

    def has(self, name: str) -> bool:
        """Whether the rig has a quantity that may be absent."""
        return name in self.ends

    def changed(self, **ends: Ends | float) -> "Rig":
        """The rig with other quantities, SI units: each two ends, or one number if the quantity is known."""
        pairs = {name: end if isinstance(end, tuple) else (end, end) for name, end in ends.items()}
        return self._replace(ends=self.ends | pairs)

    def without(self, *names: str) -> "Rig":
        """The rig without some quantities."""
        return self._replace(ends={name: ends for name, ends in self.ends.items() if name not in names})


def read_rig(file: Path) -> Rig:
    """Rig from a YAML file.

    Raises
    ------
    ConfigurationError
        With one line that names file, field, value and what is allowed.
    """
    return rig(read_yaml(file), printable(str(file), 300))


def rig(content: Mapping[str, Any], source: str) -> Rig:
    """Rig from the content of a file; `source` is its name in messages."""
    names = {key(name): name for name in QUANTITIES}
    known = (*TEXTS, *names)
    for word in (word for word in content if word not in known):
        near = "".join(f", perhaps {name}" for name in get_close_matches(str(word), known, 1))
        problem = f"unknown key{near}; known keys: {', '.join(known)}"
        raise ConfigurationError(f"{source}: {printable(str(word))}: {problem}")
    texts = {word: content.get(word, choices[0]) for word, choices in TEXTS.items()}
    for word, text in texts.items():
        if text not in TEXTS[word]:
            allowed = " or ".join(TEXTS[word])
            raise ConfigurationError(f"{source}: {word} = {shown(text)}: must be {allowed}")
    ends: dict[str, Ends] = {}
    for word, name in names.items():
        value = content.get(word, QUANTITIES[name].default)
        if value is not None or word in content:
            low, high = _ends(value, QUANTITIES[name], f"{source}: {word}")
            ends[name] = factor(name) * low, factor(name) * high
    if not ends.keys() & {"volume", "bore"}:
        raise ConfigurationError(f"{source}: {key('volume')}: missing; or give {key('bore')}")
    for first, second in AT_MOST_ONE:
        if first in ends and second in ends:
            raise ConfigurationError(f"{source}: {key(first)}: conflicts with {key(second)}; give only one")
    for name in ends:
        for needed in QUANTITIES[name].needs:
            if needed not in ends:
                raise ConfigurationError(f"{source}: {key(name)}: needs {key(needed)}, which is missing")
    gas = GASES[texts["gas"]]
    ends.setdefault("n", (1.0, gas.gamma))
    ends.setdefault("P_start", ends["P_surroundings"])
    ends.setdefault("T_start", ends["T_surroundings"])
    return Rig(gas, texts["sensor"], ends)


def _ends(value: Any, quantity: Quantity, field: str) -> Ends:
    """Ends of a quantity, in the unit of its key; equal if the value in the file is one number."""
    pair = value if isinstance(value, list) else [value, value]
    numbers = [x for x in pair if isinstance(x, int | float) and not isinstance(x, bool) and -inf < x < inf]
    inside = all(quantity.low <= x <= quantity.high for x in numbers)
    if len(pair) != 2 or len(numbers) != 2 or not inside or numbers[0] > numbers[1]:
        raise ConfigurationError(
            f"{field} = {shown(value)}: must be a number, or a list of two in ascending order, [low, high],"
            f" to fit it between them; each at least {quantity.low:g} and at most {quantity.high:g}"
        )
    return float(numbers[0]), float(numbers[1])
