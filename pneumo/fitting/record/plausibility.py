"""Checks of a measurement's columns: errors for what is impossible, notes for what is unlikely."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.errors import InputError
from pneumo.fitting.record.channel import Series, place
from pneumo.fitting.record.units import PRESSURES, gauge_zero
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
COMMON = ("kPa", "bar", "Pa", "MPa", "mbar", "hPa", "psi")  # units, tried in this order
LEAST_GAUGE = 0.2  # of the atmosphere, that a gauge pressure reaches if another unit is right
# Of the supply's gauge pressure, below which both chambers of a cylinder at work hardly stay: at rest behind
# a servo valve they have some 0.8. It finds a unit that is too small by more than 4.
LEAST_AT_WORK = 0.25
TOO_LARGE = 3.0  # pressure over what is possible at which another unit is likelier
LEAST_TRAVEL = 0.02  # of half the stroke, that a piston at work moves
JITTER, FLAT, MOST_EVENTS = 0.1, 5, 200  # of a period; samples of one value in a row; of a signal
AT_STOP = 0.02  # of half the stroke, from a stop
ABOVE, OFTEN = 1.02, 0.01  # pressure over the supply's that no sensor's error explains; of the time
AVERAGING = 0.02  # s, over which noise is small beside the motion of the piston


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
    t, begin = signal.t, float(signal.start)
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
    if signal.held and len(t) * 2 < len(signal.channel.values):
        return
    _refuse(
        path,
        at if np.ptp(signal.rows) + 1 == len(signal.rows) else signal,
        (np.isfinite(steps) & (steps > GAP * (1 + 1e-9) * usual))
        if sensor or not signal.held
        else np.zeros(0),
        lambda k, more: (
            f"a gap of {steps[k]:.4g} s after t = {begin + t[k - 1]:.6g} s, where samples are {usual:.4g} s"
            f" apart: cut the file there and fit one part{f'; {more} more gaps' if more else ''}"
        ),
    )


def events(signal: Series, plant: Plant) -> list[tuple[str, float, float]]:
    """Kind, begin and end, s, of parts in which a signal is doubtful."""
    found, t, values = list[tuple[str, float, float]](), signal.t, signal.values
    steps = np.diff(t)
    found += [("dropout", float(t[k]), float(t[k + 1])) for k in np.flatnonzero(steps > 1.5 * signal.period)]
    if signal.held:
        found = []
    uneven = np.abs(steps / signal.period - 1) if signal.period else steps * 0
    if np.mean((uneven > JITTER) & (uneven < 0.5)) > 0.01:
        found.append(("jitter", 0.0, float(t[-1])))
    changes = np.flatnonzero(np.diff(values))
    runs = np.diff(changes)
    if not signal.held and len(runs) > 20:
        usual = int(np.median(runs))
        if usual > 1 and np.mean(runs % usual == 0) > 0.8:
            found.append(("held", 0.0, float(t[-1])))
    edges = np.flatnonzero(np.diff([0, *_saturated(signal, plant), 0]))
    found += [
        ("saturated", float(t[a]), float(t[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True)
    ]
    return found[:MOST_EVENTS]


def _saturated(signal: Series, plant: Plant) -> np.ndarray:
    """Samples beyond the limiter, or of a sensor at its largest or smallest value several times in a row."""
    values = signal.values
    if signal.quantity == "u":
        return (np.abs(values) > plant.valve.u_max).astype(int)
    result = np.zeros(len(values), dtype=int)
    if signal.quantity not in ("P_A", "P_B", "P_s"):
        return result  # a piston rests at its stops
    for end in (values.min(), values.max()):
        flat = np.diff(np.concatenate([[0], values == end, [0]]).astype(int))
        for a, b in zip(np.flatnonzero(flat > 0), np.flatnonzero(flat < 0), strict=True):
            if b - a >= FLAT and b - a < len(values):
                result[a:b] = 1
    return result


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
    span = f"{shift - half:g} to {shift + half:g} m"
    hint = "" if from_end or x.min() < -0.1 * half else "; does it count from the end? --x-from end"
    hint = f"; is the unit right? it was read in {_unit(signals['x'])}" if np.ptp(x) > 2.2 * half else hint
    outside = f"m is outside the stroke, {span}{hint}"
    _refuse(path, signals["x"], np.abs(x) > 1.05 * half, lambda k, _: f"{x[k] + shift:.4g} {outside}")
    if not closed and 0 < np.ptp(x) < LEAST_TRAVEL * half:
        notes.append(
            f"column x: moves {np.ptp(x) * 1e3:.3g} mm of a stroke of {2e3 * half:.4g} mm: is its unit right?"
            f" it was read in {_unit(signals['x'])}"
        )
    beyond = float(np.mean(np.abs(values["u"]) > u_max)) if "u" in values else 0.0
    if beyond:
        notes.append(
            f"column u: beyond the limiter's {u_max:g} V in {100 * beyond:.2g} % of samples; limited"
        )
    for name in ("x", "P_A", "P_B", *(("m_A", "m_B") if "m_A" in values else ("u",))):
        if not closed and np.ptp(values[name]) == 0:
            raise InputError(f"{path}: column {name}: {values[name][0]:.4g} in every sample: nothing to fit")
    if not closed and "m_A" not in values and _one_sided(signals["u"], x, half):
        low, high = float(values["u"].min()), float(values["u"].max())
        middle = f"{(low + high) / 2:.2g}"
        raise InputError(
            f"{path}: column u: {low:.4g} to {high:.4g} V, of one sign, while the piston moves both ways:"
            " must be negative where chamber B is filled; if the valve is shut at, say,"
            f" {middle} V, write its unit with the ends of its range, as `V 0..10`, or give the column an"
            f" `offset: -{middle}` in the file of --columns"
        )
    if "T" in values:
        mean = f"column T: {np.mean(values['T']):.4g} K on average"
        if not 200 < np.mean(values["T"]) < 400:
            raise InputError(f"{path}: {mean}: must lie between 200 and 400 K; is it degC?")
        configured = f"T_amb {c.T_amb:.4g} K and T_in {c.T_in:.4g} K"
        notes.append(f"{mean}, of the surroundings, in place of the configured {configured}")
    if "P_s" in values:
        notes.append(_check_supply(path, values["P_s"], c.P_s))
    if not c.P_atm < c.P_s:
        raise InputError(f"P_s = {c.P_s:g} Pa: must exceed P_atm")
    return notes


def _unit(signal: Series) -> str:
    return signal.text.split(" ")[0]


def _one_sided(command: Series, x: np.ndarray, half: float) -> bool:
    """Whether a command never changes sign although the piston goes far to and fro."""
    u = command.values
    forth, back = (x - np.minimum.accumulate(x)).max(), (np.maximum.accumulate(x) - x).max()
    return bool((u.min() >= 0 or u.max() <= 0) and min(forth, back) > TO_AND_FRO * half)


def _check_pressure(path: Path, signal: Series, plant: Plant, closed: bool) -> list[str]:
    """Notes on a pressure; `InputError` if supply and atmosphere do not allow it."""
    P, c, name = signal.values, plant.conditions, signal.quantity
    top, low = float(np.percentile(P, 99)), float(np.percentile(P, 1))
    unit, gauge = _unit(signal), signal.text.endswith("gauge")
    zero = gauge_zero(c.P_atm) if gauge else 0.0
    if top > TOO_LARGE * c.P_s or top < c.P_atm / TOO_LARGE:
        for other in COMMON:
            factor = PRESSURES[other] / PRESSURES[unit]
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
    _refuse(path, signal, 0.5 * c.P_atm >= P, lambda k, _: f"{P[k]:.4g} {below}")
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


def _check_supply(path: Path, measured: np.ndarray, P_s: float) -> str:
    """Note on a measured supply pressure; `InputError` if it is far from the configured one, Pa."""
    low, high = float(measured.min()), float(measured.max())
    if not (SUPPLY[0] * P_s < low and high < SUPPLY[1] * P_s):
        raise InputError(
            f"{path}: column P_s: {low:.4g} to {high:.4g} Pa: must lie between {SUPPLY[0]:g} and"
            f" {SUPPLY[1]:g} times the configured {P_s:.4g} Pa (P_s_Pa, absolute); is the unit right?"
        )
    return (
        f"column P_s: {low / 1e3:.4g} to {high / 1e3:.4g} kPa, in place of the configured {P_s / 1e3:.4g} kPa"
    )


def check_velocity(path: Path, values: Mapping[str, np.ndarray], period: float) -> list[str]:
    """Note on a measured velocity, if there is one; the fit uses the derivative of the position.

    `InputError` if the velocity is far from that derivative.
    """
    if "v" not in values:
        return []
    v, x = values["v"], values["x"]
    width = max(1, round(AVERAGING / period))
    difference = (x[width:] - x[:-width]) / (width * period)
    smooth = np.convolve(v, np.ones(width) / width, mode="valid")[: len(difference)]
    slope = float(difference @ smooth / max(difference @ difference, 1e-30))
    if not 0.8 < slope < 1.25:
        raise InputError(
            f"{path}: column v: {slope:.3g} times the derivative of x: must be 1;"
            " is the unit or sign of v right?"
        )
    return [f"column v: {slope:.3g} times the derivative of x; the fit takes that of the smoothed x"]


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
