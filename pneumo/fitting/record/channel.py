"""Channels of a record: each has a name, a unit and a clock of its own, whatever format it came from."""

import re
from collections.abc import Iterable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pneumo.errors import InputError, printable
from pneumo.fitting.record.units import Reading, reading

MOST_ROWS, MOST_COLUMNS = 2_000_000, 200
MISSING = ("", "nan", "na", "n/a", "null", "none", "-", "--", "#n/a")
WORDS = {"true": 1.0, "on": 1.0, "false": 0.0, "off": 0.0, "1": 1.0, "0": 0.0}
TIME_NAME = re.compile(r"(?:t|(?i:_*time|%time|zeit|temps|timestamp|x_value|x-axis))(?:[\s_\[(.].*)?")
DURATION = r"\d{1,4}:\d\d:\d\d(?:[.,]\d{1,9})?"
DATE = r"\d{1,2}([./])\d{1,2}\1\d{4} +\d{1,2}:\d\d:"
LARGEST = 1e30  # number that is no mistake
SEC = re.compile(r"(?P<before>.*?)(?P<part>nano|n)?secs?", re.IGNORECASE)


class Channel(NamedTuple):
    """Samples of one signal as a file holds them."""

    name: str
    values: np.ndarray  # numbers, or text and stamps; (samples,)
    unit: str = ""  # where the name does not contain it
    clock: "Channel | None" = None  # times of the samples; None: those of the column t
    held: bool | None = None  # between samples; None: a command is held, other signals are interpolated
    first_line: int = 0  # of the first sample in a text file; 0 for other files


class Series(NamedTuple):
    """Numbers of a channel that are not missing, in SI units, at their times."""

    quantity: str
    channel: Channel
    start: Fraction  # s, time of the first sample by the file's clock
    t: np.ndarray  # s, since then
    values: np.ndarray  # SI units
    rows: np.ndarray  # number of each sample among those of the channel
    text: str  # unit that it was read in
    held: bool

    @property
    def period(self) -> float:
        """Usual time between samples, s."""
        return float(np.median(np.diff(self.t))) if len(self.t) > 1 else 0.0


def limit(path: Path, number: int, most: int, things: str) -> None:
    """Raise `InputError` if a file has more of something than is read."""
    if number > most:
        raise InputError(f"{path}: {number} {things}: must be at most {most}")


def place(path: Path, channel: Channel, row: int, quantity: str) -> str:
    """Text that names a sample: by its line in a text file, else by its number."""
    where = f"line {row + channel.first_line}" if channel.first_line else f"sample {row}"
    return f"{path}: {where}, column {quantity}"


def refuse(path: Path, channel: Channel, quantity: str, rows: np.ndarray, problem: str) -> None:
    """Raise `InputError` for the first of some bad samples, if there are any; `{value}` is its text."""
    if len(rows):
        value = printable(str(channel.values[rows[0]]).strip(), 30)
        value = "empty" if value in ("", "nan", "NaT") else value
        more = f", and {len(rows) - 1} more" if len(rows) > 1 else ""
        text = problem.replace("{value}", repr(value))
        raise InputError(f"{place(path, channel, int(rows[0]), quantity)}: {text}{more}")


def numbers(path: Path, channel: Channel, quantity: str) -> np.ndarray:
    """Numbers of a channel, NaN where they are missing; `InputError` for other text or an infinite number."""
    import pandas as pd

    values = channel.values
    if values.dtype.kind in "iuf":
        result = values.astype(float)
        bad = np.abs(result) > LARGEST
    else:
        words = pd.Series(values).astype(str).str.strip().str.lower()
        absent = words.isin(MISSING).to_numpy()
        if quantity == "u" and words[~absent].isin(WORDS).all():
            return words.map(WORDS).to_numpy(dtype=float)
        result = np.array(pd.to_numeric(words, errors="coerce"), dtype=float)
        bad = ~(np.abs(result) < LARGEST) & ~absent
        if values.dtype.kind == "b":
            bad[:] = True
        result[absent] = np.nan
    refuse(path, channel, quantity, np.flatnonzero(bad), "{value}: must be a finite number")
    return result


