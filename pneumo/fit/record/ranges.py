"""Ranges of a record's signals as they were read, and what is odd in them, for `pneumo show`."""

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.fit.record.columns import GAUGE
from pneumo.fit.record.measurement import Measurement

MM, BAR = 1e-3, 1e5  # m, Pa
AT_STOP = 0.02  # of half the stroke, from a stop
ABOVE = 1.02  # pressure over the supply's that no sensor's error explains
OFTEN = 0.01  # of the time


def at_stop(record: Measurement, plant: Plant) -> np.ndarray:
    """Whether the piston is at a configured stop, by sample."""
    c = plant.cylinder
    near = AT_STOP * c.stroke / 2
    return (record.x < c.x_min + near) | (record.x > c.x_max - near)


def ranges_text(record: Measurement, plant: Plant) -> str:
    """Ranges of command or flows, position and pressures, and the units that they were read in."""
    at = 100 * np.mean(at_stop(record, plant))
    parts = [f"x{_read_as(record, 'x')} {_range(record.x / MM)} mm, at a stop {at:.0f} % of the time"]
    if record.m is None:
        parts.insert(0, f"u{_read_as(record, 'u')} {_range(record.u)} V")
    parts += [
        f"P_{side}{_read_as(record, f'P_{side}')} {_range(P / BAR)} bar"
        for side, P in zip("AB", record.P, strict=True)
    ]
    supply = plant.conditions.P_s if record.P_s is None else float(np.mean(record.P_s))
    return f"{'; '.join(parts)} (supply {supply / BAR:.3g} bar absolute)"


def above_supply(record: Measurement, plant: Plant) -> list[str]:
    """Notes on pressures above the supply's, of a record whose chambers are not closed."""
    if record.closed:
        return []
    supply = plant.conditions.P_s if record.P_s is None else record.P_s
    named = "the configured supply" if record.P_s is None else "the measured supply"
    rests, notes = at_stop(record, plant), list[str]()
    for side, P in zip("AB", record.P, strict=True):
        above = ABOVE * supply < P
        if np.mean(above) < OFTEN:
            continue
        still = 100 * np.mean(above & rests) / np.mean(above)
        notes.append(
            f"P_{side} is above {named} {100 * np.mean(above):.0f} % of the time, up to"
            f" {P.max() / BAR:.3g} bar, {still:.0f} % of that at a stop, where no motion compresses the air:"
            " is P_s_Pa right (absolute), and the unit of the pressures?"
        )
    return notes


def _read_as(record: Measurement, quantity: str) -> str:
    """Unit that a column was read in, in brackets; nothing where it is not known."""
    unit = record.units.get(quantity, "")
    if quantity.startswith("P_") and unit:
        gauge = unit.endswith(GAUGE) or unit.endswith("g")
        unit = f"{unit.removesuffix(GAUGE).removesuffix('g')} {'gauge' if gauge else 'absolute'}"
    return f" (read as {unit})" if unit else ""


def _range(values: np.ndarray) -> str:
    return f"{values.min():.3g} to {values.max():.3g}"
