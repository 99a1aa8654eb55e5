"""Checks of a measurement's columns: errors for what is impossible, notes for what is unlikely."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.errors import InputError
from pneumo.fitting.record.channel import refuse
from pneumo.fitting.record.sensor_faults import at_end_of_range, stopped
from pneumo.fitting.record.series import Series
from pneumo.fitting.record.units import LENGTHS, PRESSURES

SHORTEST = 1e-5  # s, between samples
LONGEST, LONGEST_CLOSED = 0.1, 10.0  # chambers fill within a second; closed ones settle within minutes
GAP = 3.0 + 1e-8  # periods between samples that are a gap
TO_AND_FRO = 0.2  # of half the stroke, that a piston moves both ways
UNEVEN = 1e-3  # deviation from a uniform grid, in periods, that is negligible
SUPPLY = (0.4, 1.6)  # of the configured supply pressure, between which a measured one is possible
OF_SUPPLY = 1.3  # measured pressure over the supply's that is possible
LEAST_GAUGE = 0.2  # of the atmosphere, that a gauge pressure reaches if another unit is right
# Of the supply's gauge pressure, below which both chambers of a cylinder at work hardly stay: at rest behind
# a servo valve they have some 0.8. It finds a unit that is too small by more than 4.
LEAST_AT_WORK = 0.25
TOO_LARGE = 3.0  # pressure over what is possible at which another unit is likelier
MOST_DROP_OUTS = 0.01  # fraction of samples, as many as may be missing
LEAST_TRAVEL = 0.02  # of half the stroke, that a piston at work moves
AT_STOP = 0.02  # of half the stroke, from a stop
ABOVE, OFTEN = 1.02, 0.01  # pressure over the supply's that no sensor's error explains; of the time
OF_LOOP = 1.04  # of u_max, that the ends of a current loop reach at most


def check_clock(path: Path, signal: Series, closed: bool, *, sensor: bool) -> None:
    """Check the times of a signal.

    `InputError` if a sensor's have gaps or a period too short or too long to show a cylinder at work, or
    `closed` chambers, which change more slowly. A command that was logged on changes, or more slowly than
    sensors, may have any.
    """
    name, usual = signal.quantity, signal.period
    longest = LONGEST_CLOSED if closed else LONGEST
    steps, later = np.diff(signal.t), signal.rows[1:]
    if sensor and not SHORTEST <= usual <= longest:
        other = {"ms": 1e-3 * usual, "s": 1e3 * usual}
        hint = "".join(f"; is t in {unit}?" for unit, s in other.items() if SHORTEST <= s <= longest)
        allowed = f"must be {SHORTEST:g} to {longest:g} s{hint}"
        raise InputError(f"{path}: column t: samples of {name} are {usual:.3g} s apart: {allowed}")
    if not signal.held:
        allowed = f"must be at most {GAP:.0f} times the usual {usual:.4g} s: cut the file there, fit one part"
        gap = f"{name} has a gap, of up to {steps.max():.4g} s: {allowed}"
        refuse(path, signal.clock, "t", later[steps > GAP * usual], gap)


def saturated(signal: Series, plant: Plant) -> np.ndarray:
    """Whether a sample is at an end of its sensor's range: the signal shows it, by repeated extremes."""
    values, c = signal.values, plant.conditions
    if signal.quantity == "x":  # a piston rests at its stops
        return at_end_of_range(values, (values.min(), values.max()))
    rests = (c.P_s, c.P_atm)
    return at_end_of_range(values, rests if signal.quantity in ("P_A", "P_B") else ())


def until_it_stops(signal: Series) -> tuple[Series, list[str]]:
    """A sensor's signal without samples at its end that no longer change, and a note on such samples."""
    run = stopped(signal.values)
    if run is None:
        return signal, []
    first, last = run
    name, value = f"column {signal.quantity}", str(signal.channel.values[signal.rows[first]]).strip()
    seconds = f"{signal.t[first]:.4g} to {signal.t[last]:.4g} s"
    stays = f"{name}: stays at exactly {value} from {seconds}, without noise: its sensor had stopped"
    if last < len(signal.values) - 1:
        return signal, [f"{stays}; fit the parts before and after it"]
    kept = {field: getattr(signal, field)[: first + 1] for field in ("t", "values", "rows")}
    return signal._replace(**kept), [f"{stays}; the rest of the record is not used"]


