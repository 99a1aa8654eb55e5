"""Signals of a record in SI units, each at its own times."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from pneumo.errors import InputError, printable
from pneumo.fitting.record.channel import Channel, numbers, refuse
from pneumo.fitting.record.clocks import seconds
from pneumo.fitting.record.units import Reading


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
    note: str = ""  # rules by which its clock was read

    @property
    def period(self) -> float:
        """Usual time between samples, s; over two of them, as they may be early and late in turn."""
        count = min(2, len(self.t) - 1)
        return float(np.median(self.t[count:] - self.t[:-count])) / count if count else 0.0

    @property
    def missing(self) -> tuple[int, np.ndarray]:
        """Number of samples that it lacks at its usual rate, empty or left out, and the rows after them."""
        steps = np.diff(self.t)
        jumps = np.flatnonzero(steps > 1.5 * self.period)
        lost = int(np.sum(np.round(steps[jumps] / self.period) - 1)) if self.period else 0
        # A few: the usual time between samples of a long record is not that exact.
        most = round(float(np.ptp(self.t)) / self.period) + 1 - len(self.t) if self.period else 0
        return max(0, min(lost, most)), self.rows[jumps] + 1

    def end(self, sensors: float) -> float:
        """Time to which the last sample of a held signal is known, s, beside sensors that end at `sensors`.

        One that is logged where it changes holds to the end; one that is sampled, until its next sample.
        """
        steps = np.diff(self.t)
        sampled = len(steps) > 3 and steps.max() < 2 * self.period
        return min(sensors, self.t[-1] + self.period) if sampled else max(sensors, self.t[-1])

    @property
    def rule(self) -> str:
        """How it is continued between samples."""
        return "held" if self.held else "interpolated"


def series(
    path: Path,
    channel: Channel,
    quantity: str,
    clock: Channel,
    t_unit: str,
    read: Reading,
    present: np.ndarray,
    proposed: str,
) -> Series:
    """Numbers of a channel at their times. `InputError` if one has no time, or time does not increase.

    `present` and `proposed` are as in `seconds`.
    """
    start, t, note = seconds(path, clock, t_unit, present, proposed)
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
    return Series(quantity, channel, clock, start, t[rows] - shift, values, rows, read.text, held, note)
