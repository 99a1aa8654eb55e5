"""Reading a measurement: signals in SI units on one grid of times."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from scipy.ndimage import binary_dilation

from pneumo.configuration.experiment import Plant
from pneumo.errors import InputError, printable
from pneumo.fitting.record.channel import Channel, numbers, refuse
from pneumo.fitting.record.columns import (
    Column,
    Columns,
    clock_unit,
    columns_of,
    missing_columns,
    proposal,
    unused_note,
)
from pneumo.fitting.record.formats import read_channels
from pneumo.fitting.record.plausibility import (
    UNEVEN,
    above_supply,
    check_clock,
    check_signals,
    range_note,
    saturated,
    until_it_stops,
)
from pneumo.fitting.record.series import Series, series
from pneumo.fitting.record.units import Surroundings

SENSORS = ("x", "P_A", "P_B")
FLOWS = ("m_A", "m_B")  # instead of u
ORDER = ("u", *FLOWS, *SENSORS, "P_s", "T")  # in which channels are listed
OPTIONAL = ("P_s", "T")
FEWEST_ROWS = 100
MOST_MISSING = 0.01  # fraction of a signal's samples that may be interpolated
SHOWN = {  # factor and unit in which a channel is shown
    **{"u": (1.0, "V"), "x": (1e3, "mm"), "T": (1.0, "K")},
    **dict.fromkeys(("P_A", "P_B", "P_s"), (1e-5, "bar absolute")),
    **dict.fromkeys(FLOWS, (1e3, "g/s")),
}
CUT = 0.01  # part of a record, whose loss at its ends a note names
BESIDE = 5  # samples beside one at the end of a sensor's range, which noise may have brought back into it


class Measurement(NamedTuple):
    """Signals in SI units, uniform in time; arrays have the shape (samples,) or (chamber, samples)."""

    name: str  # file that they were read from
    period: float  # s, time between samples
    u: np.ndarray  # V, command; zero where flows were measured instead
    x: np.ndarray  # m, position from mid-stroke
    P: np.ndarray  # Pa, absolute pressures of both chambers
    T: float = np.nan  # K, mean temperature of the surroundings; NaN where it was not measured
    notes: tuple[str, ...] = ()  # unlikely values and changes, a sentence each
    m: np.ndarray | None = None  # kg/s, mass flows into both chambers, where they were measured
    closed: bool = False  # no gas flows: the valve was shut all the time
    P_s: np.ndarray | None = None  # Pa, absolute supply pressure, where it was measured
    begins: tuple[int, ...] = (0,)  # first samples of parts of several records, one after another
    channels: tuple[str, ...] = ()  # how each channel was read, a line each
    used: np.ndarray | None = None  # whether a fit compares each pressure, by (chamber, sample); None: all
    zeros: Mapping[str, float] = MappingProxyType({})  # Pa, at which a gauge was taken to read 0, by pressure

    @property
    def t(self) -> np.ndarray:
        """Time from the first sample, s."""
        return self.period * np.arange(len(self.u))

    def part(self, first: int, last: int | None = None) -> "Measurement":
        """The samples from the first on, up to the last or the end."""
        chosen = slice(first, last if last is None else last + 1)
        m, P_s, used = (s if s is None else s[..., chosen] for s in (self.m, self.P_s, self.used))
        return self._replace(u=self.u[chosen], x=self.x[chosen], P=self.P[:, chosen], P_s=P_s, m=m, used=used)


def read_series(
    path: Path,
    channels: Sequence[Channel],
    columns: Mapping[str, Column],
    around: Surroundings,
    needed: Sequence[str],
) -> dict[str, Series]:
    """Signals by quantity, each at its own times.

    `InputError` if one of them is not usable, or one that is needed has no column.
    """
    by_name = {re.sub(r"\s*[\[(].*", "", c.name): c for c in channels}  # CH1 for CH1(V)
    by_name |= {c.other: c for c in channels} | {c.name: c for c in reversed(channels)}
    clocks = {c.clock.name: c.clock for c in channels if c.clock is not None} | by_name
    known = {q: c for q, c in columns.items() if c.column in (clocks if q == "t" else by_name)}
    used = {quantity: by_name[column.column] for quantity, column in known.items() if quantity != "t"}
    clocked = all(channel.clock is not None for channel in (used.values() or channels))
    wanted = dict.fromkeys(("t", *needed, *columns))
    if missing := [name for name in wanted if name not in known and not (clocked and name == "t")]:
        absent = [f"{columns[name].column!r} for {name}" if name in columns else name for name in missing]
        remedy = missing_columns(channels, known, missing)
        raise InputError(f"{path}: no column {printable(', '.join(absent), 200)}: {remedy}")
    found, fullest = dict[str, Series](), dict[str, np.ndarray]()
    clock_of = {q: channel.clock or clocks[columns["t"].column] for q, channel in used.items()}
    for quantity, channel in used.items():
        present, name = np.isfinite(numbers(path, channel, quantity)), clock_of[quantity].name
        fullest[name] = max(fullest.get(name, present), present, key=np.sum)
    for quantity, channel in used.items():
        clock = clock_of[quantity]
        if quantity in OPTIONAL and np.isnan(numbers(path, channel, quantity)).all():
            continue
        proposed, t_unit = proposal(known), clock_unit(clock, columns)
        read = columns[quantity].reading(path, quantity, around, proposed)
        present = fullest[clock.name]
        found[quantity] = series(path, channel, quantity, clock, t_unit, read, present, proposed)
    start = min((signal.start for signal in found.values()), default=0)
    return {q: s._replace(start=start, t=s.t + (s.start - start) / 1e9) for q, s in found.items()}


def read_measurement(
    source: Path | str | pd.DataFrame | xr.Dataset,
    plant: Plant,
    mapping: Columns | None = None,
    *,
    from_end: bool = False,
    closed: bool = False,
) -> Measurement:
    """Measurement from a file or table, checked against cylinder, valve and supply of the plant.

    `pneumo.read_record` describes the arguments; `from_end` is whether x counts from the end where chamber A
    is smallest. A record whose command or flows are all zero is taken for one of closed chambers too.
    """
    path, channels = read_channels(source)
    columns = columns_of(mapping, channels)
    measured_flow = any(quantity in columns for quantity in FLOWS)
    driven = FLOWS if measured_flow else ("u",)
    needed = SENSORS if closed else (*SENSORS, *driven)
    around = Surroundings(plant.conditions.P_atm, plant.valve.u_max, plant.gas.R)
    signals = read_series(path, channels, columns, around, needed)
    # Who gives a mapping knows what it leaves out; an empty column, as of LabVIEW's comments, says nothing.
    filled = [c for c in channels if len(c.values) and str(c.values[0]).strip() not in ("", "nan")]
    notes = [] if mapping else unused_note(filled, columns)
    notes += dict.fromkeys(signal.note for signal in signals.values() if signal.note)
    if from_end:
        x = signals["x"]
        signals["x"] = x._replace(values=x.values - plant.cylinder.stroke / 2)
    given = [name for name in driven if name in signals]
    if not closed and not any(signals[name].values.any() for name in given):
        closed = True
        notes.append(f"{', '.join(given)}: zero in every sample, so taken for closed chambers")
    if measured_flow and "u" in signals:
        if not closed:
            notes.append("column u: not used, since the flows m_A and m_B were measured")
        del signals["u"]
    for name in (name for name in (*SENSORS, "P_s") if name in signals and not closed):
        signals[name], stops = until_it_stops(signals[name])
        notes += stops
    period, grid, on_time = _grid(path, signals, closed)
    notes += on_time + check_signals(path, signals, plant, from_end, closed)
    used, ranges = _within_range(signals, plant, grid, closed)
    notes += ranges
    values = dict[str, np.ndarray]()
    for quantity in (name for name in signals if name != "T"):
        values[quantity], changed = _on_grid(signals[quantity], grid, period)
        notes += changed
    P, P_s = np.array([values["P_A"], values["P_B"]]), values.get("P_s")
    if not closed:
        notes += above_supply(values["x"], P, plant.conditions.P_s if P_s is None else P_s, plant)
    ordered = [signals[quantity] for quantity in ORDER if quantity in signals]
    return Measurement(
        name=str(path),
        period=period,
        u=values.get("u", np.zeros(len(grid))),
        x=values["x"],
        P=P,
        T=float(np.mean(signals["T"].values)) if "T" in signals else np.nan,
        notes=tuple(notes),
        m=np.array([values[name] for name in FLOWS]) if measured_flow else None,
        closed=closed,
        P_s=P_s,
        channels=tuple(map(_line, ordered)),
        used=used,
        zeros={s.quantity: around.P_atm for s in ordered if s.text.endswith(" gauge")},
    )


def _grid(path: Path, signals: Mapping[str, Series], closed: bool) -> tuple[float, np.ndarray, list[str]]:
    """Period and times of the grid, and notes: that of the fastest sensor, where all signals are."""
    notes = list[str]()
    moving = {name: signals[name] for name in (*SENSORS, *ORDER) if name in signals and name != "T"}
    for quantity, signal in moving.items():
        if len(signal.t) < 2:
            allowed = f"must be at least {FEWEST_ROWS}"
            raise InputError(f"{path}: column {quantity}: {len(signal.t)} samples: {allowed}")
        check_clock(path, signal, closed, sensor=quantity in SENSORS)
        notes += _missing(path, signal)
    fastest = min((signals[name] for name in SENSORS), key=lambda s: (s.period, -len(s.t)))
    sensors = max(s.t[-1] for s in moving.values() if not s.held)
    ends = {name: s.end(sensors) if s.held else s.t[-1] for name, s in moving.items()}
    first, last = max(s.t[0] for s in moving.values()), min(ends.values())
    notes += [
        f"column {name}: its last value, at {s.t[-1]:.4g} s, is held to the end at {sensors:.4g} s"
        for name, s in moving.items()
        if ends[name] > s.t[-1] + s.period
    ]
    tolerance = UNEVEN * fastest.period
    t = fastest.t[(fastest.t >= first - tolerance) & (fastest.t <= last + tolerance)]
    if len(t) < FEWEST_ROWS:
        of = "" if len(fastest.t) < FEWEST_ROWS else " that all signals have in common"
        raise InputError(f"{path}: {len(t)} samples{of}: must be at least {FEWEST_ROWS}")
    longest = max(float(np.ptp(signal.t)) for signal in moving.values())
    if last - first < (1 - CUT) * longest:
        together = f"{last - first:.4g} s of {longest:.4g} s"
        notes.append(f"all signals together last {together}; the rest is not used")
    span = t - t[0]
    count = len(t) + max(0, min(fastest.missing[0], round(span[-1] / fastest.period) + 1 - len(t)))
    period = float(span[-1]) / (count - 1)
    grid = period * np.arange(count)
    near = grid if count == len(t) else period * np.round(span / period)
    uneven = float(np.max(np.abs(span - near))) / period
    if uneven > UNEVEN:
        off = f"by up to {uneven:.2g} periods of {period:.4g} s"
        notes.append(f"time is not uniform: samples are off a uniform grid {off}; signals are interpolated")
    return period, t[0] + grid, notes


def _within_range(
    signals: Mapping[str, Series], plant: Plant, grid: np.ndarray, closed: bool
) -> tuple[np.ndarray, list[str]]:
    """Whether a fit compares each pressure on the grid, by (chamber, sample), and notes on sensors' ranges.

    It leaves out `saturated` samples and their neighbours, which noise may have brought back into the range.
    """
    used, notes = np.ones((2, len(grid)), dtype=bool), list[str]()
    for name in (name for name in (*SENSORS, "P_s") if name in signals):
        signal = signals[name]
        at_end = saturated(signal, plant)
        compared = name in ("P_A", "P_B") and not closed  # a fit of closed chambers compares all
        left_out = "no fit compares them or their neighbours with a model"
        notes += range_note(signal, at_end, left_out if compared else "fit a part of the record without them")
        if compared and at_end.any():
            beside = np.interp(grid, signal.t, binary_dilation(at_end, iterations=BESIDE)) > 0
            used["AB".index(name[-1])] &= ~beside
    return used, notes


def _missing(path: Path, signal: Series) -> list[str]:
    """Note on samples that a channel lacks at its own rate; `InputError` if they are many."""
    count, absent = signal.missing
    expected = len(signal.t) + count
    if not count or (signal.held and expected > 2 * len(signal.t)):
        return []
    if count > MOST_MISSING * expected:
        many = f"{count} of {expected} samples are missing: must be at most {100 * MOST_MISSING:g} %"
        refuse(path, signal.channel, signal.quantity, absent, many)
    return [f"column {signal.quantity}: {count} of {expected} samples missing, {signal.rule}"]


def _on_grid(signal: Series, grid: np.ndarray, period: float) -> tuple[np.ndarray, list[str]]:
    """Values at the times of the grid, held or interpolated; a note if their rate is another."""
    t = signal.t
    near = np.clip(np.searchsorted(t, grid - period / 2), 0, len(t) - 1)
    if np.max(np.abs(t[near] - grid)) <= UNEVEN * period:
        return signal.values[near], []
    if signal.held:
        before = np.searchsorted(t, grid + UNEVEN * period, side="right") - 1
        values = signal.values[np.clip(before, 0, None)]
    else:
        values = np.interp(grid, t, signal.values)
    if abs(signal.period / period - 1) < 0.1:
        return values, []  # jitter, or a few missing samples, which have notes of their own
    return values, [f"{signal.quantity}: {_rate(signal)}, {signal.rule}, resampled to {1 / period:.4g} Hz"]


def _rate(signal: Series) -> str:
    few = signal.period == 0 or len(signal.t) < 3
    return f"{len(signal.t)} samples" if few else f"{1 / signal.period:.4g} Hz"


def _line(signal: Series) -> str:
    """How a channel was read, with the range of its values."""
    factor, unit = SHOWN[signal.quantity]
    low, high = signal.values.min() * factor, signal.values.max() * factor
    read = f"column {printable(signal.channel.name, 30)}, {signal.text}, {_rate(signal)}"
    rule = "held" if signal.held else "linear"
    return f"{signal.quantity}: {read}, {rule}: {low:.4g} to {high:.4g} {unit}"
