"""The verdict: every printed number and statement of a paper, judged against the results."""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr

from pneumo.verdict.assumptions import read_assumptions
from pneumo.verdict.claims import READ_OFF, UNITS_IN_TEXT, Claim, read_claims
from pneumo.verdict.comparison import (
    Comparison,
    as_printed,
    compare,
    deviation_in_words,
    relative_deviation,
)
from pneumo.verdict.doubts import read_doubts
from pneumo.verdict.errata import Proof, read_errata
from pneumo.verdict.facts import headline, judged_facts
from pneumo.verdict.published import recorded
from pneumo.verdict.sources import Computation, Finding, MissingEvidence

STATUSES = ("exact", "close", "explained", "contradicted", "missed", "not judged")
OF_RESULTS = ("prediction", "fitted")  # kinds of evidence of items that depend on the parameters

Item = dict[str, Any]  # one judged claim, as in verdict.json
# Sources that computations read, by name. The first decides; where there are sources "exact" (the paper's
# runs with exact signals) and "printed" (its own tables), claims about models are judged with them too.
Sources = Mapping[str, Any]


def _not_run(results: Path, sources: Sources) -> None:
    """Return None: no alternative assumption was run."""


def _unchanged(_: Sources) -> str:
    """Return nothing: the results are of the paper's parameters."""
    return ""


def _no_seeds(sources: Sources, items: Sequence[str]) -> None:
    """Return None: the deviation over seeds is not known."""


class Paper(NamedTuple):
    """A paper to be judged: its files and the functions that its files name."""

    folder: Path  # of claims, errata, assumptions, recorded statuses and published tables
    computations: Mapping[str, Computation]  # by the name that ``claims.yaml`` gives under ``compute``
    proofs: Mapping[str, Proof]  # by the name that ``errata.yaml`` gives under ``proof``
    sources: Callable[[Path, Path], Sources]  # from a folder of results and the paper's folder
    about: Callable[[Sources], dict[str, Any]]  # name of the study, and runs that failed: see `verdict`
    highlights: Callable[[Sources, Sequence[Item]], dict[str, Any]]  # head of the verdict, from judged items
    command: str  # that shows one item, before the item's name
    # Number of each item under each alternative assumption, by (alternative, item); None if not run.
    alternatives: Callable[[Path, Sources], xr.DataArray | None] = _not_run
    # Why numbers of the results are not the paper's, such as changed parameters; empty if they are.
    changed: Callable[[Sources], str] = _unchanged
    arguments: Mapping[str, Computation] = {}  # by the name that ``doubts.yaml`` gives under ``argument``
    # Chi-square of some items, over the spread of seeds and of printing; None if it is not known.
    chi_square: Callable[[Sources, Sequence[str]], float | None] = _no_seeds


