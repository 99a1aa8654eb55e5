"""The verdict: every printed number and statement of the paper, judged against the results.

The rules stand in ``paper/decisions/0010-tolerance-classes.md``, the claims in ``paper/2006/claims.yaml``.
"""

import csv
import math
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr

from pneumo.papers.paper_2006 import computations  # noqa: F401 - they register their computations
from pneumo.papers.paper_2006.highlights import highlights
from pneumo.storage.files import read
from pneumo.verdict.claims import FOLDER, UNITS, Claim, ToleranceClass, read_claims
from pneumo.verdict.errata import Erratum, read_errata
from pneumo.verdict.ledger import read_assumptions
from pneumo.verdict.sources import COMPUTATIONS, Absent, Finding, Printed, Results

STATUSES = ("exact", "close", "explained", "contradicted", "missed", "unreadable")
MEASURES = {  # deviation in words: number format and what follows it
    "absolute": ("{:+.3g}", ""),
    "relative": ("{:+.1%}", ""),
    "sigma": ("{:+.2f}", " sigma"),
    "swing": ("{:+.2%}", " of the swing"),
    "log10": ("{:.3f}", " decades"),
}


class Judgement(NamedTuple):
    """How a finding compares with a claim.

    Attributes
    ----------
    agreement : {"exact", "close"} or None
        None where the finding lies outside the tolerance class.
    deviation : float or None
        Reproduced less printed in the measure of the class; None for statements.
    limit : float
        Limit of the class, in the same measure.
    """

    agreement: str | None
    deviation: float | None
    limit: float


def compare(claim: Claim, tolerance: ToleranceClass, finding: Finding) -> Judgement:
    """Compare a finding with a claim.

    Parameters
    ----------
    claim : Claim
    tolerance : ToleranceClass
        The class that the claim names.
    finding : Finding

    Returns
    -------
    Judgement
    """
    limit = tolerance.limit
    if finding.holds is not None:
        return Judgement("exact" if finding.holds else None, None, limit)
    if finding.value is None and finding.low is None:
        return Judgement("exact" if finding.shown == claim.printed else None, None, limit)
    if tolerance.measure == "log10":
        value = finding.value or 0.0
        holds = value <= limit if claim.sense == "at_most" else value >= limit
        return Judgement("exact" if holds else None, value, limit)

    printed = claim.value
    unit = {"absolute": 1.0, "relative": abs(printed), "sigma": claim.sigma, "swing": finding.swing}
    scale = unit[tolerance.measure] or 1.0
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
    return Judgement("exact" if exact else "close" if close else None, deviation, limit)