def range_note(signal: Series, at_end: np.ndarray, remedy: str) -> list[str]:
    """Note on samples of a sensor that are at an end of its range."""
    if not at_end.any():
        return []
    raw = signal.channel.values[signal.rows[at_end]]
    ends = " and ".join(dict.fromkeys(str(value).strip() for value in raw))
    count = f"{len(raw)} of {len(at_end)} samples are exactly {ends} ({signal.text})"
    return [f"column {signal.quantity}: {count}: the sensor's range ends there; {remedy}"]


def check_signals(
    path: Path, signals: Mapping[str, Series], plant: Plant, from_end: bool, closed: bool = False
) -> list[str]:
    """Notes on pressures, position and command.

    `InputError` if a pressure, position or temperature is impossible, or a signal is constant. In `closed`
    chambers pressures may exceed the supply's, and signals may be constant: the fit itself checks them.
    """
    c = plant.conditions
    notes = [note for name in ("P_A", "P_B") for note in _check_pressure(path, signals[name], plant, closed)]
    notes += _check_position(path, signals["x"], plant, from_end, closed)
    for name, signal in signals.items() if not closed else ():
        if name not in ("P_s", "T") and np.ptp(signal.values) == 0:
            raise InputError(f"{path}: column {name}: {signal.values[0]:.4g} in every sample: nothing to fit")
    if "u" in signals:
        notes += _check_command(path, signals["u"], signals["x"].values, plant, closed)
    supply = c.P_s
    if "P_s" in signals:
        low, high, supply = (f(signals["P_s"].values) for f in (np.min, np.max, np.mean))
        found = f"column P_s: {low / 1e3:.4g} to {high / 1e3:.4g} kPa"
        if not (SUPPLY[0] * c.P_s < low and high < SUPPLY[1] * c.P_s):
            allowed = f"{SUPPLY[0]:g} to {SUPPLY[1]:g} times P_s_Pa = {c.P_s:.4g} (absolute)"
            raise InputError(f"{path}: {found}: must be {allowed}; is the unit right?")
        notes.append(f"{found}, in place of the configured {c.P_s / 1e3:.4g} kPa")
    top = max(np.percentile(signals[name].values, 99) for name in ("P_A", "P_B"))
    if not closed and top < c.P_atm + LEAST_AT_WORK * (supply - c.P_atm):
        of_supply = f"the supply has {supply / 1e5:.3g} bar (both absolute): is their unit right?"
        notes.append(f"columns P_A and P_B: up to {top / 1e5:.3g} bar, but {of_supply}")
    if "T" in signals:
        T = float(np.mean(signals["T"].values))
        found = f"column T: {T:.4g} K on average"
        if not 200 < T < 400:
            raise InputError(f"{path}: {found}: must be 200 to 400 K; is it degC?")
        configured = f"T_amb {c.T_amb:.4g} K and T_in {c.T_in:.4g} K"
        notes.append(f"{found}, of the surroundings, in place of the configured {configured}")
    return notes


def _refuse_drop_outs(path: Path, signal: Series, impossible: np.ndarray) -> None:
    """Raise `InputError` for samples that nothing but a drop-out gives, if they are few."""
    count, samples = int(impossible.sum()), len(impossible)
    if count <= MOST_DROP_OUTS * samples:
        what, cells = ("is", "this cell") if count == 1 else ("are", "such cells")
        problem = f"{count} of {samples} samples {what} not plausible: a drop-out? leave {cells} empty"
        refuse(path, signal.channel, signal.quantity, signal.rows[impossible], problem)


def _check_position(path: Path, signal: Series, plant: Plant, from_end: bool, closed: bool) -> list[str]:
    """Notes on a position; `InputError` if it is outside the stroke."""
    x, half = signal.values, plant.cylinder.stroke / 2
    shift = half if from_end else 0.0
    hint = _other_unit(
        signal, LENGTHS, -shift, lambda a, b: max(-a, b) < 1.05 * half and b - a > TO_AND_FRO * half
    )
    if 0 < np.ptp(x) < LEAST_TRAVEL * half and not closed:
        return [f"column x: moves {np.ptp(x) * 1e3:.3g} mm of a stroke of {2e3 * half:.4g} mm{hint}"]
    if np.ptp(x) <= 2.2 * half:
        hint = "" if from_end or x.min() < -0.1 * half else "; does it count from the end? --x-from end"
    _refuse_drop_outs(path, signal, np.abs(x) > 2 * half)
    outside = f"outside the stroke, {shift - half:g} to {shift + half:g} m{hint}"
    refuse(path, signal.channel, "x", signal.rows[np.abs(x) > 1.05 * half], outside)
    return []


