"""Checks of a measurement's columns: errors for what is impossible, notes for what is unlikely."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.errors import InputError
from pneumo.fitting.record.channel import Series, place
from pneumo.fitting.record.units import LENGTHS, PRESSURES, gauge_zero
from pneumo.physics.valve import Conditions

if TYPE_CHECKING:
    from pneumo.fitting.record.measurement import Measurement

PERIODS = (1e-5, 0.1)  # s, between samples of a cylinder at work: its chambers fill within a second
PERIODS_CLOSED = (1e-5, 10.0)  # of closed chambers, which settle within minutes
GAP = 3.0  # periods between samples that are a gap
TO_AND_FRO = 0.2  # of half the stroke, that a piston moves both ways
UNEVEN = 1e-3  # deviation from a uniform grid, in periods, that is negligible
SUPPLY = (0.4, 1.6)  # of the configured supply pressure, between which a measured one is possible
OF_SUPPLY = 1.3  # measured pressure over the supply's that is possible
LEAST_GAUGE = 0.2  # of the atmosphere, that a gauge pressure reaches if another unit is right
# Of the supply's gauge pressure, below which both chambers of a cylinder at work hardly stay: at rest behind
# a servo valve they have some 0.8. It finds a unit that is too small by more than 4.
LEAST_AT_WORK = 0.25
TOO_LARGE = 3.0  # pressure over what is possible at which another unit is likelier
LEAST_TRAVEL = 0.02  # of half the stroke, that a piston at work moves
JITTER, FLAT, MOST_EVENTS = 0.1, 5, 200  # of a period; samples of one value in a row; of a signal
AT_STOP = 0.02  # of half the stroke, from a stop
ABOVE, OFTEN = 1.02, 0.01  # pressure over the supply's that no sensor's error explains; of the time


def _refuse(path: Path, signal: Series, bad: np.ndarray, problem: Callable[[int, int], str]) -> None:
    """Raise an `InputError` that names the first bad sample; `problem(first, more)` gives the reason."""
    indices = np.flatnonzero(bad)
    if len(indices):
        first = int(indices[0])
        clock = signal.channel if signal.channel.clock is None else signal.channel.clock
        where = place(path, clock, int(signal.rows[first]), signal.quantity)
        raise InputError(f"{where}: {problem(first, len(indices) - 1)}")


def check_clock(path: Path, signal: Series, closed: bool, *, sensor: bool) -> None:
    """Check the times of a signal.

    `InputError` if time goes back, or a sensor's has gaps or a period too short or too long to show a
    cylinder at work, or `closed` chambers, which change more slowly. A command that was logged on changes, or
    more slowly than sensors, may have any.
    """
    t, begin = signal.t, 1e-9 * signal.start
    name = "t" if signal.channel.clock is None else f"t of {signal.quantity}"
    steps = np.diff(t, prepend=-np.inf)  # each sample's from the one before
    at = signal._replace(quantity=name)
    _refuse(
        path,
        at,
        steps <= 0,
        lambda k, _: f"{begin + t[k]:.9g} s follows {begin + t[k - 1]:.9g} s: time must increase",
    )
    usual = signal.period
    shortest, longest = PERIODS_CLOSED if closed or not sensor else PERIODS
    if sensor and not shortest <= usual <= longest:
        factor, unit = (1e3, "ms") if usual > longest else (1e-3, "s")
        raise InputError(
            f"{path}: column {name}: samples are {usual:.3g} s apart: must be {shortest:g} to {longest:g}"
            " s" + (f"; is t in {unit}?" if shortest <= usual / factor <= longest else "")
        )
    if signal.held:
        return
    _refuse(
        path,
        at if np.ptp(signal.rows) + 1 == len(signal.rows) else signal,
        np.isfinite(steps) & (steps > GAP * (1 + 1e-9) * usual),
        lambda k, more: (
            f"a gap of {steps[k]:.4g} s after t = {begin + t[k - 1]:.6g} s, where samples are {usual:.4g} s"
            f" apart: cut the file there and fit one part{f'; {more} more gaps' if more else ''}"
        ),
    )


def events(signal: Series, plant: Plant) -> list[tuple[str, float, float]]:
    """Kind, begin and end, s, of parts in which a signal is doubtful."""
    found, t = list[tuple[str, float, float]](), signal.t
    if not signal.held:
        steps = np.diff(t) / signal.period
        found += [("dropout", float(t[k]), float(t[k + 1])) for k in np.flatnonzero(steps > 1.5)]
        uneven = np.abs(steps - 1)
        if np.mean((uneven > JITTER) & (uneven < 0.5)) > OFTEN:
            found.append(("jitter", float(t[0]), float(t[-1])))
        unchanged = np.diff(np.flatnonzero(np.diff(signal.values)))
        usual = int(np.median(unchanged)) if len(unchanged) > 20 else 1
        if usual > 1 and np.mean(unchanged % usual == 0) > 0.8:
            found.append(("held", float(t[0]), float(t[-1])))
    edges = np.flatnonzero(np.diff(_saturated(signal, plant), prepend=False, append=False))
    found += [
        ("saturated", float(t[a]), float(t[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True)
    ]
    return found[:MOST_EVENTS]


def _saturated(signal: Series, plant: Plant) -> np.ndarray:
    """Whether a sample is beyond the limiter, or of a pressure at its largest or smallest for a while."""
    from scipy.ndimage import binary_opening

    values = signal.values
    if signal.quantity == "u":
        return np.abs(values) > plant.valve.u_max
    at_end = (values == values.min()) | (values == values.max())
    if signal.quantity not in ("P_A", "P_B", "P_s") or at_end.all():
        return np.zeros(len(values), dtype=bool)  # a piston rests at its stops
    return binary_opening(at_end, np.ones(FLAT))


def check_signals(
    path: Path, signals: Mapping[str, Series], plant: Plant, from_end: bool, closed: bool = False
) -> list[str]:
    """Notes on pressures, position and command.

    `InputError` if a pressure, position or temperature is impossible, or a signal is constant. In `closed`
    chambers pressures may exceed the supply's, and signals may be constant: the fit itself checks them.
    """
    values = {name: signal.values for name, signal in signals.items()}
    c, half, u_max = plant.conditions, plant.cylinder.stroke / 2, plant.valve.u_max
    notes = [note for name in ("P_A", "P_B") for note in _check_pressure(path, signals[name], plant, closed)]
    notes += [] if closed else _low_pressures(values, c)
    x, shift = values["x"], half if from_end else 0.0
    unit = _other_unit(
        signals["x"], LENGTHS, -shift, lambda a, b: max(-a, b) < 1.05 * half and b - a > TO_AND_FRO * half
    )
    hint = "" if from_end or x.min() < -0.1 * half else "; does it count from the end? --x-from end"
    hint = unit if np.ptp(x) > 2.2 * half else hint
    outside = f"m is outside the stroke, {shift - half:g} to {shift + half:g} m{hint}"
    _refuse(path, signals["x"], np.abs(x) > 1.05 * half, lambda k, _: f"{x[k] + shift:.4g} {outside}")
    if not closed and 0 < np.ptp(x) < LEAST_TRAVEL * half:
        notes.append(f"column x: moves {np.ptp(x) * 1e3:.3g} mm of a stroke of {2e3 * half:.4g} mm{unit}")
    beyond = float(np.mean(np.abs(values["u"]) > u_max)) if "u" in values else 0.0
    if beyond:
        notes.append(
            f"column u: beyond the limiter's {u_max:g} V in {100 * beyond:.2g} % of samples; limited"
        )
    for name in ("x", "P_A", "P_B", *(("m_A", "m_B") if "m_A" in values else ("u",))):
        if not closed and np.ptp(values[name]) == 0:
            raise InputError(f"{path}: column {name}: {values[name][0]:.4g} in every sample: nothing to fit")
    u = values.get("u", np.zeros(0))
    forth, back = (x - np.minimum.accumulate(x)).max(), (np.maximum.accumulate(x) - x).max()
    one_sided = len(u) and (u.min() >= 0 or u.max() <= 0)
    if not closed and one_sided and min(forth, back) > TO_AND_FRO * half:
        low, high = u.min(), u.max()
        middle = f"{(low + high) / 2:.2g}"
        raise InputError(
            f"{path}: column u: {low:.4g} to {high:.4g} V, of one sign, while the piston moves both ways:"
            " must be negative where chamber B is filled; if the valve is shut at, say,"
            f" {middle} V, write its unit with the ends of its range, as `V 0..10`, or give the column an"
            f" `offset: -{middle}` in --columns"
        )
    if "T" in values:
        mean = f"column T: {np.mean(values['T']):.4g} K on average"
        if not 200 < np.mean(values["T"]) < 400:
            raise InputError(f"{path}: {mean}: must lie between 200 and 400 K; is it degC?")
        configured = f"T_amb {c.T_amb:.4g} K and T_in {c.T_in:.4g} K"
        notes.append(f"{mean}, of the surroundings, in place of the configured {configured}")
    if "P_s" in values:
        low, high = values["P_s"].min(), values["P_s"].max()
        if not (SUPPLY[0] * c.P_s < low and high < SUPPLY[1] * c.P_s):
            raise InputError(
                f"{path}: column P_s: {low:.4g} to {high:.4g} Pa: must lie between {SUPPLY[0]:g} and"
                f" {SUPPLY[1]:g} times the configured {c.P_s:.4g} Pa (P_s_Pa, absolute); is the unit right?"
            )
        configured = f"in place of the configured {c.P_s / 1e3:.4g} kPa"
        notes.append(f"column P_s: {low / 1e3:.4g} to {high / 1e3:.4g} kPa, {configured}")
    if not c.P_atm < c.P_s:
        raise InputError(f"P_s = {c.P_s:g} Pa: must exceed P_atm")
    return notes


def _other_unit(
    signal: Series, units: Mapping[str, float], zero: float, possible: Callable[[float, float], bool]
) -> str:
    """Question for another unit in which a signal, zero at `zero`, has possible values."""
    unit = signal.text.split(" ")[0]
    ends = np.percentile(signal.values, (1, 99))
    for other, factor in units.items():
        ratio = factor / units[unit]
        if possible(*(zero + ratio * (ends - zero))):
            return f": it was read in {unit}; is it in {other} (a factor of {max(ratio, 1 / ratio):.6g})?"
    return f": it was read in {unit}; is that right?"


def _check_pressure(path: Path, signal: Series, plant: Plant, closed: bool) -> list[str]:
    """Notes on a pressure; `InputError` if supply and atmosphere do not allow it."""
    P, c, name = signal.values, plant.conditions, signal.quantity
    low, top = np.percentile(P, (1, 99))
    gauge = signal.text.endswith("gauge")
    least = (1 + LEAST_GAUGE) * c.P_atm if gauge else 0.0  # at the highest pressure
    unit = _other_unit(
        signal,
        PRESSURES,
        gauge_zero(c.P_atm) if gauge else 0.0,
        lambda a, b: 0.5 * c.P_atm < a and least <= b < OF_SUPPLY * c.P_s,
    )
    if (top > TOO_LARGE * c.P_s or top < c.P_atm / TOO_LARGE) and "factor" in unit:
        raise InputError(
            f"{path}: column {name}: {low:.4g} to {top:.4g} Pa, but only {c.P_atm:.4g} (atmosphere) to"
            f" {c.P_s:.4g} (supply) is possible{unit}"
        )
    rest = "must be absolute; a gauge's unit is written bar(g)"
    below = f"Pa is far below the atmosphere's {c.P_atm:.4g} Pa: {rest}"
    _refuse(path, signal, 0.5 * c.P_atm >= P, lambda k, _: f"{P[k]:.4g} {below}")
    if top > OF_SUPPLY * c.P_s and not closed:
        raise InputError(
            f"{path}: column {name}: up to {top:.4g} Pa, far above the supply's {c.P_s:.4g} Pa"
            f" (P_s_Pa, absolute){unit}"
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


def above_supply(record: "Measurement", plant: Plant) -> list[str]:
    """Notes on pressures above the supply's, of a record whose chambers are not closed."""
    if record.closed:
        return []
    supply = plant.conditions.P_s if record.P_s is None else record.P_s
    named = "the configured supply" if record.P_s is None else "the measured supply"
    c, notes = plant.cylinder, list[str]()
    near = AT_STOP * c.stroke / 2
    rests = (record.x < c.x_min + near) | (record.x > c.x_max - near)
    for side, P in zip("AB", record.P, strict=True):
        above = ABOVE * supply < P
        if np.mean(above) < OFTEN:
            continue
        still = 100 * np.mean(above & rests) / np.mean(above)
        notes.append(
            f"P_{side} is above {named} {100 * np.mean(above):.0f} % of the time, up to"
            f" {P.max() / 1e5:.3g} bar, {still:.0f} % of that at a stop, where no motion compresses the air:"
            " is P_s_Pa right (absolute), and the unit of the pressures?"
        )
    return notes
