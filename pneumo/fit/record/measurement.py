"""Reading a measurement: signals in SI units, uniform in time."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from pneumo.configuration.experiment import Plant
from pneumo.errors import InputError, printable
from pneumo.fit.record.columns import (
    KNOWN_UNITS,
    UNITS,
    Column,
    columns_by_header,
    proposed_mapping,
    unused_note,
)
from pneumo.fit.record.formats import given_table, read_table
from pneumo.fit.record.plausibility import GAP, UNEVEN, Samples, check_signals, check_time, check_velocity

REQUIRED = ("t", "x", "P_A", "P_B")
FLOWS = ("m_A", "m_B")  # instead of u
FEWEST_ROWS = 100
MOST_MISSING = 0.01  # fraction of a signal's samples that may be interpolated
MISSING = ("", "nan", "na", "n/a", "null", "-", "--")


class Measurement(NamedTuple):
    """Signals in SI units, uniform in time; arrays have the shape (samples,) or (chamber, samples)."""

    name: str  # file that they were read from
    period: float  # s, time between samples
    u: np.ndarray  # V, command; zero where flows were measured instead
    x: np.ndarray  # m, position from mid-stroke
    P: np.ndarray  # Pa, absolute pressures of both chambers
    v: np.ndarray | None = None  # m/s, velocity where it was measured
    T: float = np.nan  # K, mean temperature of the surroundings; NaN where it was not measured
    notes: tuple[str, ...] = ()  # unlikely values and changes, a sentence each
    m: np.ndarray | None = None  # kg/s, mass flows into both chambers, where they were measured
    closed: bool = False  # no gas flows: the valve was shut all the time
    P_s: np.ndarray | None = None  # Pa, absolute supply pressure, where it was measured
    begins: tuple[int, ...] = (0,)  # first samples of parts of several records, one after another
    units: Mapping[str, str] = MappingProxyType({})  # of the columns that were read, by quantity

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


def _numbers(samples: Samples, quantity: str, column: pd.Series, notes: list[str]) -> np.ndarray:
    """Column as finite numbers; a few missing ones are interpolated, or held if it is the command."""
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
    count, present, row = int(absent.sum()), np.flatnonzero(~absent), np.arange(len(numbers))
    if not count:
        return numbers
    # Missing samples in a row are refused where the time between their neighbours would be a gap.
    run = np.concatenate([present, [len(row)]]) - np.concatenate([[-1], present])
    long = np.zeros(len(row), dtype=bool)
    long[np.concatenate([[-1], present])[run > GAP] + 1] = True
    samples.refuse(
        long,
        quantity,
        lambda *_: f"more than {GAP - 1:g} missing samples in a row: cut the file there and fit one part",
    )
    samples.refuse(
        absent & (count > MOST_MISSING * len(row)),
        quantity,
        lambda *_: (
            f"{count} of {len(row)} samples are missing: must be at most {100 * MOST_MISSING:g} %;"
            " take a record without them"
        ),
    )
    held = quantity == "u"
    notes.append(
        f"column {quantity}: {count} of {len(row)} samples missing, {'held' if held else 'interpolated'}"
    )
    if held:
        return numbers[present[np.clip(np.searchsorted(present, row, side="right") - 1, 0, None)]]
    return np.interp(row, present, numbers[present])


def _seconds(samples: Samples, column: pd.Series) -> np.ndarray | None:
    """Seconds since the first of a column's ISO time stamps; None if its values are no time stamps.

    `InputError` if one of several is none.
    """
    if pd.api.types.is_datetime64_any_dtype(column):
        stamps = column
    elif pd.api.types.is_numeric_dtype(column) or not len(column) or str(column.iloc[0])[:10].count("-") != 2:
        return None
    else:
        stamps = pd.to_datetime(column, errors="coerce", format="ISO8601", utc=True)
    seconds = (stamps - stamps.iloc[0]).dt.total_seconds().to_numpy()
    samples.refuse(
        ~np.isfinite(seconds),
        "t",
        lambda k, more: (
            f"{printable(str(column.iloc[k]), 30)!r}: must be a time stamp such as 2006-05-31T12:00:00.001"
            f"{f', and {more} more' if more else ''}"
        ),
    )
    return seconds


def read_measurement(
    source: Path | str | pd.DataFrame | xr.Dataset,
    plant: Plant,
    mapping: Mapping[str, Column] | None = None,
    *,
    from_end: bool = False,
    closed: bool = False,
) -> Measurement:
    """Measurement from a file or table, checked against cylinder, valve and supply of the plant.

    Parameters
    ----------
    source
        File in one of the `FORMATS` of `pneumo.fit.record.formats`, or a table of columns named as in a file.
    mapping
        Column and unit of each quantity; by default as the file's header names them.
    from_end
        Whether the position counts from the end where chamber A is smallest, and not from mid-stroke.
    closed
        Whether both chambers were closed: then neither command nor flows are needed. A record whose command
        or flows are all zero is taken for one of closed chambers too.

    Raises
    ------
    InputError
        If the file or one of its values is not usable; the text names the place and what is allowed.
    """
    if isinstance(source, Path | str):
        path = Path(source)
        table, units, first_line = read_table(path, KNOWN_UNITS)
    else:
        path, (table, units, first_line) = Path("record"), given_table(source)
    names = [str(name) for name in table.columns]
    columns = dict(mapping) if mapping else columns_by_header(names, units)
    measured_flow = any(quantity in columns for quantity in FLOWS)
    needed = REQUIRED + (() if closed else FLOWS if measured_flow else ("u",))
    if missing := [quantity for quantity in needed if quantity not in columns]:
        present = ", ".join(printable(name, 30) for name in names[:12])
        shut = "; if the valve was shut all the time: --closed both" if "u" in missing else ""
        raise InputError(
            f"{path}: no column {', '.join(missing)}: must have a header such as"
            f" {missing[0]}_{next(iter(UNITS[missing[0]]))}, or be named with --columns; columns:"
            f" {present}{shut}; a file for --columns, to check and complete:"
            f" {proposed_mapping(names, units, columns, needed)}"
        )
    values: dict[str, np.ndarray] = {}
    read_in = {quantity: column.unit for quantity, column in columns.items()}
    samples = Samples(path, first_line, values, read_in)
    # Who gives a mapping knows what it leaves out; an empty column, as of LabVIEW's comments, says nothing.
    filled = [name for i, name in enumerate(names) if len(table) and str(table.iloc[0, i]).strip()]
    notes = [] if mapping else unused_note(filled, columns)
    for quantity, column in columns.items():
        name = column.column
        if name not in names:
            raise InputError(f"{path}: no column {printable(name)!r}, which the mapping names as {quantity}")
        if quantity == "t" and (stamps := _seconds(samples, table.loc[:, name])) is not None:
            values[quantity] = stamps
            continue
        factor, offset = column.factor_and_offset(path, quantity, plant.conditions.P_atm)
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
    period, on_time = check_time(samples, closed)
    notes += on_time + check_signals(samples, plant, from_end, closed)
    values = _uniform(values, period)
    notes += [] if closed else check_velocity(samples._replace(values=values), period)
    T = float(np.mean(values["T"])) if "T" in values else np.nan
    P = np.array([values["P_A"], values["P_B"]])
    m = np.array([values[name] for name in FLOWS]) if measured_flow else None
    x, v, u, P_s = values["x"], values.get("v"), values["u"], values.get("P_s")
    return Measurement(
        name=str(path),
        period=period,
        u=u,
        x=x,
        P=P,
        v=v,
        T=T,
        notes=tuple(notes),
        m=m,
        closed=closed,
        P_s=P_s,
        units=read_in,
    )


def _uniform(values: dict[str, np.ndarray], period: float) -> dict[str, np.ndarray]:
    """Signals at uniform times: interpolated linearly, but the command is held."""
    t = values["t"] - values["t"][0]
    grid = period * np.arange(len(t))
    if np.max(np.abs(t - grid)) <= UNEVEN * period:
        return values
    before = np.clip(np.searchsorted(t, grid + UNEVEN * period, side="right") - 1, 0, None)
    uniform = {name: np.interp(grid, t, signal) for name, signal in values.items()}
    return uniform | {"t": grid, "u": values["u"][before]}
