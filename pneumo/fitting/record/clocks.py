"""Times of samples, from what files have for them: `RULES` for odd clocks, and periods that files state."""

import re
from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from pneumo.errors import InputError, printable
from pneumo.fitting.record.channel import MISSING, Channel, is_time, numbers, refuse
from pneumo.fitting.record.units import TIMES, plain_unit, reading, unit_name

DURATION = r"(?:\d{1,4}:)?\d\d?:\d\d(?:[.,]\d{1,9})?"  # the hours may be missing, as in Excel's mm:ss.0
CONTINUES = 3.0  # usual steps, within which a counter that began anew goes on
REPEATED = 0.2  # fraction of stamps that repeat the one before, of a clock coarser than the samples
ALIKE = 0.25  # relative difference of the numbers of samples of most stamps
PERIODS = re.compile(  # names without signs and spaces
    "tinc|(x|time)?incr(ement)?|(sampl(e|ing))(interval|period|time)|deltax|deltat|dt|ts|tinterval|stepsize"
    "|timestep|hresolution|xincrement"
)
RATES = re.compile("sampl(e|ing)(rate|frequency)|fs|rate|samplespersecond")
FREQUENCIES = {  # in small letters
    **dict.fromkeys(("", "hz", "s/s", "sa/s"), 1.0),
    **dict.fromkeys(("khz", "ksa/s"), 1e3),
    **dict.fromkeys(("mhz", "msa/s"), 1e6),
}
ODD_UNITS = (  # of clocks whose unit nobody wrote: least and largest value, unit, name
    (2e4, 8e4, "d", "days of Excel"),
    (7e5, 8e5, "d", "days of MATLAB"),
    (1e9, 5e9, "s", "seconds of a date"),
    (1e12, 5e12, "ms", "milliseconds of a date"),
    (1e15, 5e15, "us", "microseconds of a date"),
    (1e18, 5e18, "ns", "nanoseconds of a date"),
)
LONGEST_STEP = 1.0  # s, between samples of a record whose clock has no unit


class Ticks(NamedTuple):
    """Numbers of a clock, none missing, and their unit."""

    values: np.ndarray
    unit: str
    repeated: float = 0.0  # fraction of a signal's samples that have the number of the sample before

    @property
    def steps(self) -> np.ndarray:
        """Differences of neighbours."""
        return np.diff(self.values)


Rule = Callable[[Ticks], tuple[Ticks, str] | None]  # and a note; None where it does not apply


def date_numbers(ticks: Ticks) -> tuple[Ticks, str] | None:
    """Numbers without a unit that are days or seconds of a date."""
    low, high = ticks.values.min(), ticks.values.max()
    rising = ticks.steps[ticks.steps > 0]
    usual = float(np.median(rising)) if len(rising) else 0.0
    for least, largest, unit, name in ODD_UNITS:
        within = least <= low and high <= largest
        if not ticks.unit and within and usual * TIMES[unit] <= LONGEST_STEP:
            return ticks._replace(unit=unit), f"no unit, read as {name}"
    return None


def wrapped(ticks: Ticks) -> tuple[Ticks, str] | None:
    """A counter that begins anew after 2^16 or 2^32 counts, an hour or a day, and goes on as before."""
    back, factor = ticks.steps < 0, TIMES.get(ticks.unit, 1.0)
    if not back.any() or back.all():
        return None
    usual = float(np.median(ticks.steps[~back]))
    lengths = {f"2^{bits}": 2**bits for bits in (16, 32)}
    for bits in (16, 32):
        lengths |= {f"2^{bits} {unit}": 2**bits * TIMES[unit] / factor for unit in ("us", "ms")}
    lengths |= {"1 h": 3600 / factor, "24 h": 86400 / factor}
    for name, length in lengths.items():
        ahead = ticks.steps[back] + length
        if (ahead >= 0).all() and (ahead <= CONTINUES * usual).all():
            count = np.concatenate([[0], np.cumsum(back)])
            length = round(length) if ticks.values.dtype.kind in "iu" else length
            continued = ticks._replace(values=ticks.values + count * length)
            return continued, f"begins anew after {name}, continued"
    return None


def coarse(ticks: Ticks) -> tuple[Ticks, str] | None:
    """Stamps that repeat since they are coarser than the samples, which are uniform then."""
    starts = np.flatnonzero(ticks.steps) + 1
    if (ticks.steps < 0).any() or len(starts) < 3 or ticks.repeated < REPEATED:
        return None
    sizes, gaps = np.diff(starts), np.diff(ticks.values[starts])
    usual = float(np.median(sizes))
    # A stamp that is late has as many more samples before it.
    odd = np.abs(sizes / usual - gaps / np.median(gaps)) > max(ALIKE, 1.5 / usual)
    if np.mean(odd) > REPEATED / 2:
        return None
    period = float(np.polyfit(starts, (ticks.values[starts] - ticks.values[0]).astype(float), 1)[0])
    values = ticks.values[0] + period * np.arange(len(ticks.values))
    about = f"stamps repeat for {len(ticks.values) / (len(starts) + 1):.3g} samples each"
    return ticks._replace(values=values), f"{about}: taken as uniform"


