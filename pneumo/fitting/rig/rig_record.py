"""Record of one volume of gas, cut into runs that start at rest."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from pneumo.errors import InputError
from pneumo.fitting.record.channel import refuse
from pneumo.fitting.record.columns import Columns, columns_of
from pneumo.fitting.record.formats import read_channels
from pneumo.fitting.record.measurement import read_series
from pneumo.fitting.record.units import Surroundings
from pneumo.fitting.rig.rig_file import Rig
from pneumo.fitting.stage_signals import smoothed

RISEN = 0.015  # of the pressure's range, above which a pulse has begun
FALLEN = 0.7  # of a pulse's largest pressure, below which the valve has closed
BEFORE, AFTER = 10e-3, 30e-3  # s, of a run before its pulse begins and after it has ended
UNEVEN = 0.02  # variation of the steps between samples, over their mean, that is negligible
SHORTEST = 5  # samples between the edges of a pulse
INSTEAD = {"u": "; or --command edges", "P_B": "; or a rig without dead_volume_B_mL"}
STEPS = 600  # of a run without samples uniform in time


class Points(NamedTuple):
    """Time series of a measured quantity."""

    t: np.ndarray  # s, from the start of the run
    values: np.ndarray  # SI units

    def part(self, chosen: np.ndarray | slice) -> "Points":
        """The chosen points."""
        return Points(self.t[chosen], self.values[chosen])


class Run(NamedTuple):
    """Part of a record that starts at rest."""

    h: float  # s, between the samples of its inputs
    x: np.ndarray  # m, position from its smallest in the record, by sample; 0 for a vessel
    on: float  # s, edge of the pressure, or of the command, as the valve opens; NaN without valve
    off: float  # s, the same as it closes
    P: Points  # Pa, absolute
    T: Points | None = None  # K, of the gas
    P_B: Points | None = None  # Pa, of the other chamber behind a 5/2 valve
    travel: float = 0.0  # m, largest x of the record, at which that chamber is smallest

    @property
    def t(self) -> np.ndarray:
        """Times of the samples of its inputs, s."""
        return self.h * np.arange(len(self.x))

    @property
    def pressures(self) -> tuple[Points, ...]:
        """Measured pressures by chamber."""
        return (self.P,) if self.P_B is None else (self.P, self.P_B)

    def within(self, first: float, last: float) -> "Run":
        """The run with what was measured after one time and up to another, s."""
        measured = {"P": self.P, "P_B": self.P_B, "T": self.T}
        kept = {
            name: points.part((first < points.t) & (last >= points.t))
            for name, points in measured.items()
            if points is not None
        }
        return self._replace(**kept)


def edges(P: np.ndarray) -> list[tuple[float, float]]:
    """Begin and end of each pulse of a pressure, as positions in samples; no sample may be missing.

    A pulse begins where the pressure leaves its lowest value, and ends where it last falls through `FALLEN`
    of its largest. Both are interpolated linearly between samples. Of several begins with one end the last
    counts: the others are noise before the pulse.
    """
    low, level = P.min(), RISEN * np.ptp(P)
    above = low + level < P
    starts = np.flatnonzero(above[1:] & ~above[:-1])
    ends = np.flatnonzero(above[:-1] & ~above[1:])
    begins = dict[float, float]()  # by end
    for start in starts:
        later = ends[ends > start + SHORTEST]
        if not len(later):
            break
        pulse = P[start : later[0] + 2] - low
        if pulse.max() < FALLEN * np.ptp(P):  # noise at the end of a pulse
            continue
        falls = np.flatnonzero((pulse[:-1] >= FALLEN * pulse.max()) & (pulse[1:] < FALLEN * pulse.max()))[-1]
        begin = start + (level - pulse[0]) / (pulse[1] - pulse[0])
        beyond = (pulse[falls] - FALLEN * pulse.max()) / (pulse[falls] - pulse[falls + 1])
        begins[float(start + falls + beyond)] = float(begin)
    return [(begin, end) for end, begin in begins.items()]


def commanded(u: np.ndarray) -> list[tuple[float, float]]:
    """First sample with a two-state command on, and first with it off again, for each pulse."""
    on = u > (u.min() + u.max()) / 2
    starts, ends = np.flatnonzero(on[1:] & ~on[:-1]) + 1, np.flatnonzero(on[:-1] & ~on[1:]) + 1
    return [(float(k), float(ends[ends > k][0])) for k in starts if (ends > k).any()]


def pulses(
    t: np.ndarray,
    x: np.ndarray,
    P: np.ndarray,
    u: np.ndarray | None = None,
    P_B: np.ndarray | None = None,
    T: Points | None = None,
) -> list[Run]:
    """Measured pulses of a chamber or vessel that an on/off valve fills and vents, one `Run` each.

    `t`, s, is uniform from 0. The volume of a chamber grows with `x`, m, which is smoothed here; of a vessel
    x is 0. P, Pa, is the absolute pressure, P_B that in the other chamber, `T` the temperature of the gas.
    `u` is the two-state command of the valve; without it, the valve opens and closes where P rises and falls
    (`edges`).

    Raises
    ------
    InputError
        If there is no whole pulse.
    """
    h = float(t[-1] - t[0]) / (len(t) - 1)
    x = smoothed(t, x)
    x = x - x.min()
    calm = P.min() + RISEN * np.ptp(P)
    runs = []
    for on, off in edges(P) if u is None else commanded(u):
        first = int(on) - round(BEFORE / h)
        settled = np.flatnonzero(P[int(off) :] <= calm)
        last = int(off) + (settled[0] if len(settled) else len(P)) + round(AFTER / h)
        if first < 0 or last >= len(P):
            continue
        k = np.arange(first, last + 1)
        times = h * (k - first)
        other = None if P_B is None else Points(times, P_B[k])
        edge = (on - first) * h, (off - first) * h
        of_gas = T and Points(T.t - h * first, T.values).part((T.t >= h * first) & (T.t <= h * last))
        of_gas = of_gas if of_gas and len(of_gas.t) else None
        runs.append(Run(h, x[k], *edge, Points(times, P[k]), of_gas, other, travel=x.max()))
    if not runs:
        raise InputError("no whole pulse: the pressure must rise from its lowest value and return to it")
    return runs


def vessel_run(P: Points, T: Points | None = None) -> Run:
    """Run of a vessel from time 0, with samples as dense as its steps need."""
    h = float(max(P.t[-1], T.t[-1] if T else 0.0)) / STEPS
    return Run(h, np.zeros(STEPS + 1), np.nan, np.nan, P, T)


def read_runs(
    source: Path | str | pd.DataFrame | xr.Dataset,
    rig: Rig,
    mapping: Columns | None = None,
    *,
    from_edges: bool = False,
) -> list[Run]:
    """Runs of a record of one volume of gas.

    Parameters
    ----------
    source
        File or table with t, P_A and, where they were measured, T, x, u and P_B; or NetCDF with P and T at
        their own times t_P and t_T. What is missing in a row was not measured there.
    rig
        What is known of the rig: a chamber needs x, both chambers P_B, an on/off valve u unless `from_edges`.
    mapping
        Column and unit of each quantity; by default as the file's header names them.
    from_edges
        Whether the edges of the pressure replace the valve's command.

    Raises
    ------
    InputError
        If the file or a column is not usable, or has no whole pulse.
    """
    path, channels = read_channels(source)
    columns = columns_of(mapping, channels)
    vessel, both = rig.has("volume"), rig.has("dead_volume_B")
    shut = vessel and not rig.has("valve_C_in")
    of_rig = {"P_A": True, "x": not vessel, "u": not shut and not from_edges, "P_B": both}
    needed = [quantity for quantity, used in of_rig.items() if used]
    around = Surroundings(P_atm=rig.ends["P_surroundings"][0], R=rig.gas.R)
    signals = read_series(path, channels, columns, around, needed, INSTEAD)
    for name in signals.keys() & {"P_A", "P_B"}:
        P = signals[name]
        allowed = "must be positive, absolute; a gauge's unit is written bar(g)"
        refuse(path, P.channel, name, P.rows[P.values <= 0], allowed)
    P_A = signals["P_A"]
    if len(P_A.t) < SHORTEST:
        raise InputError(f"{path}: column P_A: {len(P_A.t)} numbers: must be at least {SHORTEST}")
    # Times count from the first sample, but of a pressure P with times of its own from the run's start.
    begin = P_A.start / 1e9 if not mapping and P_A.channel.name == "P" and P_A.channel.clock else 0.0
    points = {name: Points(signal.t + begin, signal.values) for name, signal in signals.items()}
    pressure, T = points["P_A"], points.get("T")
    if shut:
        return [vessel_run(pressure, T)]
    t, x = (pressure.t, np.zeros_like(pressure.t)) if vessel else points["x"]
    steps = np.diff(t)
    if len(t) < SHORTEST or np.ptp(steps) > UNEVEN * np.mean(steps):
        allowed = f"must be equally spaced, within {100 * UNEVEN:g} % of their mean"
        raise InputError(f"{path}: t: samples are {steps.min():.3g} to {steps.max():.3g} s apart: {allowed}")
    P_B = np.interp(t, *points["P_B"]) if both else None
    u = None
    if not from_edges:  # held until the next sample
        last = np.searchsorted(points["u"].t, t + 1e-9, side="right") - 1
        u = points["u"].values[np.clip(last, 0, None)]
    return pulses(t, x, np.interp(t, *pressure), u, P_B, T)
