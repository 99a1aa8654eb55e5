"""Arguments of Python callers, checked: numbers, lists and paths, or one line that names the argument."""

from collections.abc import Iterable
from math import inf, isfinite
from operator import index
from os import PathLike
from pathlib import Path
from typing import Any

from pneumo.errors import InputError, shown


def number(name: str, value: Any, low: float = -inf, high: float = inf, *, above: bool = False) -> float:
    """A finite number from `low`, or `above` it, to `high`; else `InputError`."""
    try:
        result = float(value) if not isinstance(value, str | bytes) else inf
    except (TypeError, ValueError, OverflowError):
        result = inf
    if not (isfinite(result) and (result > low if above else result >= low) and result <= high):
        limits = f", {'greater than' if above else 'at least'} {low:g}" if low > -inf else ""
        limits += f", at most {high:g}" if high < inf else ""
        given = f"{value:g}" if isinstance(value, float) else shown(value)
        raise InputError(f"{name} = {given}: must be a finite number{limits}")
    return result


def check_positive(**values: Any) -> None:
    """Raise `InputError` with the name of the first number that is not positive and finite."""
    for name, value in values.items():
        number(name, value, 0.0, above=True)


def whole_number(name: str, value: Any, low: int, high: int) -> int:
    """A whole number within limits; else `InputError`."""
    try:
        result = index(value)
    except TypeError:
        result = low - 1
    if not low <= result <= high:
        raise InputError(f"{name} = {shown(value)}: must be a whole number, {low} to {high}")
    return result


def listed(name: str, values: Any) -> list[Any]:
    """Values of a list; `InputError` for a text, whose letters would be its values, and for no list."""
    if isinstance(values, str):
        raise InputError(f"{name} = {shown(values)}: must be a list, [{shown(values)}]")
    if not isinstance(values, Iterable):
        raise InputError(f"{name} = {shown(values)}: must be a list")
    return [*values]


def path(name: str, value: Any) -> Path:
    """A path; else `InputError`."""
    if not isinstance(value, str | PathLike):
        raise InputError(f"{name} = {shown(value)}: must be a plant, or the path of a configuration")
    return Path(value)
