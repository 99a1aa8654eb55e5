"""Reading a measurement: columns by name and unit, in SI units and uniform in time."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import numpy as np
import pandas as pd
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from pneumo.configuration.experiment import Plant
from pneumo.configuration.plain_yaml import read_yaml
from pneumo.errors import InputError, printable
from pneumo.fit.record.formats import plain_unit, read_table
from pneumo.fit.record.plausibility import (
    GAP,
    PRESSURE_UNITS,
    UNEVEN,
    Samples,
    check_signals,
    check_time,
    check_velocity,
)

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
    "P_s": _PRESSURE,
    "m_A": _FLOW,
    "m_B": _FLOW,
    "T": {"K": 1.0, "degC": 1.0},
}
REQUIRED = ("t", "x", "P_A", "P_B")
FLOWS = ("m_A", "m_B")  # instead of u
HEADER = re.compile(
    r"^\s*(?P<name>\w+?)\s*(?:[\[(](?P<unit>.+)[\])]|_(?P<suffix>[A-Za-z]+(?:_per_s|/s)?(?:_g)?))\s*$"
)
TIME = ("time", "zeit", "x_value")  # names of t that instruments write
FEWEST_ROWS = 100
MOST_MISSING = 0.01  # share of a signal's samples that may be interpolated
MISSING = ("", "nan", "na", "n/a", "null", "-", "--")


class Column(BaseModel):
    """Column of a file that holds a quantity, and its unit there."""

    model_config = ConfigDict(extra="forbid")
    column: Annotated[str, Field(min_length=1, max_length=200)]
    unit: Annotated[str, Field(max_length=20)]


Quantity = Literal["t", "u", "x", "v", "P_A", "P_B", "P_s", "m_A", "m_B", "T"]
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
    closed: bool = False  # no gas flows: the valve was shut all the time
    P_s: np.ndarray | None = None  # Pa, absolute supply pressure, where it was measured

    @property
    def t(self) -> np.ndarray:
        """Time from the first sample, s."""
        return self.period * np.arange(len(self.u))

    def since(self, begin: float) -> "Measurement":
        """The rest of the measurement, from the time `begin` on, s."""
        first = int(np.searchsorted(self.t, begin))
        v, P_s = (signal if signal is None else signal[first:] for signal in (self.v, self.P_s))
        m = self.m if self.m is None else self.m[:, first:]
        return self._replace(u=self.u[first:], x=self.x[first:], P=self.P[:, first:], v=v, P_s=P_s, m=m)


def read_mapping(path: Path) -> dict[str, Column]:
    """Read from YAML which column is what: `P_A: {column: "pressure 1", unit: kPa}`.

    `InputError` if a key is no quantity, or column or unit is missing.
    """
    try:
        return {str(name): column for name, column in MAPPING.validate_python(read_yaml(path)).items()}
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in first["loc"] if part != "[key]")
        expected = f"must be one of {', '.join(COLUMN_UNITS)}, each with column and unit"
        raise InputError(f"{path}: {printable(field)}: {expected}") from None


def _columns_by_header(names: list[str], units: Mapping[str, str]) -> dict[str, Column]:
    """Columns by quantity, from headers such as `P_A_kPa`, `P_A [kPa]` or `P_A (bar(g))`."""
    columns: dict[str, Column] = {}
    spelled = [_name_and_unit(name) for name in names]
    if all(quantity != "t" for quantity, _ in spelled):
        spelled = [("t" if quantity.lower() in TIME else quantity, unit) for quantity, unit in spelled]
    for name, (quantity, own) in zip(names, spelled, strict=True):
        if quantity in columns:
            raise InputError(f"columns {columns[quantity].column!r} and {name!r}: both are {quantity}")
        if quantity in COLUMN_UNITS:
            unit = units.get(name) or own
            unit = plain_unit(unit.replace("_per_s", "/s").replace("_g", GAUGE))
            columns[quantity] = Column(column=name, unit=unit)
    return columns


def _name_and_unit(name: str) -> tuple[str, str]:
    """Quantity and unit of a header; `P_A` and `X_Value` have none."""
    match = HEADER.match(name)
    if match is None or name.strip() in COLUMN_UNITS or name.strip().lower() in TIME:
        return name.strip(), ""
    return match["name"], match["unit"] or match["suffix"]


def _numbers(samples: Samples, quantity: str, column: pd.Series, notes: list[str]) -> np.ndarray:
    """A column as finite numbers; a few missing ones are interpolated, or held if they are commands."""
    numbers = np.asarray(pd.to_numeric(column, errors="coerce"), dtype=float)
    absent = column.astype(str).str.strip().str.lower().isin(MISSING).to_numpy() & (quantity != "t")
    samples.refuse(
        ~np.isfinite(numbers) & ~absent,
        quantity,
        lambda k, more: (
            f"{printable(str(column.iloc[k]), 30) or 'empty'!r}: must be a finite number"
            f"{f', and {more} more' if more else ''}"
        ),
    )
    count, there, row = int(absent.sum()), np.flatnonzero(~absent), np.arange(len(numbers))
    if not count:
        return numbers
    # Missing samples in a row are refused where the time between their neighbours would be a gap.
    run = np.concatenate([there, [len(row)]]) - np.concatenate([[-1], there])
    long = np.zeros(len(row), dtype=bool)
    long[np.concatenate([[-1], there])[run > GAP] + 1] = True
    samples.refuse(
        long,
        quantity,
        lambda *_: f"more than {GAP - 1:g} missing samples in a row: cut the file there and fit one part",
    )
    samples.refuse(
        absent & (count > MOST_MISSING * len(row)),
        quantity,
        lambda *_: (
            f"{count} of {len(row)} samples are missing: at most {100 * MOST_MISSING:g} % are"
            " interpolated; take a record without them"
        ),
    )
    held = quantity == "u"
    notes.append(
        f"column {quantity}: {count} of {len(row)} samples missing, {'held' if held else 'interpolated'}"
    )
    if held:
        return numbers[there[np.clip(np.searchsorted(there, row, side="right") - 1, 0, None)]]
    return np.interp(row, there, numbers[there])


def _factor_and_offset(path: Path, quantity: str, column: Column, P_atm: float) -> tuple[float, float]:
    """Factor and offset of a column's unit to SI; one that ends with `GAUGE` counts from the atmosphere."""
    unit, units = plain_unit(column.unit), COLUMN_UNITS[quantity]
    gauge = unit.endswith(GAUGE) and units is _PRESSURE
    factor = units.get(unit.removesuffix(GAUGE).strip() if gauge else unit)
    if factor is None:
        problem = f"unknown unit {printable(unit, 20)!r}" if unit else "no unit in the header"
        allowed = ", ".join([*units, *(["bar(g)"] if units is _PRESSURE else [])])
        raise InputError(f"{path}: column {printable(column.column, 30)}: {problem}; it is one of {allowed}")
    return factor, P_atm if gauge else ZERO_CELSIUS if unit == "degC" else 0.0


