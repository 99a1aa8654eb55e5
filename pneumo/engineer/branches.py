"""Functions written with ``if`` for floats, evaluated on symbols, arrays and complex numbers.

The physics decides with ``if`` (sonic or not, filling or emptying). A symbol cannot answer. So the function
is run once for every way its questions may be answered, and the results are put together again as a tree.
"""

import operator
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NamedTuple


class Traced:
    """A value that stands in for a float; its comparisons are answered by `decide`.

    Parameters
    ----------
    value : array, symbol or complex
    decide : callable
        Of operator, left and right value: returns a bool.
    magnitude : callable
        Absolute value of a value.
    """

    __array_ufunc__ = None  # a NumPy array beside it leaves the operation to it

    def __init__(self, value: Any, decide: Callable[..., bool], magnitude: Callable[[Any], Any] = abs):
        self.value, self.decide, self.magnitude = value, decide, magnitude

    def _with(self, value: Any) -> "Traced":
        return Traced(value, self.decide, self.magnitude)

    def __neg__(self) -> "Traced":
        return self._with(-self.value)

    def __abs__(self) -> "Traced":
        return self._with(self.magnitude(self.value))


def bare(value: Any) -> Any:
    """Take the value out of a `Traced`, and out of a tuple of them."""
    if type(value) is tuple:
        return tuple(bare(inner) for inner in value)
    return value.value if isinstance(value, Traced) else value


def _arithmetic(function: Callable[..., Any], mirrored: bool = False) -> Callable[..., Traced]:
    def method(self: Traced, other: Any) -> Traced:
        pair = (bare(other), self.value) if mirrored else (self.value, bare(other))
        if function is operator.truediv and isinstance(pair[1], int | float) and pair[1] == 0:
            raise ZeroDivisionError  # as floats do; symbols and arrays would go on with infinity
        return self._with(function(*pair))

    return method


def _comparison(function: Callable[..., Any]) -> Callable[..., bool]:
    return lambda self, other: self.decide(function, self.value, bare(other))


for _name in ("add", "sub", "mul", "truediv", "pow"):
    setattr(Traced, f"__{_name}__", _arithmetic(getattr(operator, _name)))
    setattr(Traced, f"__r{_name}__", _arithmetic(getattr(operator, _name), mirrored=True))
for _name in ("lt", "le", "gt", "ge"):
    setattr(Traced, f"__{_name}__", _comparison(getattr(operator, _name)))


class Fork(NamedTuple):
    """A question and what follows from either answer: results, or further forks.

    Attributes
    ----------
    condition : symbol or array of bool
    yes, no : Fork or any
    """

    condition: Any
    yes: Any
    no: Any


def tree(function: Callable[..., Any], *arguments: Any, asked: tuple[bool, ...] = ()) -> Any:
    """Evaluate a function on symbols or arrays along every path through its questions.

    Parameters
    ----------
    function : callable
    *arguments : any
        Of the function. Named tuples and numbers go in as they are, all else as `Traced`.
    asked : tuple of bool
        Answers to the first questions.

    Returns
    -------
    Fork, or what the function returns where it asks no further question. Ways that end in a division by
    the number zero are left out.

    Raises
    ------
    ZeroDivisionError
        If every way ends so.
    """
    answers, found = list(asked), []

    def decide(compare: Callable[..., Any], left: Any, right: Any) -> bool:
        condition = compare(left, right)
        if type(condition).__name__ in ("bool", "bool_", "BooleanTrue", "BooleanFalse"):
            return bool(condition)  # known, so no question
        if answers:
            return answers.pop(0)
        found.append(condition)
        return True

    traced = [Traced(a, decide) if is_symbolic(a) else a for a in arguments]
    with suppress(ZeroDivisionError):
        result = bare(function(*traced))
        if not found:
            return result
    if not found:
        raise ZeroDivisionError("no way through the function's questions ends in a number")
    ways = {}
    for answer in (True, False):
        with suppress(ZeroDivisionError):  # floats would fail there, so they never go there
            ways[answer] = tree(function, *arguments, asked=(*asked, answer))
    if not ways:
        raise ZeroDivisionError("no way through the function's questions ends in a number")
    return Fork(found[0], ways[True], ways[False]) if len(ways) == 2 else next(iter(ways.values()))


def is_symbolic(value: Any) -> bool:
    """Whether a value is an array or a symbol: anything but a number, a string or a tuple."""
    return not isinstance(value, int | float | str | tuple)


def joined(node: Any, choose: Callable[[Any, Any, Any], Any]) -> Any:
    """Make one value of a tree by `choose(condition, yes, no)`."""
    if not isinstance(node, Fork):
        return node
    return choose(node.condition, joined(node.yes, choose), joined(node.no, choose))


def at_point(function: Callable[..., Any], *arguments: Any) -> Any:
    """Evaluate a function on complex numbers along the path that their real parts take."""

    def decide(compare: Callable[..., bool], left: complex, right: complex) -> bool:
        return compare(left.real, right.real)

    def magnitude(z: complex) -> complex:
        return -z if z.real < 0 else z

    traced = [Traced(a, decide, magnitude) if isinstance(a, complex) else a for a in arguments]
    return bare(function(*traced))
