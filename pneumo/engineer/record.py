"""Reading a measurement: columns by name and unit, from CSV or NetCDF, in SI units and uniform in time."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from pneumo.configuration.experiment import Plant
from pneumo.configuration.plain_yaml import read_yaml
from pneumo.engineer.fit_warnings import (
    PRESSURE_UNITS,
    UNEVEN,
    Samples,
    check_signals,
    check_time,
    check_velocity,
)
from pneumo.errors import InputError, printable

GAUGE = "(g)"  # behind a unit of pressure: above atmospheric
ANR = 1.185  # kg/m^3, air at the reference atmosphere of ISO 8778
ZERO_CELSIUS = 273.15
_LENGTH = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
_PRESSURE = PRESSURE_UNITS | {"mbar": 1e2}
_FLOW = {"kg/s": 1.0, "g/s": 1e-3, "kg/h": 1 / 3600, "dm3/s(ANR)": 1e-3 * ANR, "l/min(ANR)": 1e-3 / 60 * ANR}
COLUMN_UNITS: dict[str, dict[str, float]] = {
    "t": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0},
    "u": {"V": 1.0, "mV": 1e-3},
    "x": _LENGTH,
    "v": {f"{unit}/s": scale for unit, scale in _LENGTH.items()},
    "P_A": _PRESSURE,
    "P_B": _PRESSURE,
    "m_A": _FLOW,
    "m_B": _FLOW,
    "T": {"K": 1.0, "degC": 1.0},
}
REQUIRED = ("t", "x", "P_A", "P_B")
COMMAND_COLUMN, FLOWS = ("u",), ("m_A", "m_B")  # one of the two
HEADER = re.compile(
    r"^\s*(?P<name>\w+?)\s*(?:[\[(](?P<unit>.+)[\])]|_(?P<suffix>[A-Za-z]+(?:_per_s|/s)?(?:_g)?))\s*$"
)
FEWEST_ROWS = 100


class Column(BaseModel):
    """Column of a file that holds a quantity, and its unit there."""

    model_config = ConfigDict(extra="forbid")
    column: Annotated[str, Field(min_length=1, max_length=200)]
    unit: Annotated[str, Field(max_length=20)]


Quantity = Literal["t", "u", "x", "v", "P_A", "P_B", "m_A", "m_B", "T"]
MAPPING = TypeAdapter(dict[Quantity, Column])


class Measurement(NamedTuple):
    """Signals in SI units, uniform in time; arrays have the shape (samples,) or (chamber, samples)."""

    name: str  # file that they were read from
    period: float  # s, time between samples
    u: np.ndarray  # V, command; zero where flows were measured instead
    x: np.ndarray  # m, position from mid-stroke
    P: np.ndarray  # Pa, absolute pressures of both chambers
    v: np.ndarray | None  # m/s, velocity where it was measured
    T: float  # K, mean temperature of the surroundings; NaN where it was not measured
    notes: tuple[str, ...]  # what is unlikely in the file
    m: np.ndarray | None = None  # kg/s, mass flows into both chambers, where they were measured

    @property
    def t(self) -> np.ndarray:
        """Time from the first sample, s."""
        return self.period * np.arange(len(self.u))


def read_mapping(path: Path) -> dict[str, Column]:
    """Read from YAML which column is what: `P_A: {column: "pressure 1", unit: kPa}`.

    Raises
    ------
    InputError
        If a key is no quantity, or column or unit is missing.
    """
    try:
        return {str(name): column for name, column in MAPPING.validate_python(read_yaml(path)).items()}
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in first["loc"] if part != "[key]")
        quantities = ", ".join(COLUMN_UNITS)
        raise InputError(
            f"{path}: {printable(field)}: must be one of {quantities}, each with column and unit"
        ) from None


def _columns_by_header(names: list[str], units: Mapping[str, str]) -> dict[str, Column]:
    """Columns by quantity, from headers such as `P_A_kPa`, `P_A [kPa]` or `P_A (bar(g))`."""
    columns: dict[str, Column] = {}
    for name in names:
        match = HEADER.match(name)
        quantity = name.strip() if name.strip() in COLUMN_UNITS else match["name"] if match else ""
        if quantity not in COLUMN_UNITS:
            continue
        unit = units.get(name) or (match and (match["unit"] or match["suffix"])) or ""
        if quantity in columns:
            raise InputError(f"columns {columns[quantity].column!r} and {name!r}: both are {quantity}")
        unit = unit.replace("_per_s", "/s").replace("_g", GAUGE).strip()
        columns[quantity] = Column(column=name, unit=unit)
    return columns


def _read_table(path: Path) -> tuple[pd.DataFrame, dict[str, str], int]:
    """Columns of a file as text or numbers, their units, and the line of the first sample (0: no lines)."""
    try:
        if path.suffix == ".nc":
            with xr.open_dataset(path.absolute(), engine="netcdf4", decode_times=False) as data:
                signals = [name for name in data.variables if data[name].ndim == 1]
                units = {str(n): str(data[n].attrs.get("units", "")).replace(" s-1", "/s") for n in signals}
                return pd.DataFrame({str(n): data[n].values for n in signals}), units, 0
        with path.open(encoding="utf-8-sig", newline="") as file:
            header = file.readline()
        table = pd.read_csv(
            path,
            sep=max(",;\t", key=header.count),
            dtype=str,
            encoding="utf-8-sig",
            keep_default_na=False,
            skip_blank_lines=False,
        )
        return table, {}, 2
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, ValueError, LookupError, RuntimeError) as error:
        text = printable(" ".join(str(error).split()), 200)
        kind = "NetCDF" if path.suffix == ".nc" else "CSV"
        raise InputError(f"{path}: not a readable {kind} file ({text})") from None


def _numbers(samples: Samples, quantity: str, column: pd.Series) -> np.ndarray:
    """A column as finite numbers."""
    numbers = np.asarray(pd.to_numeric(column, errors="coerce"), dtype=float)

    def problem(first: int, more: int) -> str:
        text = printable(str(column.iloc[first]), 30) or "empty"
        return f"{text!r}: must be a finite number{f', and {more} more' if more else ''}"

    samples.refuse(~np.isfinite(numbers), quantity, problem)
    return numbers


def _in_si(values: np.ndarray, quantity: str, unit: str, P_atm: float) -> np.ndarray:
    """Values in SI units; a unit that ends with `GAUGE` counts from the atmosphere."""
    gauge = unit.endswith(GAUGE) and COLUMN_UNITS[quantity] is _PRESSURE
    scaled = values * COLUMN_UNITS[quantity][unit.removesuffix(GAUGE).strip() if gauge else unit]
    return scaled + (P_atm if gauge else ZERO_CELSIUS if unit == "degC" else 0.0)


def _check_column(path: Path, quantity: str, column: Column, names: list[str]) -> None:
    name, unit = column.column, column.unit
    if name not in names:
        raise InputError(f"{path}: no column {printable(name)!r}, which the mapping has for {quantity}")
    pressure = COLUMN_UNITS[quantity] is _PRESSURE
    if (unit.removesuffix(GAUGE).strip() if pressure else unit) not in COLUMN_UNITS[quantity]:
        problem = f"unknown unit {printable(unit, 20)!r}" if unit else "no unit in the header"
        allowed = ", ".join([*COLUMN_UNITS[quantity], *(["bar(g)"] if pressure else [])])
        raise InputError(f"{path}: column {printable(name, 30)}: {problem}; it is one of {allowed}")


def read_measurement(
    path: Path | str, plant: Plant, mapping: Mapping[str, Column] | None = None, *, from_end: bool = False
) -> Measurement:
    """Read a measurement and check it against the cylinder and supply that it is of.

    Parameters
    ----------
    path : path-like
        CSV with a header, separated by comma, semicolon or tab; or NetCDF (.nc).
    plant : Plant
        Cylinder, valve and supply as configured.
    mapping : mapping of str to Column, optional
        Column and unit of each quantity; from the header where left out.
    from_end : bool
        Whether the position counts from the end where chamber A is smallest, and not from mid-stroke.

    Raises
    ------
    InputError
        With one line that says where and what is wrong, and what is expected.
    """
    path = Path(path)
    table, units, first_line = _read_table(path)
    names = [str(name) for name in table.columns]
    columns = dict(mapping) if mapping else _columns_by_header(names, units)
    measured_flow = any(quantity in columns for quantity in FLOWS)
    for quantity in REQUIRED + (FLOWS if measured_flow else COMMAND_COLUMN):
        if quantity not in columns:
            there = ", ".join(printable(name, 30) for name in names[:12])
            raise InputError(
                f"{path}: no column {quantity}; expected a header such as"
                f" {quantity}_{next(iter(COLUMN_UNITS[quantity]))}, or --columns; there are {there}"
            )
    values: dict[str, np.ndarray] = {}
    samples = Samples(path, first_line, values)
    for quantity, column in columns.items():
        _check_column(path, quantity, column, names)
        numbers = _numbers(samples, quantity, table.loc[:, column.column])
        values[quantity] = _in_si(numbers, quantity, column.unit, plant.conditions.P_atm)
    if from_end:
        values["x"] = values["x"] - plant.cylinder.stroke / 2
    if len(values["t"]) < FEWEST_ROWS:
        raise InputError(f"{path}: {len(values['t'])} samples: must be at least {FEWEST_ROWS}")
    notes: list[str] = []
    if measured_flow:
        if "u" in values:
            notes.append("column u: not used, since the flows m_A and m_B were measured")
        values["u"] = np.zeros_like(values["t"])
    period, on_time = check_time(samples)
    notes += on_time + check_signals(samples, plant, from_end)
    values = _uniform(values, period)
    notes += check_velocity(samples._replace(values=values), period)
    T = float(np.mean(values["T"])) if "T" in values else np.nan
    P = np.array([values["P_A"], values["P_B"]])
    m = np.array([values[name] for name in FLOWS]) if measured_flow else None
    return Measurement(str(path), period, values["u"], values["x"], P, values.get("v"), T, tuple(notes), m)


def _uniform(values: dict[str, np.ndarray], period: float) -> dict[str, np.ndarray]:
    """Signals at uniform times: interpolated linearly, but the command is held."""
    t = values["t"] - values["t"][0]
    grid = period * np.arange(len(t))
    if np.max(np.abs(t - grid)) <= UNEVEN * period:
        return values
    before = np.clip(np.searchsorted(t, grid + UNEVEN * period, side="right") - 1, 0, None)
    return {
        name: grid if name == "t" else signal[before] if name == "u" else np.interp(grid, t, signal)
        for name, signal in values.items()
    }
