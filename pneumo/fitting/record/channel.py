"""Channels of a record: each has a name, a unit and a clock of its own, whatever format it came from."""

import re
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from pneumo.errors import InputError, printable
from pneumo.fitting.record.units import Reading, reading

MOST_ROWS = 2_000_000
MISSING = ("", "nan", "na", "n/a", "null", "none", "-", "--", "#n/a")
WORDS = {"true": 1.0, "on": 1.0, "false": 0.0, "off": 0.0, "1": 1.0, "0": 0.0}
TIME = r"(?i:_*time|%time|zeit|temps|timestamp|x_value|x-axis)"  # names of times, besides t
TIME_NAME = re.compile(rf"(?:t|{TIME})(?:[\s_\[(.].*)?")
PATH = re.compile(r"[^\[(]*[/.|]")  # of a signal in a tree of names
DURATION = r"\d{1,4}:\d\d:\d\d(?:[.,]\d{1,9})?"
LARGEST = 1e30  # number that is no mistake


class Channel(NamedTuple):
    """Samples of one signal as a file holds them."""

    name: str
    values: np.ndarray  # numbers, or text and stamps; (samples,)
    unit: str = ""  # where the name does not contain it
    clock: "Channel | None" = None  # times of the samples; None: those of the column t
    held: bool | None = None  # between samples; None: a command is held, other signals are interpolated
    first_line: int = 0  # of the first sample in a text file; 0 for other files


def limit(path: Path, number: int, most: int, things: str) -> None:
    """Raise `InputError` if a file has more of something than is read."""
    if number > most:
        raise InputError(f"{path}: {number} {things}: must be at most {most}")


class Series(NamedTuple):
    """Numbers of a channel that are not missing, in SI units, at their times."""

    quantity: str
    channel: Channel
    clock: Channel
    start: int  # ns, time 0 by the file's clock
    t: np.ndarray  # s, from the first sample of any signal
    values: np.ndarray  # SI units
    rows: np.ndarray  # number of each sample among those of the channel
    text: str  # unit that it was read in
    held: bool

    @property
    def period(self) -> float:
        """Usual time between samples, s; over two of them, as they may be early and late in turn."""
        count = min(2, len(self.t) - 1)
        return float(np.median(self.t[count:] - self.t[:-count])) / count if count else 0.0

    @property
    def rule(self) -> str:
        """How it is continued between samples."""
        return "held" if self.held else "interpolated"


def refuse(path: Path, channel: Channel, quantity: str, rows: np.ndarray, problem: str) -> None:
    """Raise `InputError` for the first of some bad samples, if there are any, with its line or number."""
    if len(rows):
        value = printable(str(channel.values[rows[0]]).strip(), 30)
        value = "empty" if value in ("", "nan", "NaT") else value
        where = f"line {rows[0] + channel.first_line}" if channel.first_line else f"sample {rows[0]}"
        more = f" (and {len(rows) - 1} more)" if len(rows) > 1 else ""
        raise InputError(f"{path}: {where}, column {quantity}{more}: {value!r}: {problem}")


def numbers(path: Path, channel: Channel, quantity: str) -> np.ndarray:
    """Numbers of a channel, NaN where they are missing; `InputError` for other text or an infinite number."""
    values = channel.values
    if values.dtype.kind in "iuf":
        result, absent = values.astype(float), np.isnan(values)
    else:
        words = pd.Series(values).astype(str).str.strip().str.lower()
        absent = words.isin(MISSING).to_numpy()
        if quantity == "u" and words[~absent].isin(WORDS).all():
            return words.map(WORDS).to_numpy(dtype=float)
        result = np.array(pd.to_numeric(words, errors="coerce"), dtype=float)
        result[absent] = np.nan
    bad = ~(np.abs(result) < LARGEST) & ~absent
    refuse(path, channel, quantity, np.flatnonzero(bad), "must be a finite number")
    return result


def seconds(path: Path, clock: Channel, unit: str) -> tuple[int, np.ndarray]:
    """Time of the first sample, ns, and the times of all since then, s; NaN where there is none.

    Numbers in `unit`, stamps, or durations such as `0.5 sec` or `00:01:02.5`.
    """
    values = np.asarray(pd.Series(clock.values).infer_objects())
    if values.dtype.kind in "OUS":
        text = pd.Series(values).astype(str).str.strip()
        absent = text.str.lower().isin(MISSING)
        first = next(iter(text[~absent]), "")
        stamps = _stamps(text, first)
        if stamps is not None:
            bad = np.flatnonzero(stamps.isna() & ~absent)
            refuse(path, clock, "t", bad, f"must be a time such as {printable(first, 30)}")
            values = stamps.to_numpy()
        elif match := re.fullmatch(r"\S+\s*(sec|s|ms|min)", first):
            values, unit = text.str.removesuffix(match[1]).str.strip().to_numpy(dtype=object), match[1]
    if values.dtype.kind in "mM":
        values, absent, unit = (
            values.astype(f"{values.dtype.kind}8[ns]").astype(np.int64),
            np.isnat(values),
            "ns",
        )
    else:  # int64 keeps the nanoseconds of a stamp, which a double does not
        of_clock = clock._replace(values=values)
        values = values.astype(np.int64) if values.dtype.kind in "iu" else numbers(path, of_clock, "t")
        absent = np.isnan(values)
    read = reading("t", unit)
    if isinstance(read, str):
        raise InputError(f"{path}: column {printable(clock.name, 30)}: {read}")
    if absent.all():
        return 0, np.full(len(absent), np.nan)
    first = values[np.argmin(absent)]
    start = round(Fraction(first.item()) * round(1e9 * read.factor))
    return start, np.where(absent, np.nan, (values - first).astype(float) * read.factor)


