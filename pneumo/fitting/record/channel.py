"""Channels of a record: each has a name, a unit and a clock of its own, whatever format it came from."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from pneumo.errors import InputError, printable

MOST_ROWS = 2_000_000
MISSING = re.compile(  # in small letters: of loggers, C libraries, spreadsheets, meters beyond their range
    r"|[+-]?(nan|inf|infinity|∞)(\(\w*\))?|[+-]?1\.#(qnan|snan|ind|inf)\d*|n\.?/?a\.?|null|none|-+"
    r"|#(n/a|value!|num!|div/0!|ref!|null!|name\?)|[+-]?(ol|ovld|over|overload|overrange|overflow)"
)
WORDS = {"true": 1.0, "on": 1.0, "false": 0.0, "off": 0.0, "1": 1.0, "0": 0.0}
TIME = r"(?i:_*time|%time|zeit|temps|timestamp|x_value|x-axis)"  # names of times, besides t
TIME_NAME = re.compile(rf"(?:t|{TIME})(?:[\s_\[(.].*)?")
PATH = re.compile(r"[^\[(]*[/.|]")  # of a signal in a tree of names
LARGEST = 1e30  # number that is no sign of an overload


class Channel(NamedTuple):
    """Samples of one signal as a file holds them."""

    name: str
    values: np.ndarray  # numbers, or text and stamps; (samples,)
    unit: str = ""  # where the name does not contain it
    clock: "Channel | None" = None  # times of the samples; None: those of the column t
    held: bool | None = None  # between samples; None: a command is held, other signals are interpolated
    first_line: int = 0  # of the first sample in a text file; 0 for other files
    other: str = ""  # another name of the same column, which a mapping may use
    note: str = ""  # how it was made, if the file has no such column


def limit(path: Path, number: int, most: int, things: str) -> None:
    """Raise `InputError` if a file has more of something than is read."""
    if number > most:
        raise InputError(f"{path}: {number} {things}: must be at most {most}")


def refuse(path: Path, channel: Channel, quantity: str, rows: np.ndarray, problem: str) -> None:
    """Raise `InputError` for the first of some bad samples, if there are any, with its line or number."""
    if len(rows):
        value = printable(str(channel.values[rows[0]]).strip(), 30)
        value = "empty" if value in ("", "nan", "NaT") else value
        where = f"line {rows[0] + channel.first_line}" if channel.first_line else f"sample {rows[0]}"
        more = f" (and {len(rows) - 1} more)" if len(rows) > 1 else ""
        raise InputError(f"{path}: {where}, column {quantity}{more}: {value!r}: {problem}")


def numbers(path: Path, channel: Channel, quantity: str) -> np.ndarray:
    """Numbers of a channel, NaN where they are missing or infinite; `InputError` for other text."""
    values = channel.values
    if values.dtype.kind in "iuf":
        result, unread = values.astype(float), np.zeros(len(values), dtype=bool)
    else:
        words = pd.Series(values).astype(str).str.strip().str.lower()
        absent = words.str.fullmatch(MISSING).to_numpy(dtype=bool)
        if quantity == "u" and words[~absent].isin(WORDS).all():
            return words.map(WORDS).to_numpy(dtype=float)
        result = np.array(pd.to_numeric(words.mask(absent), errors="coerce"), dtype=float)
        unread = np.isnan(result) & ~absent
    refuse(path, channel, quantity, np.flatnonzero(unread), "must be a finite number")
    return np.where(np.abs(result) < LARGEST, result, np.nan)


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
