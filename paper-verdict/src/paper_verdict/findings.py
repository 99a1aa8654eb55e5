"""Result of the computation of a claim.

A computation takes one of a paper's sources, such as the results of a study, and the claim's arguments; it
returns a `Finding`, or a number, a truth value or a text.
"""

import math
from collections.abc import Callable
from numbers import Real
from typing import Any, NamedTuple

from paper_verdict.errors import PaperError


class MissingEvidence(LookupError):
    """A claim cannot be judged: a result or a printed number that it needs is missing."""


class Finding(NamedTuple):
    """Result of a computation: a number, an interval or the truth of a statement."""

    value: float | None = None  # in the claim's unit (a fraction where the claim has per cent)
    holds: bool | None = None  # whether a statement is true, where there is no number to compare
    shown: str = ""  # the finding in words, where the number alone does not say it
    #: Distance of a statement from being false, in the unit of its seed deviation (above 0: true); of a class
    #: measured as ``index``, cost of the printed choice over that of the best one.
    margin: float | None = None
    low: float | None = None  # interval instead of a value, where the paper does not say which run it means
    high: float | None = None
    allowed: bool = False  # whether the interval is all that the printed inputs allow: agreement inside it
    swing: float | None = None  # change during the run, in the unit of the value

    @property
    def is_number(self) -> bool:
        """Whether the result is a number or an interval, not a statement or a mark."""
        return self.value is not None or self.low is not None

    @property
    def is_finite(self) -> bool:
        """Whether no number of it is infinite or NaN, as those of a failed run are."""
        numbers = (self.value, self.low, self.high)
        return all(number is None or math.isfinite(number) for number in numbers)

    def nearest(self, number: float) -> float:
        """The value, or the number of the interval that is nearest to `number`."""
        if self.value is not None:
            return self.value
        return min(max(number, self.low or 0.0), self.high or 0.0)


Computation = Callable[..., Any]


def as_finding(result: Any, place: str) -> Finding:
    """Finding of whatever a computation returned; `PaperError` if it is nothing that can be compared."""
    if isinstance(result, Finding):
        return result
    if hasattr(result, "item") and getattr(result, "size", 1) == 1:  # a number of NumPy or xarray
        result = result.item()
    if isinstance(result, bool):
        return Finding(holds=result)
    if isinstance(result, str):
        return Finding(shown=result)
    if isinstance(result, Real):
        return Finding(float(result))
    raise PaperError(f"{place}: returned {repr(result)[:60]}; return a number, True or False, or a Finding")