def _stamps(text: pd.Series, first: str) -> pd.Series | None:
    """Stamps or durations, NaT where a text is none; None if the first text is neither."""
    if re.fullmatch(DURATION, first):
        return pd.to_timedelta(text.where(text.str.fullmatch(DURATION)).str.replace(",", "."))
    if re.match(r"\d{4}([-/])\d\d\1\d\d\D.*:", first):
        plain = text.str.replace("/", "-").str.replace(",", ".")
        return pd.to_datetime(plain, errors="coerce", format="ISO8601", utc=True).dt.tz_convert(None)
    if not re.match(r"\d{1,2}([./])\d{1,2}\1\d{4}\D.*:", first):
        return None
    plain = text.str.replace(r",(?=\d)", ".", regex=True).str.replace(r",?\s+", " ", regex=True)
    plain = plain.str.replace(r"(:\d\d)(?![.:\d])", r"\1.0", regex=True).str.replace("/", ".")
    clock = "%I:%M:%S.%f %p" if first[-1] in "mM" else "%H:%M:%S.%f"
    # Day or month first: as all the stamps allow, else so that they are close together.
    dates = [pd.to_datetime(plain, errors="coerce", format=f"{day}.%Y {clock}") for day in ("%d.%m", "%m.%d")]
    return min(dates, key=lambda date: (date.isna().sum(), date.max() - date.min()))


def series(path: Path, channel: Channel, quantity: str, clock: Channel, t_unit: str, read: Reading) -> Series:
    """Numbers of a channel at their times. `InputError` if one has no time, or time does not increase."""
    start, t = seconds(path, clock, t_unit)
    values = numbers(path, channel, quantity)
    if len(values) != len(t):
        name = printable(channel.name, 30)
        times = f"must be as many as times in {printable(clock.name, 30)}, {len(t)}"
        raise InputError(f"{path}: column {name}: {len(values)} samples: {times}")
    present = np.isfinite(values)
    refuse(path, clock, "t", np.flatnonzero(present & np.isnan(t)), "must be a finite number")
    rows = np.flatnonzero(present)
    if not len(rows):
        raise InputError(f"{path}: column {printable(channel.name, 30)}: 0 samples: it is empty")
    refuse(path, clock, "t", rows[1:][np.diff(t[rows]) <= 0], f"time of {quantity} must increase")
    shift = t[rows[0]]
    held = channel.held if channel.held is not None else quantity == "u"
    values = read.factor * values[rows] + read.offset
    start += round(1e9 * float(shift))
    return Series(quantity, channel, clock, start, t[rows] - shift, values, rows, read.text, held)


def is_time(name: str) -> bool:
    """Whether a column's name says that it holds times: `t`, `Time [ms]`, `__time`, `t_P`."""
    return TIME_NAME.fullmatch(name.strip()) is not None


def table_channels(columns: Sequence[Channel]) -> list[Channel]:
    """Channels of a table's columns, with their clocks.

    Where several columns have the same name of a time, at the end of a path or alone, each is the clock of
    those right of it. Columns of seconds and nanoseconds are one clock.
    """
    names = [PATH.sub("", channel.name).strip().lower() for channel in columns]
    result, (clock, parts) = list[Channel](), _sec_nanosec(columns)
    for k, channel in enumerate(columns):
        if is_time(names[k]) and names.count(names[k]) > 1:
            clock = channel
        elif k not in parts:
            result.append(channel._replace(clock=clock))
    return distinct(result)


def distinct(channels: Sequence[Channel]) -> list[Channel]:
    """Channels with different names: a repeated one gets its number too."""
    first = {channel.name: k for k, channel in reversed([*enumerate(channels)])}
    return [c if first[c.name] == k else c._replace(name=f"{c.name}.{k + 1}") for k, c in enumerate(channels)]


def _sec_nanosec(channels: Sequence[Channel]) -> tuple[Channel | None, tuple[int, ...]]:
    """Clock of columns such as header.stamp.sec and header.stamp.nanosec, and their numbers."""
    whole = {c.name.strip().lower(): k for k, c in enumerate(channels) if c.values.dtype.kind in "iu"}
    for name, k in whole.items():
        stem = re.sub("secs?$", "", name)
        for fine in (whole.get(f"{stem}{end}", k) for end in ("nanosec", "nsec", "nsecs")):
            if fine != k:
                ticks = channels[k].values.astype(np.int64) * 10**9 + channels[fine].values.astype(np.int64)
                return Channel("Time", ticks, "ns", first_line=channels[k].first_line), (k, fine)
    return None, ()