class Judge:
    """Claims, errata and results (a folder) of a paper, to judge one claim at a time."""

    def __init__(self, results: Path, paper: Paper) -> None:
        self.paper = paper
        self.claims = read_claims(paper.folder)
        self.errata = read_errata(paper.folder, paper.proofs)
        self.sources = paper.sources(results, paper.folder)
        self.doubts = read_doubts(paper.folder, paper.arguments, next(iter(self.sources.values())))
        self.changed = paper.changed(self.sources)
        self.alternatives = paper.alternatives(results, self.sources)

    def finding(self, claim: Claim, source: str) -> Finding:
        """Run a claim's computation on a source; `MissingEvidence` if a result that it needs is missing."""
        try:
            finding = self.paper.computations[claim.compute](self.sources[source], **claim.arguments)
        except KeyError as error:
            raise MissingEvidence(f"the results have no {error}") from None
        if any(value is not None and not math.isfinite(value) for value in (finding.value, finding.low)):
            raise MissingEvidence("a run that it needs failed")
        return finding

    def judge(self, claim: Claim) -> Item:
        """Judge one claim; return its item of ``results/verdict.json``."""
        tolerance = self.claims.classes[claim.tolerance]
        holds_exact, shown_exact = self._holds(claim, "exact")
        holds_printed, shown_printed = self._holds(claim, "printed")
        try:
            finding = self.finding(claim, next(iter(self.sources)))
        except MissingEvidence as error:
            finding, comparison = Finding(), Comparison(None, None, tolerance.limit)
            status, reason = "not judged", str(error)
        else:
            comparison = compare(claim, tolerance, finding)
            meant = self._as_meant(claim)
            if comparison.agreement is None and meant != claim:  # an erratum comes before any deviation
                comparison = compare(meant, tolerance, finding)._replace(agreement=None)
            refuted = shown_printed if holds_printed is False else None
            status, reason = self._status(claim, finding, comparison, refuted)
            if self.changed and claim.basis in OF_RESULTS:
                status, reason = "not judged", self.changed
        return {
            **claim.model_dump(include={"id", "where", "statement", "printed"}),
            "meant": self._as_meant(claim).printed,
            "reproduced": _reproduced(finding),
            "shown": _in_words(claim, finding, comparison),
            "deviation": six_digits(comparison.deviation),
            "relative": six_digits(relative_deviation(self._as_meant(claim), tolerance, finding)),
            "tolerance": {"class": claim.tolerance, "limit": six_digits(comparison.limit)}
            | {"measure": tolerance.measure, "sense": claim.sense},
            **claim.model_dump(include={"unit", "scale", "kind", "fact"}),
            "basis": claim.basis,
            "seeds": _in_seeds(self._as_meant(claim), finding),
            "status": status,
            "stands_exact": holds_exact,
            "shown_exact": shown_exact,
            "stands_printed": holds_printed,
            "shown_printed": shown_printed,
            "reason": reason,
            "erratum": claim.erratum or claim.see,
            "doubts": [name for name, doubt in self.doubts.items() if doubt.concerns(claim.id)],
            "assumption": claim.assumption,
            "evidence": claim.evidence.model_dump()
            | {"compute": claim.compute, "command": f"{self.paper.command} {claim.id}"},
            **claim.model_dump(include={"table", "row", "column", "level"}),
        }

    def _holds(self, claim: Claim, source: str) -> tuple[bool | None, str]:
        """Whether a claim about models holds by `source`, "exact" or "printed", and the finding as text.

        (None, "") for other claims, for numbers of printed tables by "printed", and without such a source.
        """
        compared_with_itself = source == "printed" and claim.row != ""
        if not claim.models or compared_with_itself or source not in self.sources:
            return None, ""
        try:
            finding = self.finding(claim, source)
        except MissingEvidence as error:
            return None, str(error)
        comparison = compare(claim, self.claims.classes[claim.tolerance], finding)
        return comparison.agreement is not None, _in_words(claim, finding, comparison)

    def _status(
        self, claim: Claim, finding: Finding, comparison: Comparison, refuted: str | None
    ) -> tuple[str, str]:
        """Status and reason; `refuted` is the finding of the paper's own tables if it refutes the claim."""
        deviation = deviation_in_words(comparison, self.claims.classes[claim.tolerance])
        if comparison.agreement == "exact":
            statement = finding.holds is not None or claim.tolerance == "decade" or claim.sense == "at_most"
            if claim.tolerance == READ_OFF:
                return "exact", f"{deviation}, within 2 sigma of the reading"
            if finding.allowed:
                return "exact", f"in the range that the printed inputs allow{_width(claim, finding)}"
            return "exact", "true as stated" if statement else "equal at the printed digits"
        if comparison.agreement == "close":
            if claim.seed_deviation is not None and (finding.holds or claim.tolerance == "decade"):
                return "close", "true, but by less than a quarter of what other seeds change"
            return "close", f"{deviation}, inside class {claim.tolerance}{_width(claim, finding)}"
        if reason := self._explanation(claim, finding):
            return "explained", reason
        if deviation and (meant := self._as_meant(claim)) != claim:
            deviation += f" from {meant.printed}, meant by erratum {claim.erratum}"
        outside = f"{deviation}, outside class {claim.tolerance}" if deviation else "not so"
        if claim.basis == "arithmetic":
            return "contradicted", f"{outside}: the paper's own formulas and numbers say otherwise"
        if refuted is not None:
            return "contradicted", f"{outside}; the paper's own tables refute it too: {refuted}"
        return "missed", f"{outside}; no erratum and no alternative assumption explains it"

    def _as_meant(self, claim: Claim) -> Claim:
        """The claim with its printed number replaced by that of a proved erratum, if there is one."""
        erratum = self.errata[claim.erratum] if claim.erratum else None
        if erratum is None or not erratum.passes or claim.id not in erratum.values:
            return claim
        return claim.model_copy(update={"printed": erratum.values[claim.id]})

    def _explanation(self, claim: Claim, finding: Finding) -> str:
        """Erratum or alternative assumption that brings an item inside its class; empty if none does."""
        tolerance = self.claims.classes[claim.tolerance]
        erratum = self.errata[claim.erratum] if claim.erratum else None
        if erratum and erratum.passes:
            meant = self._as_meant(claim)
            explained = finding.holds is False
            if meant != claim:
                explained = compare(meant, tolerance, finding).agreement is not None
            if explained:
                return f"erratum {erratum.id}: {erratum.meant}"
        if claim.assumption and self.alternatives is not None:
            place = {"alternative": [claim.assumption], "item": [claim.id]}
            value = self.alternatives.reindex(place).item()  # NaN, which agrees with nothing, if not run
            if compare(claim, tolerance, finding._replace(value=value)).agreement:
                return f"assumption {claim.assumption}: {as_printed(value, claim, False)}"
        return ""