def _check_command(path: Path, signal: Series, x: np.ndarray, plant: Plant, closed: bool) -> list[str]:
    """Note on a command beyond the limiter; `InputError` if it cannot be one of both directions."""
    u, u_max = signal.values, plant.valve.u_max
    found = f"{path}: column u: {u.min():.4g} to {u.max():.4g} V"
    if ".." in signal.text and np.abs(u).max() > OF_LOOP * u_max:
        ranges = "write mA 0..20, mA -20..20 or V 0..10; mA alone is 4..20"
        raise InputError(f"{found}, read in {signal.text}: which range has it? {ranges}")
    forth, back = (x - np.minimum.accumulate(x)).max(), (np.maximum.accumulate(x) - x).max()
    if not closed and u.min() * u.max() >= 0 and min(forth, back) > TO_AND_FRO * plant.cylinder.stroke / 2:
        middle = f"`offset: {-(u.min() + u.max()) / 2:.2g}` in --columns, if the valve is shut there"
        unit = "V 0..10"
        if signal.text.startswith("%"):
            unit, middle = "% 0..100", "an `offset` in --columns, if the valve is shut there"
        both = "but the piston moves both ways: must be negative where chamber B is filled"
        raise InputError(f"{found}, of one sign, {both}; write a unit such as `{unit}`, or {middle}")
    beyond = 100 * float(np.mean(np.abs(u) > u_max))
    limited = f"column u: beyond the limiter's {u_max:g} V in {beyond:.2g} % of samples; limited"
    return [limited] if beyond else []


def _other_unit(
    signal: Series, units: Mapping[str, float], zero: float, possible: Callable[[float, float], bool]
) -> str:
    """Question for another unit in which a signal, zero at `zero`, has possible values."""
    unit = signal.text.split(" ")[0]
    ends = np.percentile(signal.values, (1, 99))
    for other, factor in units.items():
        ratio = factor / units[unit]
        if ratio != 1 and possible(*(zero + ratio * (ends - zero))):
            return f": it was read in {unit}; is it in {other} (a factor of {max(ratio, 1 / ratio):.6g})?"
    return f": it was read in {unit}; is that right?"


def _check_pressure(path: Path, signal: Series, plant: Plant, closed: bool) -> list[str]:
    """Notes on a pressure; `InputError` if supply and atmosphere do not allow it."""
    P = signal.values
    c = plant.conditions
    name = signal.quantity
    low, top = np.percentile(P, (1, 99))
    gauge = signal.text.endswith("gauge")
    zero, least = (c.P_atm, (1 + LEAST_GAUGE) * c.P_atm) if gauge else (0.0, 0.0)
    hint = _other_unit(
        signal, PRESSURES, zero, lambda a, b: 0.5 * c.P_atm < a and least <= b < OF_SUPPLY * c.P_s
    )
    ends = f"{c.P_atm:.4g} (atmosphere) to {c.P_s:.4g} Pa (supply), absolute"
    allowed = f"must be about {ends}; a gauge's unit is written bar(g){hint}"
    _refuse_drop_outs(path, signal, (0.5 * c.P_atm >= P) | ((TOO_LARGE * c.P_s < P) & (not closed)))
    refuse(path, signal.channel, name, signal.rows[0.5 * c.P_atm >= P], allowed)
    if top > (TOO_LARGE if closed else OF_SUPPLY) * c.P_s and not (closed and "factor" not in hint):
        raise InputError(f"{path}: column {name}: up to {top:.4g} Pa: {allowed}")
    if low < 0.9 * c.P_atm:
        return [f"column {name}: down to {low:.4g} Pa, below the atmosphere: is it absolute?"]
    return []


def above_supply(x: np.ndarray, P: np.ndarray, P_s: np.ndarray | float, plant: Plant) -> list[str]:
    """Notes on pressures above the supply's while the piston rests at a stop, compressing no air."""
    c = plant.cylinder
    near = AT_STOP * c.stroke / 2
    rests = (x < c.x_min + near) | (x > c.x_max - near)
    return [
        f"P_{side} at a stop is above the supply's, by up to {np.max((of_side - P_s)[rests]) / 1e5:.3g} bar:"
        " is P_s_Pa right (absolute), and the unit of the pressures?"
        for side, of_side in zip("AB", P, strict=True)
        if np.mean(rests & (of_side > ABOVE * P_s)) > OFTEN
    ]