def as_printed(value: float, claim: Claim, exact: bool) -> str:
    """Write a reproduced value with the digits and the scale of the printed one.

    Where it would then look equal but is not, or would be off by more than 1 %, it gets more digits.
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


class Court:
    """Claims, results and errata in one place; judges one claim at a time.

    Parameters
    ----------
    results : pathlib.Path
        Folder of results.
    paper : pathlib.Path
        Folder of claims, errata and published tables.
    """

    def __init__(self, results: Path, paper: Path = FOLDER):
        self.claims = read_claims(paper)
        self.errata = read_errata(paper)
        self.sources = {
            "published": Results(results, "published"),
            "exact": Results(results, "exact"),
            "printed": Printed(results),
        }
        toggles = results / "assumptions.nc"
        self.toggled = read(toggles, "reproduced")["reproduced"] if toggles.exists() else None

    def finding(self, claim: Claim, source: str) -> Finding:
        """Run a claim's computation on a source: ``published``, ``exact`` or ``printed``."""
        try:
            finding = COMPUTATIONS[claim.compute](self.sources[source], **claim.arguments)
        except KeyError as error:
            raise Absent(f"the results have no {error}") from None
        if any(value is not None and not math.isfinite(value) for value in (finding.value, finding.low)):
            raise Absent("a run that it needs failed")
        return finding

    def stands(self, claim: Claim, source: str) -> tuple[bool | None, str]:
        """Whether a claim about models stands on another source, and what was found there."""
        own_cell = source == "printed" and claim.table is not None  # it would be compared with itself
        if not claim.models or claim.unreadable or own_cell:
            return None, ""
        try:
            finding = self.finding(claim, source)
        except Absent as error:
            return None, str(error)
        judgement = compare(claim, self.claims.classes[claim.tolerance], finding)
        return judgement.agreement is not None, self.words(claim, finding, judgement)

    def words(self, claim: Claim, finding: Finding, judgement: Judgement) -> str:
        """Say what was found, in words."""
        if finding.value is None or claim.tolerance == "decade":
            return finding.shown
        text = as_printed(finding.value, claim, judgement.agreement == "exact")
        if claim.scale in (1.0, 0.01):
            text = f"{text} {UNITS.get(claim.unit, claim.unit)}".rstrip()
        return f"{text} ({finding.shown})" if finding.shown else text

    def explanation(self, claim: Claim, finding: Finding) -> str:
        """Name the erratum or the alternative assumption that brings an item inside its class, or nothing."""
        tolerance = self.claims.classes[claim.tolerance]
        erratum = self.errata[claim.erratum] if claim.erratum else None
        if erratum and erratum.passes:
            meant = erratum.values.get(claim.id)
            if meant is None and finding.holds is False:
                return f"erratum {erratum.id}: {erratum.meant}"
            if meant is not None:
                corrected = claim.model_copy(update={"printed": meant})
                if compare(corrected, tolerance, finding).agreement:
                    return f"erratum {erratum.id}: {erratum.meant}"
        if claim.assumption and self.toggled is not None:
            value = alternative(self.toggled, claim.assumption, claim.id)
            if value is not None and compare(claim, tolerance, finding._replace(value=value)).agreement:
                return f"assumption {claim.assumption}: {as_printed(value, claim, False)}"
        return ""

    def judge(self, claim: Claim) -> dict[str, Any]:
        """Judge one claim: an item of the verdict."""
        tolerance = self.claims.classes[claim.tolerance]
        stands_exact, exact_words = self.stands(claim, "exact")
        stands_printed, printed_words = self.stands(claim, "printed")
        try:
            finding = self.finding(claim, "published")
        except Absent as error:
            finding, judgement = Finding(), Judgement(None, None, tolerance.limit)
            status, reason = "missed", f"not to be judged: {error}"
        else:
            judgement = compare(claim, tolerance, finding)
            status, reason = self._status(claim, finding, judgement, stands_printed, printed_words)
        if claim.unreadable:
            status, reason = "unreadable", claim.unreadable
        readable = not claim.unreadable
        return {
            "id": claim.id,
            "where": claim.where,
            "statement": claim.statement,
            "printed": claim.printed,
            "reproduced": _reproduced(finding),
            "shown": self.words(claim, finding, judgement),
            "deviation": _rounded(judgement.deviation) if readable else None,
            "tolerance": {
                "class": claim.tolerance,
                "limit": _rounded(judgement.limit),
                "measure": tolerance.measure,
                "sense": claim.sense,
            },
            "unit": claim.unit,
            "scale": claim.scale,
            "kind": claim.kind,
            "status": status,
            "stands_exact": stands_exact,
            "shown_exact": exact_words,
            "stands_printed": stands_printed,
            "shown_printed": printed_words,
            "used_in_identification": claim.used_in_identification,
            "reason": reason,
            "erratum": claim.erratum or claim.see,
            "assumption": claim.assumption,
            "evidence": {
                "path": claim.evidence.path,
                "select": claim.evidence.select,
                "compute": claim.compute,
                "command": f"pneumo explain {claim.id}",
            },
            "table": claim.table,
            "row": claim.row,
            "column": claim.column,
            "level": claim.level,
        }

    def _status(
        self, claim: Claim, finding: Finding, judgement: Judgement, stands_printed: bool | None, own: str
    ) -> tuple[str, str]:
        off = deviation_in_words(judgement, self.claims.classes[claim.tolerance])
        if judgement.agreement == "exact":
            statement = finding.holds is not None or claim.tolerance == "decade" or claim.sense == "at_most"
            return "exact", "true as stated" if statement else "equal at the printed digits"
        if judgement.agreement == "close":
            return "close", f"{off}, inside class {claim.tolerance}"
        if reason := self.explanation(claim, finding):
            return "explained", reason
        outside = f"{off}, outside class {claim.tolerance}" if off else "not so"
        if claim.arithmetic:
            return "contradicted", f"{outside}: the paper's own formulas and numbers say otherwise"
        if stands_printed is False:
            return "contradicted", f"{outside}; the paper's own tables refute it too: {own}"
        return "missed", f"{outside}; no erratum and no alternative assumption explains it"


