"""Computed numbers and truth values compared with printed ones."""

import math
from typing import Literal

from paper_verdict.claims import NUMERIC, Claim, ToleranceClass
from paper_verdict.errors import PaperError
from paper_verdict.files import decimals
from paper_verdict.findings import Finding

Agreement = Literal["exact", "close"] | None  # None outside the tolerance class


def check_kind(claim: Claim, tolerance: ToleranceClass, finding: Finding, place: str) -> None:
    """Refuse a finding of another kind than the print: a text for a number, or a number for a statement."""
    if finding == Finding():
        raise PaperError(f"{place}: returned an empty Finding; give it a value, holds, or low and high")
    if (finding.low is None) != (finding.high is None):
        raise PaperError(f"{place}: returned an interval with one end; give low and high")
    if tolerance.measure in NUMERIC and not finding.is_number:
        what = finding.shown if finding.holds is None else finding.holds
        raise PaperError(
            f"{place}: returned {what!r}, the print is the number {claim.printed}; return a number"
        )
    if finding.is_number and not claim.has_number and tolerance.measure != "log10":
        raise PaperError(
            f"{place}: returned a number, the print is {claim.printed!r}; return True or False, or the text"
        )


def compare(claim: Claim, tolerance: ToleranceClass, finding: Finding) -> Agreement:
    """Compare a finding with a claim, within the tolerance class that the claim names."""
    limit = tolerance.limit
    # From the deviation over seeds: a smaller margin is doubtful, and a choice that costs less is close.
    doubtful = (tolerance.seeds or 0.0) * (claim.seed_deviation or 0.0)
    if finding.holds is not None:
        certain = finding.margin is None or finding.margin >= doubtful
        return ("exact" if certain else "close") if finding.holds else None
    if not finding.is_number:
        return "exact" if finding.shown == claim.printed else None
    if tolerance.measure == "log10":
        margin = (finding.value or 0.0) - limit
        margin = -margin if claim.sense == "at_most" else margin
        return ("exact" if margin >= doubtful else "close") if margin >= 0 else None

    units = {"relative": abs(claim.value), "sigma": claim.sigma, "swing": finding.swing}
    largest = max(limit * (units.get(tolerance.measure) or 1.0), tolerance.floor)
    if tolerance.seeds is not None and claim.seed_deviation is not None:
        largest = min(largest, claim.half_unit + doubtful)
    slack = 1e-9 * claim.half_unit + 1e-14 * abs(claim.value)  # decimal fractions are not binary ones
    nearest = finding.nearest(claim.value)
    off = nearest - claim.value
    # Of an interval, the paper does not say which run it means, unless the printed inputs allow all of it.
    exact = abs(off) <= claim.half_unit + slack and (finding.value is not None or finding.allowed)
    if tolerance.measure == "index":
        cheap = finding.margin is not None and abs(finding.margin) <= doubtful
        close = cheap and abs(off) <= limit + slack
    elif claim.sense == "at_most":
        exact = exact or off <= 0
        close = off <= largest + slack
    elif claim.sense == "at_least":
        exact = exact or off >= 0
        close = off >= -largest - slack
    else:
        close = abs(off) <= largest + slack
    close = close and not (tolerance.signed and nearest * claim.value < 0)
    return "exact" if exact else "close" if close else None


def relative_deviation(claim: Claim, tolerance: ToleranceClass, finding: Finding) -> float | None:
    """Deviation as a fraction of the printed number; None for statements.

    For a mean error, the fraction is of the printed standard deviation; for a printed log10, of the number
    whose logarithm is printed.
    """
    if tolerance.measure in ("truth", "log10") or not finding.is_number:
        return None
    value = finding.nearest(claim.value)
    if claim.unit.startswith("log10"):
        return 10 ** (value - claim.value) - 1
    unit = claim.sigma if tolerance.measure == "sigma" and not claim.reading else abs(claim.value)
    return (value - claim.value) / unit if unit else None


def deviation_in_seeds(claim: Claim, tolerance: ToleranceClass, finding: Finding) -> float | None:
    """Deviation of a number of a table or figure in standard deviations over seeds.

    None for statements and best choices, whose seed deviation is that of a margin or of a cost.
    """
    if finding.value is None or not claim.seed_deviation or not claim.row or tolerance.measure == "index":
        return None
    return (finding.value - claim.value) / claim.seed_deviation


def as_printed(value: float, claim: Claim, exact: bool) -> str:
    """Value as text, with the digits and the scale of the printed number.

    If it is not `exact`, it gets more digits until it differs from the print and is rounded by at most 1 %.
    """
    number = value / claim.scale
    power = "e" in claim.printed.lower() and claim.has_number
    places = decimals(claim.printed)
    while True:
        if power:
            shift = math.floor(math.log10(abs(number))) if number else 0
            text = f"{number / 10.0**shift:.{places}f}e{shift}"
        else:
            text = f"{number:.{places}f}"
        near = abs(float(text) - number) <= 0.01 * abs(number)
        differs = not claim.has_number or float(text) != float(claim.printed)
        if exact or places > 8 or (near and differs):
            return text
        places += 1
