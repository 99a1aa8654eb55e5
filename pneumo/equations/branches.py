"""Evaluation of functions written with ``if`` for floats on symbols, arrays and complex numbers.

The physics branches with ``if`` (sonic or not, filling or emptying), but a comparison of symbols or arrays is
neither true nor false. So the function is run once for every combination of answers, and its results are
returned as a tree of choices.
"""

import operator
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from typing import Any, NamedTuple


class Traced:
    """A symbol, array or complex number used like a float; the function `decide` answers its comparisons."""

    __array_ufunc__ = None  # a NumPy array beside it leaves the operation to it

    def __init__(self, value: Any, decide: Callable[..., bool]) -> None:
        self.value, self.decide = value, decide

    def __neg__(self) -> "Traced":
        return Traced(-self.value, self.decide)

    def __abs__(self) -> "Traced":
        if isinstance(self.value, complex):  # has the branches of its real part
            return -self if self.value.real < 0 else self
        return Traced(abs(self.value), self.decide)


def untraced(value: Any) -> Any:
    """Value inside a `Traced`, also inside (nested) tuples; anything else is returned as it is."""
    if type(value) is tuple:
        return tuple(untraced(inner) for inner in value)
    return value.value if isinstance(value, Traced) else value


def _arithmetic(function: Callable[..., Any], mirrored: bool = False) -> Callable[..., Traced]:
    def method(self: Traced, other: Any) -> Traced:
        pair = (untraced(other), self.value) if mirrored else (self.value, untraced(other))
        if function is operator.truediv and isinstance(pair[1], int | float) and pair[1] == 0:
            raise ZeroDivisionError  # as floats do; symbols and arrays would go on with infinity
        return Traced(function(*pair), self.decide)

    return method


def _comparison(function: Callable[..., Any]) -> Callable[..., bool]:
    return lambda self, other: self.decide(function, self.value, untraced(other))


for _name in ("add", "sub", "mul", "truediv", "pow"):
    setattr(Traced, f"__{_name}__", _arithmetic(getattr(operator, _name)))
    setattr(Traced, f"__r{_name}__", _arithmetic(getattr(operator, _name), mirrored=True))
for _name in ("lt", "le", "gt", "ge"):
    setattr(Traced, f"__{_name}__", _comparison(getattr(operator, _name)))


def _equal(left: Any, right: Any) -> Any:
    """`left == right`; for symbols `sympy.Eq`, since their == returns True or False at once."""
    if hasattr(left, "free_symbols") or hasattr(right, "free_symbols"):
        return import_module("sympy").Eq(left, right)
    return left == right


Traced.__eq__ = _comparison(_equal)  # pyright: ignore[reportAttributeAccessIssue]


class _Quantities:
    """Values of a dictionary as attributes, each used as the function `traced` returns it."""

    def __init__(self, values: dict[str, Any], traced: Callable[[Any], Any]) -> None:
        self._values, self._traced = values, traced

    def __getattr__(self, name: str) -> Any:
        return self._traced(self._values[name])


class Choice(NamedTuple):
    """A condition (symbol or array of bool) and the result for either answer: a value or a further choice."""

    condition: Any
    yes: Any
    no: Any


class _Undecided(Exception):
    """Raised where a function compares symbols or arrays; the exception's argument is the comparison."""


def choices(function: Callable[..., Any], *arguments: Any, answers: tuple[bool, ...] = ()) -> Any:
    """Results of a function on symbols or arrays, over all its branches, as a tree of `Choice`.

    If the function compares nothing, its result is returned without a `Choice`. Numbers are passed to the
    function as they are, a dictionary as an object with attributes, all else as `Traced`. `answers` fixes the
    outcomes of the first comparisons; only the recursion uses it. Branches that divide by the number zero are
    left out; `ZeroDivisionError` if every branch does.
    """
    remaining = iter(answers)

    def decide(compare: Callable[..., Any], left: Any, right: Any) -> bool:
        condition = compare(left, right)
        if type(condition).__name__ in ("bool", "bool_", "BooleanTrue", "BooleanFalse"):
            return bool(condition)  # known already
        answer = next(remaining, None)
        if answer is None:
            raise _Undecided(condition)
        return answer

    def traced(value: Any) -> Any:
        if isinstance(value, dict):
            return _Quantities(value, traced)
        return value if isinstance(value, int | float) else Traced(value, decide)

    try:
        return untraced(function(*map(traced, arguments)))
    except _Undecided as undecided:
        condition = undecided.args[0]
    branches: list[Any] = []
    for answer in (True, False):
        with suppress(ZeroDivisionError):  # floats would fail there, so they never go there
            branches.append(choices(function, *arguments, answers=(*answers, answer)))
    if not branches:
        raise ZeroDivisionError("every branch divides by zero")
    return Choice(condition, *branches) if len(branches) == 2 else branches[0]


def joined_branches(node: Any, choose: Callable[[Any, Any, Any], Any]) -> Any:
    """Merge a tree of choices into one value, or a tuple of them, by `choose(condition, yes, no)`."""
    if not isinstance(node, Choice):
        return node
    yes, no = joined_branches(node.yes, choose), joined_branches(node.no, choose)
    if isinstance(yes, tuple):
        return tuple(choose(node.condition, *pair) for pair in zip(yes, no, strict=True))
    return choose(node.condition, yes, no)


def complex_value(function: Callable[[Any], Any], known: dict[str, Any]) -> Any:
    """Value of a function of known floats or complex numbers; comparisons inside it compare real parts."""

    def decide(compare: Callable[..., bool], left: complex, right: complex) -> bool:
        return compare(left.real, right.real)

    traced = lambda value: Traced(value, decide) if isinstance(value, complex) else value  # noqa: E731
    return untraced(function(_Quantities(known, traced)))
