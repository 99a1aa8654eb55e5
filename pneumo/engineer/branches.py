"""Evaluation of functions written with ``if`` for floats on symbols, arrays and complex numbers.

The physics decides with ``if`` (sonic or not, filling or emptying); a symbol cannot answer. So the function
is run once for every combination of answers, and the results are put together as a tree of choices.
"""

import operator
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NamedTuple


class Traced:
    """A value in place of a float. `decide` answers its comparisons; `magnitude` is its absolute value."""

    __array_ufunc__ = None  # a NumPy array beside it leaves the operation to it

    def __init__(
        self, value: Any, decide: Callable[..., bool], magnitude: Callable[[Any], Any] = abs
    ) -> None:
        self.value, self.decide, self.magnitude = value, decide, magnitude

    def with_value(self, value: Any) -> "Traced":
        """Return another value with the same rules."""
        return Traced(value, self.decide, self.magnitude)

    def __neg__(self) -> "Traced":
        return self.with_value(-self.value)

    def __abs__(self) -> "Traced":
        return self.with_value(self.magnitude(self.value))


def untraced(value: Any) -> Any:
    """Value inside a `Traced`, or values inside a tuple of them."""
    if type(value) is tuple:
        return tuple(untraced(inner) for inner in value)
    return value.value if isinstance(value, Traced) else value


def _arithmetic(function: Callable[..., Any], mirrored: bool = False) -> Callable[..., Traced]:
    def method(self: Traced, other: Any) -> Traced:
        pair = (untraced(other), self.value) if mirrored else (self.value, untraced(other))
        if function is operator.truediv and isinstance(pair[1], int | float) and pair[1] == 0:
            raise ZeroDivisionError  # as floats do; symbols and arrays would go on with infinity
        return self.with_value(function(*pair))

    return method


def _comparison(function: Callable[..., Any]) -> Callable[..., bool]:
    return lambda self, other: self.decide(function, self.value, untraced(other))


for _name in ("add", "sub", "mul", "truediv", "pow"):
    setattr(Traced, f"__{_name}__", _arithmetic(getattr(operator, _name)))
    setattr(Traced, f"__r{_name}__", _arithmetic(getattr(operator, _name), mirrored=True))
for _name in ("lt", "le", "gt", "ge"):
    setattr(Traced, f"__{_name}__", _comparison(getattr(operator, _name)))


class Choice(NamedTuple):
    """A condition (symbol or array of bool) and the result for either answer: a value or a further choice."""

    condition: Any
    yes: Any
    no: Any


def choices(function: Callable[..., Any], *arguments: Any, answers: tuple[bool, ...] = ()) -> Any:
    """Tree of a function's results on symbols or arrays, over all its branches.

    Named tuples and numbers are passed to the function as they are, all else as `Traced`; `answers` are those
    to the first comparisons. Without further comparison this is the function's result, else a `Choice`.
    Branches that divide by the number zero are left out.

    Raises
    ------
    ZeroDivisionError
        If every branch does.
    """
    remaining: list[bool] = list(answers)
    open_conditions: list[Any] = []

    def decide(compare: Callable[..., Any], left: Any, right: Any) -> bool:
        condition = compare(left, right)
        if type(condition).__name__ in ("bool", "bool_", "BooleanTrue", "BooleanFalse"):
            return bool(condition)  # known already
        if remaining:
            return remaining.pop(0)
        open_conditions.append(condition)
        return True

    traced = [Traced(a, decide) if is_symbolic(a) else a for a in arguments]
    with suppress(ZeroDivisionError):
        result = untraced(function(*traced))
        if not open_conditions:
            return result
    branches: dict[bool, Any] = {}
    for answer in (True, False) if open_conditions else ():
        with suppress(ZeroDivisionError):  # floats would fail there, so they never go there
            branches[answer] = choices(function, *arguments, answers=(*answers, answer))
    if not branches:
        raise ZeroDivisionError("every branch divides by zero")
    if len(branches) == 1:
        return next(iter(branches.values()))
    return Choice(open_conditions[0], branches[True], branches[False])


def is_symbolic(value: Any) -> bool:
    """Whether a value is an array or a symbol: anything but a number, a string or a tuple."""
    return not isinstance(value, int | float | str | tuple)


def joined_branches(node: Any, choose: Callable[[Any, Any, Any], Any]) -> Any:
    """Merge a tree of choices into one value by `choose(condition, yes, no)`."""
    if not isinstance(node, Choice):
        return node
    return choose(node.condition, joined_branches(node.yes, choose), joined_branches(node.no, choose))


def complex_value(function: Callable[..., Any], *arguments: Any) -> Any:
    """Value of a function on complex numbers, along the branch that their real parts take."""

    def decide(compare: Callable[..., bool], left: complex, right: complex) -> bool:
        return compare(left.real, right.real)

    def magnitude(z: complex) -> complex:
        return -z if z.real < 0 else z

    traced = [Traced(a, decide, magnitude) if isinstance(a, complex) else a for a in arguments]
    return untraced(function(*traced))
