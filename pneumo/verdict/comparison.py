"""Computed numbers and truth values compared with printed ones; deviations expressed in words.

The rules are in decisions 10 and 39.
"""

import math
from decimal import Decimal
from typing import Literal, NamedTuple

from pneumo.verdict.claims import READ_OFF, Claim, ToleranceClass
from pneumo.verdict.sources import Finding

DEVIATION_FORMATS = {  # measure -> number format and what follows the number
    "absolute": ("{:+.3g}", ""),
    "relative": ("{:+.2%}", ""),
    "sigma": ("{:+.3g}", " sigma"),
    "swing": ("{:+.2%}", " of the swing"),
    "log10": ("{:.3f}", " decades"),
    "index": ("{:+.2g}", ""),
}


class Comparison(NamedTuple):
    """Agreement of a finding with a claim."""

    agreement: Literal["exact", "close"] | None  # None outside the tolerance class
    deviation: float | None  # found less printed in the measure of the class; None for statements
    limit: float  # of the class, in the same measure


def _unit(claim: Claim, tolerance: ToleranceClass, swing: float | None) -> float:
    """Printed number, sigma or swing that a class's limit is a multiple of, in the claim's unit; else 1."""
    units = {"relative": abs(claim.value), "sigma": claim.sigma, "swing": swing}
    return units.get(tolerance.measure) or 1.0


def largest_difference(claim: Claim, tolerance: ToleranceClass, swing: float | None = None) -> float:
    """Largest difference from the printed number at which an item is still close, in the claim's unit.

    `swing` is the change during the run, in the same unit. The limit is that of the class; for a number that
    seeds change, also half a unit of its last digit plus a fraction of its deviation over seeds, if lower.
    """
    largest = max(tolerance.limit * _unit(claim, tolerance, swing), tolerance.floor)
    if tolerance.seeds is not None and claim.seed_deviation is not None:
        return min(largest, claim.half_unit + tolerance.seeds * claim.seed_deviation)
    return largest


def where_true(claim: Claim, tolerance: ToleranceClass) -> tuple[float, float]:
    """Lowest and highest number, or margin, with which a statement is true."""
    if tolerance.measure == "truth":
        return 0.0, math.inf
    if tolerance.measure == "log10":
        return (-math.inf, tolerance.limit) if claim.sense == "at_most" else (tolerance.limit, math.inf)
    largest = largest_difference(claim, tolerance)
    low = -math.inf if claim.sense == "at_most" else claim.value - largest
    return low, claim.value + largest


def compare(claim: Claim, tolerance: ToleranceClass, finding: Finding) -> Comparison:
    """Compare a finding with a claim, within the tolerance class that the claim names."""
    limit = tolerance.limit
    if finding.holds is not None:
        doubtful = finding.margin is not None and finding.margin < _doubt(claim, tolerance)
        return Comparison(("close" if doubtful else "exact") if finding.holds else None, None, limit)
    if finding.value is None and finding.low is None:
        return Comparison("exact" if finding.shown == claim.printed else None, None, limit)
    if tolerance.measure == "log10":
        value = finding.value or 0.0
        low, high = where_true(claim, tolerance)
        doubtful = min(value - low, high - value) < _doubt(claim, tolerance)
        agreement = ("close" if doubtful else "exact") if low <= value <= high else None
        return Comparison(agreement, value, limit)

    printed = claim.value
    scale = _unit(claim, tolerance, finding.swing)
    limit = largest_difference(claim, tolerance, finding.swing) / scale
    slack = 1e-9 * max(abs(printed), claim.half_unit)  # decimal fractions are not binary ones
    if finding.low is not None and finding.high is not None:
        nearest = min(max(printed, finding.low), finding.high)
        # Else the paper does not say which run it means.
        exact = finding.allowed and abs(nearest - printed) <= claim.half_unit + slack
    else:
        nearest = finding.value or 0.0
        exact = abs(nearest - printed) <= claim.half_unit + slack
    deviation = (nearest - printed) / scale
    if tolerance.measure == "index":
        cheap = finding.margin is not None and abs(finding.margin) <= _doubt(claim, tolerance)
        close = cheap and abs(deviation) <= tolerance.limit + slack
    elif claim.sense == "at_most":
        exact = exact or nearest <= printed
        close = deviation <= limit + slack / scale
    else:
        close = abs(deviation) <= limit + slack / scale
    close = close and not (tolerance.signed and nearest * printed < 0)
    return Comparison("exact" if exact else "close" if close else None, deviation, limit)


def relative_deviation(claim: Claim, tolerance: ToleranceClass, finding: Finding) -> float | None:
    """Deviation as a fraction of the printed number; None for statements.

    For a mean error, the fraction is of the printed standard deviation; for a printed log10, of the number
    whose logarithm is printed.
    """
    if tolerance.measure in ("truth", "log10") or finding.holds is not None:
        return None
    value = finding.value
    if finding.low is not None and finding.high is not None:
        value = min(max(claim.value, finding.low), finding.high)
    if value is None:
        return None
    if claim.unit.startswith("log10"):
        return 10 ** (value - claim.value) - 1
    unit = claim.sigma if tolerance.measure == "sigma" and claim.tolerance != READ_OFF else abs(claim.value)
    return (value - claim.value) / unit if unit else None


def _doubt(claim: Claim, tolerance: ToleranceClass) -> float:
    """Limit from the deviation over seeds: smaller margins are doubtful, and n of a smaller cost close."""
    return (tolerance.seeds or 0.0) * (claim.seed_deviation or 0.0)


def deviation_in_words(comparison: Comparison, tolerance: ToleranceClass) -> str:
    """Deviation with its limit, such as ``+3.20% (limit 10.00%)``; empty for a statement."""
    if comparison.deviation is None:
        return ""
    form, after = DEVIATION_FORMATS[tolerance.measure]
    limit = form.format(comparison.limit).removeprefix("+")
    return f"{form.format(comparison.deviation)}{after} (limit {limit})"


def as_printed(value: float, claim: Claim, exact: bool) -> str:
    """Value as text, with the digits and the scale of the printed number.

    If it is not `exact`, it gets more digits until it differs from the print and is rounded by at most 1 %.
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
