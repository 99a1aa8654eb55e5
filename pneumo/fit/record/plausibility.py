"""Checks of a measurement's columns: errors for what is impossible, notes for what is unlikely."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.errors import InputError
from pneumo.fit.record.columns import PRESSURE, gauge_zero, pressure_unit
from pneumo.physics.valve import Conditions

PERIODS = (1e-5, 0.1)  # s, between samples of a cylinder at work: its chambers fill within a second
PERIODS_CLOSED = (1e-5, 10.0)  # of closed chambers, which settle within minutes
GAP = 3.0  # periods between samples that are a gap
TO_AND_FRO = 0.2  # of half the stroke, that a piston moves both ways
UNEVEN = 1e-3  # deviation from a uniform grid, in periods, that is negligible
SUPPLY = (0.4, 1.6)  # of the configured supply pressure, between which a measured one is possible
OF_SUPPLY = 1.3  # measured pressure over the supply's that is possible
COMMON = ("kPa", "bar", "Pa", "MPa", "mbar", "hPa", "psi")  # units, tried in this order
LEAST_GAUGE = 0.2  # of the atmosphere, that a gauge pressure reaches if another unit is right
# Of the supply's gauge pressure, below which both chambers of a cylinder at work hardly stay: at rest behind
# a servo valve they have some 0.8. It finds a unit that is too small by more than 4.
LEAST_AT_WORK = 0.25
TOO_LARGE = 3.0  # pressure over what is possible at which another unit is likelier
AVERAGING = 0.02  # s, over which noise is small beside the motion of the piston


class Samples(NamedTuple):
    """Columns of a file in SI units by quantity."""

    path: Path
    first_line: int  # of the first sample, or 0 where the file has no lines
    values: dict[str, np.ndarray]
    units: Mapping[str, str] = MappingProxyType({})  # in which columns were read, by quantity; else SI

    def refuse(self, bad: np.ndarray, quantity: str, problem: Callable[[int, int], str]) -> None:
        """Raise an `InputError` that names the first bad sample, if any sample is bad.

        `problem(first, more)` gives the reason: `first` is that sample's index, `more` the number of other
        bad ones.
        """
        indices = np.flatnonzero(bad)
        if len(indices):
            first = int(indices[0])
            row = f"line {first + self.first_line}" if self.first_line else f"sample {first}"
            raise InputError(f"{self.path}: {row}, column {quantity}: {problem(first, len(indices) - 1)}")


def check_time(samples: Samples, closed: bool = False) -> tuple[float, list[str]]:
    """Sampling period of the time column, s, and remarks.

    `InputError` if time has gaps or goes back, or if the period is too short or too long to show a cylinder
    at work, or `closed` chambers, which change more slowly.
    """
    t = samples.values["t"]
    steps = np.diff(t, prepend=-np.inf)  # each sample's from the one before
    samples.refuse(steps <= 0, "t", lambda k, _: f"{t[k]:.9g} s follows {t[k - 1]:.9g} s: time must increase")
    usual = float(np.median(steps[1:]))
    shortest, longest = PERIODS_CLOSED if closed else PERIODS
    if not shortest <= usual <= longest:
        factor, unit = (1e3, "ms") if usual > longest else (1e-3, "s")
        raise InputError(
            f"{samples.path}: column t: samples are {usual:.3g} s apart: must be {shortest:g} to {longest:g}"
            " s" + (f"; is t in {unit}?" if shortest <= usual / factor <= longest else "")
        )
    samples.refuse(
        np.isfinite(steps) & (steps > GAP * usual),
        "t",
        lambda k, more: (
            f"a gap of {steps[k]:.4g} s after t = {t[k - 1]:.6g} s, where samples are {usual:.4g} s apart:"
            f" cut the file there and fit one part{f'; {more} more gaps' if more else ''}"
        ),
    )
    period = float(t[-1] - t[0]) / (len(t) - 1)
    uneven = float(np.max(np.abs(t - t[0] - period * np.arange(len(t))))) / period
    if uneven <= UNEVEN:
        return period, []
    return period, [
        f"time is not uniform: samples deviate by up to {uneven:.2g} periods of {period:.4g} s from"
        " a uniform grid; signals are interpolated to it"
    ]


def check_signals(samples: Samples, plant: Plant, from_end: bool, closed: bool = False) -> list[str]:
    """Notes on pressures, position and command.

    `InputError` if a pressure, position or temperature is impossible, or a signal is constant. In `closed`
    chambers pressures may exceed the supply's, and signals may be constant: the fit itself checks them.
    """
    path, values = samples.path, samples.values
    c, half, u_max = plant.conditions, plant.cylinder.stroke / 2, plant.valve.u_max
    notes = [note for name in ("P_A", "P_B") for note in _check_pressure(samples, name, plant, closed)]
    notes += [] if closed else _low_pressures(values, c)
    x, shift = values["x"], half if from_end else 0.0
    span = f"{shift - half:g} to {shift + half:g} m"
    hint = "" if from_end or x.min() < -0.1 * half else "; does it count from the end? --x-from end"
    hint = "; is the unit right?" if np.ptp(x) > 2.2 * half else hint
    outside = f"m is outside the stroke, {span}{hint}"
    samples.refuse(np.abs(x) > 1.05 * half, "x", lambda k, _: f"{x[k] + shift:.4g} {outside}")
    beyond = float(np.mean(np.abs(values["u"]) > u_max))
    if beyond:
        notes.append(
            f"column u: beyond the limiter's {u_max:g} V in {100 * beyond:.2g} % of samples; limited"
        )
    for name in ("x", "P_A", "P_B", *(("m_A", "m_B") if "m_A" in values else ("u",))):
        if np.ptp(values[name]) == 0 and not closed:
            raise InputError(f"{path}: column {name}: {values[name][0]:.4g} in every sample: nothing to fit")
    if not closed and "m_A" not in values and _one_sided(values, half):
        low, high = float(values["u"].min()), float(values["u"].max())
        middle = f"{(low + high) / 2:.2g}"
        raise InputError(
            f"{path}: column u: {low:.4g} to {high:.4g} V, of one sign, while the piston moves both ways:"
            f" must be negative where chamber B is filled; if the valve is shut at, say, {middle} V, give the"
            f" column an `offset: -{middle}` in the file of --columns"
        )
    if "T" in values:
        mean = f"column T: {np.mean(values['T']):.4g} K on average"
        if not 200 < np.mean(values["T"]) < 400:
            raise InputError(f"{path}: {mean}: must lie between 200 and 400 K; is it degC?")
        configured = f"T_amb {c.T_amb:.4g} K and T_in {c.T_in:.4g} K"
        notes.append(f"{mean}, of the surroundings, in place of the configured {configured}")
    if "P_s" in values:
        notes.append(_check_supply(samples, c.P_s))
    if not c.P_atm < c.P_s:
        raise InputError(f"P_s = {c.P_s:g} Pa: must exceed P_atm")
    return notes


def _one_sided(values: dict[str, np.ndarray], half: float) -> bool:
    """Whether a command never changes sign although the piston goes far to and fro."""
    u, x = values["u"], values["x"]
    forth, back = (x - np.minimum.accumulate(x)).max(), (np.maximum.accumulate(x) - x).max()
    return bool((u.min() >= 0 or u.max() <= 0) and min(forth, back) > TO_AND_FRO * half)


def _check_pressure(samples: Samples, name: str, plant: Plant, closed: bool) -> list[str]:
    """Notes on a pressure; `InputError` if supply and atmosphere do not allow it."""
    path, P, c = samples.path, samples.values[name], plant.conditions
    top, low = float(np.percentile(P, 99)), float(np.percentile(P, 1))
    unit, gauge = pressure_unit(samples.units.get(name, "Pa"))
    zero = gauge_zero(c.P_atm) if gauge else 0.0
    if top > TOO_LARGE * c.P_s or top < c.P_atm / TOO_LARGE:
        for other in COMMON:
            factor = PRESSURE[other] / PRESSURE[unit]
            least, most = (zero + factor * (end - zero) for end in (low, top))
            idle = gauge and most < (1 + LEAST_GAUGE) * c.P_atm
            if 0.5 * c.P_atm < least and most < OF_SUPPLY * c.P_s and not idle:
                raise InputError(
                    f"{path}: column {name}: {low:.4g} to {top:.4g} Pa, but only {c.P_atm:.4g}"
                    f" (atmosphere) to {c.P_s:.4g} (supply) is possible: it was read in {unit}; is it in"
                    f" {other} (a factor of {max(factor, 1 / factor):.6g})?"
                )
    rest = "must be absolute; a gauge's unit is written bar(g)"
    below = f"Pa is far below the atmosphere's {c.P_atm:.4g} Pa: {rest}"
    samples.refuse(0.5 * c.P_atm >= P, name, lambda k, _: f"{P[k]:.4g} {below}")
    if top > OF_SUPPLY * c.P_s and not closed:
        raise InputError(
            f"{path}: column {name}: up to {top:.4g} Pa, far above the supply's {c.P_s:.4g} Pa"
            " (P_s_Pa, absolute); is the unit right?"
        )
    if low < 0.9 * c.P_atm:
        return [f"column {name}: down to {low:.4g} Pa, below the atmosphere: is it absolute?"]
    return []


def _low_pressures(values: Mapping[str, np.ndarray], conditions: Conditions) -> list[str]:
    """Note on pressures that both stay far below the supply's."""
    supply = values.get("P_s", np.array([conditions.P_s])).mean()
    top = max(np.percentile(values[name], 99) for name in ("P_A", "P_B"))
    if top >= conditions.P_atm + LEAST_AT_WORK * (supply - conditions.P_atm):
        return []
    return [
        f"columns P_A and P_B: up to {top / 1e5:.3g} bar, but the supply has {supply / 1e5:.3g} bar (both"
        " absolute): is their unit right?"
    ]


