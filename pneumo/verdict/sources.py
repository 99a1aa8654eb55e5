"""What a computation of a claim returns.

A computation takes one of a paper's sources, such as the results of a study, and the arguments that stand
with the claim; it returns a `Finding`.
"""

from collections.abc import Callable
from typing import NamedTuple


class MissingEvidence(LookupError):
    """A claim cannot be judged: the study lacks what it needs, or the paper does not print it."""


class Finding(NamedTuple):
    """What a computation found."""

    value: float | None = None  # in the claim's unit (a fraction where the claim has per cent)
    holds: bool | None = None  # whether a statement is true, where there is no number to compare
    shown: str = ""  # what was found, in words, where the number alone does not say it
    #: How far a statement is from turning over, decades of mean square error (above 0: true); of a best n,
    #: what the printed one costs: logarithm of a quotient of mean square errors.
    margin: float | None = None
    varies: float | None = None  # what seeds change, where that is neither the value nor the margin
    low: float | None = None  # an interval in place of a value, where the paper leaves open which run it
    high: float | None = None  # speaks of
    allowed: bool = False  # whether the interval is all that printed inputs allow: a number in it is met
    swing: float | None = None  # change during the run, in the unit of the value


Computation = Callable[..., Finding]
