"""Columns of a measurement: which quantity each holds, and in which unit."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from pneumo.configuration.plain_yaml import read_yaml
from pneumo.configuration.plausible_cylinders import ATMOSPHERE
from pneumo.errors import InputError, printable
from pneumo.fit.record.text_table import PLAIN, plain_unit

STANDARD_ATMOSPHERE = 101325.0  # Pa
GAUGE = "(g)"  # behind a unit of pressure: above atmospheric
ANR = 1.185  # kg/m^3, air at the reference atmosphere of ISO 8778
ZERO_CELSIUS = 273.15
LENGTH = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
PRESSURE = {"Pa": 1.0, "hPa": 1e2, "kPa": 1e3, "bar": 1e5, "psi": 6894.757293168361, "MPa": 1e6, "mbar": 1e2}
FLOW = {"kg/s": 1.0, "g/s": 1e-3, "kg/h": 1 / 3600, "dm3/s(ANR)": 1e-3 * ANR, "l/min(ANR)": 1e-3 / 60 * ANR}
UNITS: dict[str, dict[str, float]] = {  # factors to SI by quantity
    "t": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "u": {"V": 1.0, "mV": 1e-3},
    "x": LENGTH,
    "v": {f"{unit}/s": factor for unit, factor in LENGTH.items()},
    **dict.fromkeys(("P_A", "P_B", "P_s"), PRESSURE),
    **dict.fromkeys(("m_A", "m_B"), FLOW),
    "T": {"K": 1.0, "degC": 1.0},
}
KNOWN_UNITS = {unit for units in UNITS.values() for unit in units} | {
    f"{unit}{end}" for unit in PRESSURE for end in (GAUGE, "g")
}
HEADER = re.compile(
    r"^\s*(?P<name>\w+?)\s*(?:[\[(](?P<unit>.+)[\])]|_(?P<suffix>[A-Za-z]+(?:_per_s|/s)?(?:_g|\s?\(g\))?))\s*$"
)
IN_BRACKETS = re.compile(r"(.+?)\s*[\[(](.+)[\])]")
SIGN_BEHIND = re.compile(r"(.+?)[_ ]+([^\w\s]\S*)")  # as in u_%
OPTIONAL = re.compile(r"(P_s|T|v)(?![A-Za-z])")  # how a misspelt name of one may begin
MOST_NAMED = 4  # columns that a note names
ROS_FIELD = "field."  # before the names that `rostopic echo -p` writes
UNNAMED = "?"  # for a column that nobody can guess
LIKELY = {"t": "s", "u": "V", "x": "mm", **dict.fromkeys(("P_A", "P_B"), "bar")}
LIKELY |= dict.fromkeys(("m_A", "m_B"), "kg/s")
GUESSES = {  # names of columns in other laboratories, in small letters and digits
    "t": re.compile(r"t|time|timestamp|zeit|temps|tempo"),
    "u": re.compile(r"u|u?(command|cmd|ventil|valve|stell\w*|spannung|voltage)"),
    "x": re.compile(r"x|s|pos(ition)?|weg|hub|lage|stroke|displacement"),
    "P_A": re.compile(r"(p|druck|pressure|pression)(a|1)"),
    "P_B": re.compile(r"(p|druck|pressure|pression)(b|2)"),
    "m_A": re.compile(r"(m|q|flow|massflow)(a|1)"),
    "m_B": re.compile(r"(m|q|flow|massflow)(b|2)"),
}
TIME = ("time", "zeit", "x_value")  # names of t that instruments write


def pressure_unit(text: str) -> tuple[str, bool]:
    """Unit of a pressure, and whether it is a gauge pressure: `bar` and True for `barg` and `bar(g)`."""
    unit = plain_unit(text)
    if unit.endswith(GAUGE):
        return unit.removesuffix(GAUGE).strip(), True
    return (unit[:-1], True) if unit.endswith("g") and unit[:-1] in PRESSURE else (unit, False)


def gauge_zero(P_port: float) -> float:
    """Pressure at which a gauge shows zero, Pa: the atmosphere, even where the port is a vacuum line."""
    return P_port if ATMOSPHERE[0] <= P_port <= ATMOSPHERE[1] else STANDARD_ATMOSPHERE


class Column(BaseModel):
    """Column of a file that holds a quantity, and its unit there."""

    model_config = ConfigDict(extra="forbid")
    column: Annotated[str, Field(min_length=1)]
    unit: str  # of `scale` times the number in the file, plus `offset`
    scale: Annotated[float, Field(allow_inf_nan=False)] = 1.0
    offset: Annotated[float, Field(allow_inf_nan=False)] = 0.0

    def factor_and_offset(self, path: Path, quantity: str, P_atm: float) -> tuple[float, float]:
        """Factor and offset that convert the column's numbers to SI units.

        A gauge pressure, with a unit that ends with `GAUGE` or g, gets the `gauge_zero` of P_atm, Pa, added.
        `InputError` if the quantity has no such unit.
        """
        unit, units = plain_unit(self.unit), UNITS[quantity]
        plain, gauge = pressure_unit(unit) if units is PRESSURE else (unit, False)
        factor = units.get(plain)
        if factor is None:
            problem = f"unknown unit {printable(unit, 20)!r}" if unit else "no unit in the header"
            allowed = ", ".join([*units, *(["bar(g)"] if units is PRESSURE else [])])
            raise InputError(
                f"{path}: column {printable(self.column, 30)}: {problem}; the units are {allowed}"
            )
        zero = gauge_zero(P_atm) if gauge else ZERO_CELSIUS if unit == "degC" else 0.0
        return factor * self.scale, factor * self.offset + zero


Quantity = Literal["t", "u", "x", "v", "P_A", "P_B", "P_s", "m_A", "m_B", "T"]
MAPPING = TypeAdapter(dict[Quantity, Column])


def read_mapping(path: Path) -> dict[str, Column]:
    """Columns by quantity from YAML such as `P_A: {column: "pressure 1", unit: kPa}`.

    `InputError` if a key is no quantity, or column or unit is missing.
    """
    try:
        return {str(name): column for name, column in MAPPING.validate_python(read_yaml(path)).items()}
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in first["loc"] if part != "[key]")
        expected = f"must be one of {', '.join(UNITS)}, each with column and unit"
        raise InputError(f"{path}: {printable(field)}: {expected}") from None


def columns_by_header(names: list[str], units: Mapping[str, str]) -> dict[str, Column]:
    """Columns by quantity, from headers such as `P_A_kPa`, `P_A [kPa]`, `P_A (bar(g))` or `T_°C`."""
    columns: dict[str, Column] = {}
    spelled = [_name_and_unit(name.removeprefix(ROS_FIELD).translate(PLAIN)) for name in names]
    if all(quantity != "t" for quantity, _ in spelled):
        spelled = [("t" if quantity.lower() in TIME else quantity, unit) for quantity, unit in spelled]
    for name, (quantity, header_unit) in zip(names, spelled, strict=True):
        if quantity in columns:
            both = f"{printable(columns[quantity].column, 30)!r} and {printable(name, 30)!r}"
            raise InputError(f"columns {both}: both are {quantity}")
        if quantity in UNITS:
            unit = units.get(name) or header_unit
            unit = plain_unit(unit.replace("_per_s", "/s").replace("_g", GAUGE))
            columns[quantity] = Column(column=name, unit=unit)
    return columns


def proposed_mapping(
    names: Sequence[str], units: Mapping[str, str], known: Mapping[str, Column], needed: Sequence[str]
) -> str:
    """YAML in one line for `read_mapping`: columns guessed by their names, `UNNAMED` for the others."""
    proposed = {
        quantity: column.model_copy(update={"unit": _proposed_unit(column.unit, quantity)})
        for quantity, column in known.items()
    }
    free = [name for name in names if name not in {c.column for c in known.values()}]
    for quantity in (quantity for quantity in needed if quantity not in known):
        likely = (name for name in free if GUESSES[quantity].fullmatch(_foreign(name)[0]))
        name = next(likely, UNNAMED)
        free = [other for other in free if other != name]
        unit = plain_unit(units.get(name) or _foreign(name)[1])
        proposed[quantity] = Column(column=name, unit=_proposed_unit(unit, quantity))
    entries = ({q: c.model_dump(exclude_defaults=True)} for q, c in proposed.items())
    texts = (
        yaml.safe_dump(entry, default_flow_style=True, allow_unicode=True, width=10**6) for entry in entries
    )
    return f"{{{', '.join(text.strip()[1:-1] for text in texts)}}}"


def _proposed_unit(unit: str, quantity: str) -> str:
    """The unit itself if it is known, `UNNAMED` for another, and the likely one where there is none."""
    known = pressure_unit(unit)[0] in KNOWN_UNITS
    return unit if known else UNNAMED if unit else LIKELY.get(quantity, "")


def unused_note(names: Sequence[str], columns: Mapping[str, Column]) -> list[str]:
    """Note on columns that were not read, those first that may be an optional one with a misspelt unit."""
    used = {column.column for column in columns.values()}
    unused = sorted((name for name in names if name not in used), key=lambda n: not OPTIONAL.match(n))
    named = ", ".join(printable(name, 30) for name in unused[:MOST_NAMED])
    more = f" and {len(unused) - MOST_NAMED} more" if len(unused) > MOST_NAMED else ""
    return [f"columns not used: {named}{more}"] if unused else []


def _foreign(header: str) -> tuple[str, str]:
    """Letters and digits of a header in lower case, and the unit behind them: in brackets, or a sign."""
    match = IN_BRACKETS.fullmatch(header.strip()) or SIGN_BEHIND.fullmatch(header.strip())
    name, unit = match.groups() if match else (header, "")
    return re.sub(r"[\W_]", "", name.lower()), unit


def _name_and_unit(name: str) -> tuple[str, str]:
    """Quantity and unit of a header; the unit is empty for a plain name such as `P_A` or `X_Value`."""
    match = HEADER.match(name)
    if match is None or name.strip() in UNITS or name.strip().lower() in TIME:
        return name.strip(), ""
    return match["name"], match["unit"] or match["suffix"]
