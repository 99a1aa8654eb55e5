"""What values of quantities make of a plant: a function of the plant and of the values."""

from collections.abc import Mapping
from operator import attrgetter
from typing import Any, TypeVar

from pneumo.quantities.table import QUANTITIES

P = TypeVar("P")  # a plant, which has a valve, gas, cylinder and conditions
LEAST_B, MOST_B = 0.02, 0.95  # of any path of a valve


def value_in(plant: Any, name: str) -> float:
    """Value of a quantity in a plant, SI units."""
    return attrgetter(QUANTITIES[name].field)(plant)


def with_values(plant: P, values: Mapping[str, float]) -> P:
    """Plant with the values, SI units, of those quantities that are a field of it.

    All paths of the valve to the atmosphere change with `exhaust`, their critical ratios with `b`, and the
    areas of the piston with `bore`.
    """
    changed: Any = plant
    for name, value in values.items():
        part, _, field = QUANTITIES[name].field.rpartition(".")
        if not field:
            continue
        holder = getattr(changed, part) if part else changed
        if name == "b" and (paths := changed.valve.paths).b:
            off = value - holder.critical_ratio
            b = tuple(tuple(min(max(one + off, LEAST_B), MOST_B) for one in side) for side in paths.b)
            changed = changed._replace(valve=changed.valve._replace(paths=paths._replace(b=b)))
        change = {"exhaust": "with_exhaust", "bore": "with_bore"}.get(name)
        holder = getattr(holder, change)(value) if change else holder._replace(**{field: value})
        changed = changed._replace(**{part: holder}) if part else holder
    return changed