RULES: tuple[Rule, ...] = (date_numbers, wrapped, coarse)  # each on the result of those before


def seconds(
    path: Path, clock: Channel, unit: str, present: np.ndarray | None = None, proposed: str = ""
) -> tuple[int, np.ndarray, str]:
    """Time of the first sample, ns, the times of all since then, s, NaN where there is none, and a note.

    Numbers in `unit`, stamps, or durations such as `0.5 sec` or `00:01:02.5`; the note names the `RULES` that
    applied. `present` says which of these samples the fullest signal has; the message on a unit that is
    missing ends with the text `proposed`.
    """
    values = np.asarray(pd.Series(clock.values).infer_objects())
    if values.dtype.kind in "OUS":
        text = pd.Series(values).astype(str).str.strip()
        absent = text.str.lower().str.fullmatch(MISSING).to_numpy(dtype=bool)
        first = next(iter(text[~absent]), "")
        stamps = _stamps(text, first)
        if stamps is not None:
            bad = np.flatnonzero(stamps.isna() & ~absent)
            refuse(path, clock, "t", bad, f"must be a time such as {printable(first, 30)}")
            values = stamps.to_numpy()
        elif match := re.fullmatch(r"\S+\s*(sec|s|ms|min)", first):
            values, unit = text.str.removesuffix(match[1]).str.strip().to_numpy(dtype=object), match[1]
    if values.dtype.kind in "mM":
        absent, unit = np.isnat(values), "ns"
        values = values.astype(f"{values.dtype.kind}8[ns]").astype(np.int64)
    else:  # int64 keeps the nanoseconds of a stamp, which a double does not
        of_clock = clock._replace(values=values)
        values = values.astype(np.int64) if values.dtype.kind in "iu" else numbers(path, of_clock, "t")
        absent = np.isnan(values)
    whole = present is None or len(present) != len(values)
    own = values[~absent if whole else ~absent & present]
    repeated = float(np.mean(np.diff(own) == 0)) if len(own) > 1 else 0.0
    ticks = Ticks(values[~absent], unit_name(plain_unit(unit), TIMES) or unit, repeated)
    notes = [clock.note]
    for rule in RULES if len(ticks.values) > 2 else ():
        if changed := rule(ticks):
            ticks, note = changed
            notes.append(f"column {printable(clock.name, 30)}: {note}")
    read = reading("t", ticks.unit)
    if isinstance(read, str):
        raise InputError(f"{path}: column {printable(clock.name, 30)}: {read}{'' if unit else proposed}")
    t = np.full(len(absent), np.nan)
    if absent.all():
        return 0, t, ""
    first = ticks.values[0]
    t[~absent] = (ticks.values - first).astype(float) * read.factor
    return round(Fraction(first.item()) * round(1e9 * read.factor)), t, "; ".join(filter(None, notes))


def _stamps(text: pd.Series, first: str) -> pd.Series | None:
    """Stamps or durations, NaT where a text is none; None if the first text is neither."""
    if re.fullmatch(DURATION, first):
        durations = text.where(text.str.fullmatch(DURATION)).str.replace(",", ".")
        return pd.to_timedelta(durations.mask(durations.str.count(":") == 1, "00:" + durations))
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


class Setting(NamedTuple):
    """Number that a file states about itself."""

    name: str
    value: float
    unit: str = ""


def letters(name: str) -> str:
    """Letters and digits of a name, in lower case."""
    return re.sub(r"[\W_]", "", name.lower())


def stated_period(settings: Iterable[Setting]) -> tuple[float, str] | None:
    """Time between samples that a file states, s, and the setting's name; without units in s, or Hz."""
    for name, value, unit in settings:
        read = reading("t", unit or "s")
        frequency = FREQUENCIES.get(unit.lower(), 0.0)
        if PERIODS.fullmatch(letters(name)) and value > 0 and not isinstance(read, str):
            return value * read.factor, name
        if RATES.fullmatch(letters(name)) and value * frequency > 0:
            return 1 / (value * frequency), name
    return None


def with_stated_clock(channels: Sequence[Channel], settings: Iterable[Setting]) -> list[Channel]:
    """Channels of which those without times have the clock that a file states; empty times are left out."""
    stated = stated_period(settings)
    times = [c for c in channels if is_time(c.name) and pd.notna(c.values[:5]).any()]
    if stated is None or times:
        return [*channels]
    period, name = stated
    note = f"no column of times: a sample every {period:.6g} s, by {printable(name, 30)}"
    return [
        c if c.clock else c._replace(clock=Channel("Time", period * np.arange(len(c.values)), "s", note=note))
        for c in channels
        if not is_time(c.name)
        and not np.array_equal(c.values, np.arange(len(c.values)))  # numbers of samples
    ]
