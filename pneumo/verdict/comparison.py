"""How a finding compares with a printed number or statement, and how deviations are written.

The rules stand in ``paper/decisions/0010-tolerance-classes.md``.
"""

import math
from decimal import Decimal
from typing import Literal, NamedTuple

from pneumo.verdict.claims import Claim, ToleranceClass
from pneumo.verdict.sources import Finding

DEVIATION_FORMATS = {  # measure -> number format and what follows the number
    "absolute": ("{:+.3g}", ""),
    "relative": ("{:+.1%}", ""),
    "sigma": ("{:+.2f}", " sigma"),
    "swing": ("{:+.2%}", " of the swing"),
    "log10": ("{:.3f}", " decades"),
}


class Comparison(NamedTuple):
    """How a finding compares with a claim."""

    agreement: Literal["exact", "close"] | None  # None outside the tolerance class
    deviation: float | None  # found less printed in the measure of the class; None for statements
    limit: float  # of the class, in the same measure


def compare(claim: Claim, tolerance: ToleranceClass, finding: Finding) -> Comparison:
    """Compare a finding with a claim, within the tolerance class that the claim names."""
    limit = tolerance.limit
    if finding.holds is not None:
        return Comparison("exact" if finding.holds else None, None, limit)
    if finding.value is None and finding.low is None:
        return Comparison("exact" if finding.shown == claim.printed else None, None, limit)
    if tolerance.measure == "log10":
        value = finding.value or 0.0
        holds = value <= limit if claim.sense == "at_most" else value >= limit
        return Comparison("exact" if holds else None, value, limit)

    printed = claim.value
    units = {"relative": abs(printed), "sigma": claim.sigma, "swing": finding.swing}
    scale = units.get(tolerance.measure) or 1.0
    limit = max(limit, tolerance.floor / scale)
    slack = 1e-9 * max(abs(printed), claim.half_unit)  # decimal fractions are not binary ones
    if finding.low is not None and finding.high is not None:
        nearest = min(max(printed, finding.low), finding.high)
        exact = False  # the paper does not say which run it means
    else:
        nearest = finding.value or 0.0
        exact = abs(nearest - printed) <= claim.half_unit + slack
    deviation = (nearest - printed) / scale
    if claim.sense == "at_most":
        exact = exact or nearest <= printed
        close = deviation <= limit + slack / scale
    else:
        close = abs(deviation) <= limit + slack / scale
    return Comparison("exact" if exact else "close" if close else None, deviation, limit)


def deviation_in_words(comparison: Comparison, tolerance: ToleranceClass) -> str:
    """Deviation with its limit, such as ``+3.2% (limit 10.0%)``; empty for a statement."""
    if comparison.deviation is None:
        return ""
    form, after = DEVIATION_FORMATS[tolerance.measure]
    limit = form.format(comparison.limit).removeprefix("+")
    return f"{form.format(comparison.deviation)}{after} (limit {limit})"


def as_printed(value: float, claim: Claim, exact: bool) -> str:
    """Value with the digits and the scale of the printed one.

    Where it would then look equal but is not (`exact` is false), or would be off by more than 1 %, it gets
    more digits.
    """
    number = value / claim.scale
    mantissa, _, power = claim.printed.partition("e")
    exponent = Decimal(mantissa).as_tuple().exponent
    decimals = max(0, -exponent) if isinstance(exponent, int) else 0
    while True:
        if power:
            shift = math.floor(math.log10(abs(number))) if number else 0
            text = f"{number / 10.0**shift:.{decimals}f}e{shift}"
        else:
            text = f"{number:.{decimals}f}"
        near = abs(float(text) - number) <= 0.01 * abs(number)
        if exact or decimals > 8 or (near and float(text) != float(claim.printed)):
            return text
        decimals += 1