def _check_supply(samples: Samples, P_s: float) -> str:
    """Note on a measured supply pressure; `InputError` if it is far from the configured one, Pa."""
    measured = samples.values["P_s"]
    low, high = float(measured.min()), float(measured.max())
    if not (SUPPLY[0] * P_s < low and high < SUPPLY[1] * P_s):
        raise InputError(
            f"{samples.path}: column P_s: {low:.4g} to {high:.4g} Pa: must lie between {SUPPLY[0]:g} and"
            f" {SUPPLY[1]:g} times the configured {P_s:.4g} Pa (P_s_Pa, absolute); is the unit right?"
        )
    return (
        f"column P_s: {low / 1e3:.4g} to {high / 1e3:.4g} kPa, in place of the configured {P_s / 1e3:.4g} kPa"
    )


def check_velocity(samples: Samples, period: float) -> list[str]:
    """Note on a measured velocity, if there is one; the fit uses the derivative of the position.

    `InputError` if the velocity is far from that derivative.
    """
    if "v" not in samples.values:
        return []
    v, x = samples.values["v"], samples.values["x"]
    width = max(1, round(AVERAGING / period))
    difference = (x[width:] - x[:-width]) / (width * period)
    smooth = np.convolve(v, np.ones(width) / width, mode="valid")[: len(difference)]
    slope = float(difference @ smooth / max(difference @ difference, 1e-30))
    if not 0.8 < slope < 1.25:
        raise InputError(
            f"{samples.path}: column v: {slope:.3g} times the derivative of x: must be 1;"
            " is the unit or sign of v right?"
        )
    return [f"column v: {slope:.3g} times the derivative of x; the fit takes that of the smoothed x"]