def read_measurement(
    path: Path | str,
    plant: Plant,
    mapping: Mapping[str, Column] | None = None,
    *,
    from_end: bool = False,
    closed: bool = False,
) -> Measurement:
    """Read a measurement and check it against the cylinder, valve and supply that it is of.

    The file is text, LabVIEW .lvm, MATLAB .mat or NetCDF, as `read_table` takes them. `mapping` has column
    and unit of each quantity, as the header has them where it is left out. `from_end` is whether the position
    counts from the end where chamber A is smallest, and not from mid-stroke. Where both chambers were
    `closed`, neither command nor flows are needed; a record whose command or flows are all zero is of closed
    chambers too. An `InputError` says where and what is wrong, and what is expected.
    """
    path = Path(path)
    known = {unit for units in COLUMN_UNITS.values() for unit in units}
    table, units, first_line = read_table(path, known | {f"{unit}{GAUGE}" for unit in _PRESSURE})
    names = [str(name) for name in table.columns]
    columns = dict(mapping) if mapping else _columns_by_header(names, units)
    measured_flow = any(quantity in columns for quantity in FLOWS)
    for quantity in REQUIRED + (() if closed else FLOWS if measured_flow else ("u",)):
        if quantity not in columns:
            there = ", ".join(printable(name, 30) for name in names[:12])
            shut = "; if the valve was shut all the time: --closed both" if quantity == "u" else ""
            raise InputError(
                f"{path}: no column {quantity}; expected a header such as"
                f" {quantity}_{next(iter(COLUMN_UNITS[quantity]))}, or --columns; there are {there}{shut}"
            )
    values: dict[str, np.ndarray] = {}
    samples = Samples(path, first_line, values)
    notes: list[str] = []
    for quantity, column in columns.items():
        name = column.column
        if name not in names:
            raise InputError(f"{path}: no column {printable(name)!r}, which the mapping has for {quantity}")
        factor, offset = _factor_and_offset(path, quantity, column, plant.conditions.P_atm)
        values[quantity] = factor * _numbers(samples, quantity, table.loc[:, name], notes) + offset
    if from_end:
        values["x"] = values["x"] - plant.cylinder.stroke / 2
    if len(values["t"]) < FEWEST_ROWS:
        raise InputError(f"{path}: {len(values['t'])} samples: must be at least {FEWEST_ROWS}")
    driven = [name for name in (FLOWS if measured_flow else ("u",)) if name in values]
    if not closed and not any(values[name].any() for name in driven):
        closed = True
        notes.append(f"{', '.join(driven)}: zero in every sample, so taken for closed chambers")
    if measured_flow and "u" in values and not closed:
        notes.append("column u: not used, since the flows m_A and m_B were measured")
    if measured_flow or "u" not in values:
        values["u"] = np.zeros_like(values["t"])
    period, on_time = check_time(samples)
    notes += on_time + check_signals(samples, plant, from_end, closed)
    values = _uniform(values, period)
    notes += check_velocity(samples._replace(values=values), period)
    T = float(np.mean(values["T"])) if "T" in values else np.nan
    P = np.array([values["P_A"], values["P_B"]])
    m = np.array([values[name] for name in FLOWS]) if measured_flow else None
    x, v, u = values["x"], values.get("v"), values["u"]
    return Measurement(str(path), period, u, x, P, v, T, tuple(notes), m, closed, values.get("P_s"))


def _uniform(values: dict[str, np.ndarray], period: float) -> dict[str, np.ndarray]:
    """Signals at uniform times: interpolated linearly, but the command is held."""
    t = values["t"] - values["t"][0]
    grid = period * np.arange(len(t))
    if np.max(np.abs(t - grid)) <= UNEVEN * period:
        return values
    before = np.clip(np.searchsorted(t, grid + UNEVEN * period, side="right") - 1, 0, None)
    uniform = {name: np.interp(grid, t, signal) for name, signal in values.items()}
    return uniform | {"t": grid, "u": values["u"][before]}