def deviation_in_words(judgement: Judgement, tolerance: ToleranceClass) -> str:
    """Write a deviation with its limit, such as ``+3.2% (limit 10.0%)``."""
    if judgement.deviation is None:
        return ""
    form, after = MEASURES[tolerance.measure]
    limit = form.format(judgement.limit).removeprefix("+")
    return f"{form.format(judgement.deviation)}{after} (limit {limit})"


def alternative(toggled: xr.DataArray, name: str, item: str) -> float | None:
    """Value that an alternative assumption gives to an item, from ``assumptions.nc``, or None."""
    try:
        return float(toggled.sel(alternative=name, item=item))
    except KeyError:
        return None


def _rounded(value: float | None) -> float | None:
    """Six significant digits: more would differ between machines and say nothing."""
    return None if value is None or not math.isfinite(value) else float(f"{value:.6g}")


def _reproduced(finding: Finding) -> Any:
    if finding.value is not None:
        return _rounded(finding.value)
    if finding.low is not None and finding.high is not None:
        return [_rounded(finding.low), _rounded(finding.high)]
    return finding.shown if finding.holds is None else bool(finding.holds)


def verdict(results: Path, paper: Path = FOLDER) -> dict[str, Any]:
    """Judge every claim.

    Parameters
    ----------
    results : pathlib.Path
        Folder of results.
    paper : pathlib.Path
        Folder of claims, errata, assumptions and published tables.

    Returns
    -------
    dict
        ``study``, ``counts`` by status, ``failures`` and ``settling_failures`` by experiment, ``items``,
        ``highlights``, ``classes``, ``errata``, ``assumptions`` and whether these were toggled.
    """
    court = Court(results, paper)
    items = [court.judge(claim) for claim in court.claims.items.values()]
    counts = {status: sum(item["status"] == status for item in items) for status in STATUSES}
    return {
        "study": court.sources["published"].study.name,
        "counts": {"items": len(items)} | counts,
        "failures": court.sources["published"].failures,
        "settling_failures": court.sources["published"].settling_failures,
        "highlights": highlights(court.sources, items),
        "items": items,
        "classes": {name: tolerance.model_dump() for name, tolerance in court.claims.classes.items()},
        "errata": [_plain(erratum) for erratum in court.errata.values()],
        "assumptions": {name: entry.model_dump() for name, entry in read_assumptions(paper).items()},
        "assumptions_run": court.toggled is not None,
    }


def _plain(erratum: Erratum) -> dict[str, Any]:
    return erratum._asdict() | {"values": dict(erratum.values)}


def read_statuses(paper: Path = FOLDER) -> dict[str, str]:
    """Read the recorded status of every item: ``paper/2006/statuses.csv``, empty if there is none."""
    if not (paper / "statuses.csv").exists():
        return {}
    with (paper / "statuses.csv").open(encoding="utf-8", newline="") as file:
        return {row["id"]: row["status"] for row in csv.DictReader(file)}


def statuses_text(items: list[Mapping[str, Any]]) -> str:
    """Write the statuses of items as ``paper/2006/statuses.csv`` has them."""
    return "".join(["id,status\n", *(f"{item['id']},{item['status']}\n" for item in items)])