def seconds(path: Path, clock: Channel, unit: str) -> tuple[Fraction, np.ndarray]:
    """Time of the first sample, s, and the times of all since then; NaN where there is none.

    Numbers in `unit`, ISO stamps, stamps of pandas, or durations such as `0.5 sec` or `00:01:02.5`.
    """
    import pandas as pd

    values = clock.values
    scale = reading("t", unit)
    if values.dtype.kind == "O" and len(values) and not isinstance(values[0], str | int | float):
        values = np.asarray(pd.Series(values).infer_objects())
    if values.dtype.kind == "O" or values.dtype.kind in "US":
        text = pd.Series(values).astype(str).str.strip()
        first = next((word for word in text if word.lower() not in MISSING), "")
        if first[:10].count("-") == 2 and ":" in first:
            values = pd.to_datetime(text, errors="coerce", format="ISO8601", utc=True).dt.tz_convert(None)
            bad = values.isna().to_numpy() & ~text.str.lower().isin(MISSING).to_numpy()
            problem = "{value}: must be a time stamp such as 2006-05-31T12:00:00.001"
            refuse(path, clock, "t", np.flatnonzero(bad), problem)
            values = values.to_numpy()
        elif re.match(DATE, first):  # only differences count, so the order of day and month does not matter
            values = pd.to_datetime(
                text.str.replace(",", "."), errors="coerce", format="mixed", dayfirst="." in first[:3]
            )
            bad = values.isna().to_numpy() & ~text.str.lower().isin(MISSING).to_numpy()
            refuse(
                path,
                clock,
                "t",
                np.flatnonzero(bad),
                "{value}: must be a time such as 31.05.2006 12:00:00.001",
            )
            values = values.to_numpy()
        elif re.fullmatch(DURATION, first):
            durations = pd.to_timedelta(text.where(text.str.fullmatch(DURATION)).str.replace(",", "."))
            bad = durations.isna().to_numpy() & ~text.str.lower().isin(MISSING).to_numpy()
            refuse(path, clock, "t", np.flatnonzero(bad), "{value}: must be a time such as 00:00:01.5")
            values = durations.to_numpy()
        elif match := re.fullmatch(r"\S+\s*(sec|s|ms|min)", first):
            values = text.str.removesuffix(match[1]).str.strip().to_numpy(dtype=object)
            scale = reading("t", match[1])
    if values.dtype.kind in "mM":
        unit_of = np.datetime_data(values.dtype)[0]
        ticks = values.astype(f"{values.dtype.kind}8[ns]") if unit_of != "ns" else values
        absent = np.isnat(ticks)
        whole = np.where(absent, 0, ticks.astype(np.int64))
        per_second = 1e-9
    else:
        if isinstance(scale, str):
            raise InputError(f"{path}: column {printable(clock.name, 30)}: {scale}")
        per_second = scale.factor
        if values.dtype.kind not in "iuf":
            try:  # int64 keeps the nanoseconds of a stamp, which a double does not
                values = np.array([int(v) for v in values], dtype=np.int64)
            except (ValueError, TypeError, OverflowError):
                values = numbers(path, clock._replace(values=values), "t")
        absent = ~np.isfinite(values.astype(float))
        whole = values
    if absent.all():
        return Fraction(0), np.full(len(absent), np.nan)
    first = whole[np.argmin(absent)]
    exact = Fraction(round(1 / per_second)) if per_second < 1 else 1 / Fraction(per_second)
    start = (Fraction(int(first)) if whole.dtype.kind in "iu" else Fraction(float(first))) / exact
    since = whole - first if whole.dtype.kind != "u" else whole.astype(np.int64) - int(first)
    return start, np.where(absent, np.nan, since.astype(float) * per_second)


def series(path: Path, channel: Channel, quantity: str, clock: Channel, t_unit: str, read: Reading) -> Series:
    """Numbers of a channel at their times. `InputError` if there is a number without a time."""
    start, t = seconds(path, clock, t_unit)
    values = numbers(path, channel, quantity)
    if len(values) != len(t):
        name = printable(channel.name, 30)
        raise InputError(
            f"{path}: column {name}: {len(values)} samples, {len(t)} times in {printable(clock.name, 30)}:"
            " it needs a time of its own, as long as it is"
        )
    present = np.isfinite(values)
    without = np.flatnonzero(present & ~np.isfinite(t))
    refuse(path, clock, "t", without, "{value}: must be a finite number")
    rows = np.flatnonzero(present)
    if not len(rows):
        raise InputError(f"{path}: column {printable(channel.name, 30)}: 0 samples: it is empty")
    t, shift = t[rows], t[rows[0]]
    held = channel.held if channel.held is not None else quantity == "u"
    start += Fraction(float(shift))
    return Series(
        quantity, channel, start, t - shift, read.factor * values[rows] + read.offset, rows, read.text, held
    )


def is_time(name: str) -> bool:
    """Whether a column's name says that it holds times: `t`, `Time [ms]`, `__time`, `t_P`."""
    return TIME_NAME.fullmatch(name.strip()) is not None


def table_channels(
    columns: Iterable[tuple[str, np.ndarray]],
    units: Sequence[str] = (),
    held: Sequence[bool | None] = (),
    first_line: int = 0,
    time_unit: str = "",
) -> list[Channel]:
    """Channels of a table.

    Where several columns have the same name of a time, each is the clock of those right of it. Columns of
    seconds and nanoseconds are one clock.
    """
    made = list[Channel]()
    for k, (name, values) in enumerate(columns):
        unit = units[k] if k < len(units) else ""
        rule = held[k] if k < len(held) else None
        made.append(Channel(name, values, unit, None, rule, first_line))
    names = [channel.name.strip().lower() for channel in made]
    times = [k for k, name in enumerate(names) if is_time(name)]
    repeated = [k for k in times if names.count(names[k]) > 1]
    result, clock, seen = list[Channel](), None, dict[str, int]()
    parts = _stamps(made)
    for k, channel in enumerate(made):
        if k in repeated:
            clock = channel._replace(unit=channel.unit or time_unit)
            continue
        if k in parts[1]:
            continue
        seen[channel.name] = seen.get(channel.name, 0) + 1
        name = f"{channel.name}.{k + 1}" if seen[channel.name] > 1 else channel.name
        unit = channel.unit or (time_unit if k in times else "")
        result.append(channel._replace(name=name, clock=clock or parts[0], unit=unit))
    return result


def _stamps(channels: Sequence[Channel]) -> tuple[Channel | None, tuple[int, ...]]:
    """Clock of columns such as header.stamp.sec and header.stamp.nanosec, and their numbers."""
    found = dict[tuple[str, bool], int]()
    for k, channel in enumerate(channels):
        match = SEC.fullmatch(channel.name.strip())
        if match and channel.values.dtype.kind in "iu":
            found.setdefault((match["before"].lower(), bool(match["part"])), k)
    for (before, nano), k in found.items():
        if not nano and (before, True) in found:
            fine = found[before, True]
            ticks = channels[k].values.astype(np.int64) * 10**9 + channels[fine].values.astype(np.int64)
            return Channel("Time", ticks, "ns", first_line=channels[k].first_line), (k, fine)
    return None, ()