def _in_seeds(claim: Claim, finding: Finding) -> float | None:
    """Deviation of a number of a table or figure in standard deviations over seeds."""
    if finding.value is None or not claim.seed_deviation or not claim.row:
        return None
    return six_digits((finding.value - claim.value) / claim.seed_deviation)


def _width(claim: Claim, finding: Finding) -> str:
    """Words for the width of the interval that a number is compared with; empty if there is none."""
    if finding.low is None or finding.high is None or not claim.value:
        return ""
    return f", an interval {(finding.high - finding.low) / abs(claim.value):.2g} of the printed number wide"


def _in_words(claim: Claim, finding: Finding, comparison: Comparison) -> str:
    """The finding as text, its number written like the printed one."""
    if finding.value is None or claim.tolerance == "decade":
        return finding.shown
    text = as_printed(finding.value, claim, comparison.agreement == "exact")
    if claim.scale in (1.0, 0.01):
        text = f"{text} {UNITS_IN_TEXT.get(claim.unit, claim.unit)}".rstrip()
    return f"{text} ({finding.shown})" if finding.shown else text


def six_digits(value: float | None) -> float | None:
    """Round to six significant digits: further ones would differ between machines."""
    return None if value is None or not math.isfinite(value) else float(f"{value:.6g}")


def _reproduced(finding: Finding) -> float | list[float | None] | str | bool | None:
    """The finding as verdict.json stores it: a number, an interval, true or false, or text."""
    if finding.value is not None:
        return six_digits(finding.value)
    if finding.low is not None and finding.high is not None:
        return [six_digits(finding.low), six_digits(finding.high)]
    return finding.shown if finding.holds is None else bool(finding.holds)


def counts(items: Sequence[Item]) -> dict[str, int]:
    """Number of all items, under ``items``, and of the items with each status."""
    statuses = [item["status"] for item in items]
    return {"items": len(items)} | {status: statuses.count(status) for status in STATUSES}


def verdict(results: Path, paper: Paper) -> dict[str, Any]:
    """Judge every claim of a paper against a folder of results; return the content of ``verdict.json``."""
    judge = Judge(results, paper)
    items = [judge.judge(claim) for claim in judge.claims.items.values()]
    about = paper.about(judge.sources)
    assumptions = read_assumptions(paper.folder)
    misprints = {name: erratum.evidence for name, erratum in judge.errata.items() if erratum.passes}
    suspected = {
        name: f"suspected: {d.suspected}; {d.evidence}" for name, d in judge.doubts.items() if d.holds
    }
    facts = judged_facts(
        judge.claims.facts,
        items,
        assumptions,
        misprints,
        suspected,
        lambda names: six_digits(paper.chi_square(judge.sources, names)),
    )
    return {
        "study": about["study"],
        "headline": headline(facts, assumptions),
        "facts": facts,
        "counts": counts(items),
        "failures": about["failures"],
        "settling_failures": about["settling_failures"],
        "highlights": paper.highlights(judge.sources, items),
        "items": items,
        "classes": {name: tolerance.model_dump() for name, tolerance in judge.claims.classes.items()},
        "errata": [erratum.model_dump() for erratum in judge.errata.values()],
        "doubts": [doubt.model_dump() for doubt in judge.doubts.values()],
        "assumptions": {name: entry.model_dump() for name, entry in assumptions.items()},
        "assumptions_run": judge.alternatives is not None,  # whether the alternatives were
    }


def recorded_facts(folder: Path) -> dict[str, str]:
    """Recorded status of every fact, from ``statuses.csv``; empty if there is no such file."""
    return recorded(folder / "statuses.csv")


def recorded_text(facts: Sequence[Item]) -> str:
    """Text of ``statuses.csv`` for judged facts."""
    rows = sorted(f'{row["name"]},"{row["status"]}"' for row in facts)
    return "\n".join(["fact,status", *rows, ""])
