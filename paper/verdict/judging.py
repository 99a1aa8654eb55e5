"""The verdict: every printed number and statement of a paper, judged against the results."""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from paper.verdict.claims import UNITS_IN_TEXT, Claim, read_claims
from paper.verdict.comparison import Agreement, as_printed, compare, relative_deviation
from paper.verdict.errata import Erratum, Proof, read_errata
from paper.verdict.facts import Assumption, headline, judged_facts
from paper.verdict.sources import Computation, Finding, MissingEvidence

OF_RESULTS = ("prediction", "fitted")  # kinds of evidence of items that depend on the parameters

Item = dict[str, Any]  # one judged claim, as in verdict.json
# Sources that computations read, by name. The first decides; where there are sources "exact" (the paper's
# runs with exact signals) and "printed" (its own tables), claims about models are judged with them too.
Sources = Mapping[str, Any]


WHOLE = {"study": "paper", "failures": {}, "settling_failures": {}}  # the paper's study; no run failed


class Paper(NamedTuple):
    """A paper to be judged: its files and the functions that its files name."""

    folder: Path  # of claims, errata, assumptions, recorded statuses and published tables
    computations: Mapping[str, Computation]  # by the name that ``claims.yaml`` gives under ``compute``
    proofs: Mapping[str, Proof]  # by the name that ``errata.yaml`` gives under ``proof``
    sources: Callable[[Path, Path], Sources]  # from a folder of results and the paper's folder
    # What the paper's ``findings.html.j2`` shows, from the sources and the judged items.
    highlights: Callable[[Sources, Sequence[Item]], dict[str, Any]] = lambda _sources, _items: {}
    about: Callable[[Sources], dict[str, Any]] = lambda _: WHOLE  # name of the study, and runs that failed
    # Why numbers of the results are not the paper's, such as changed parameters; empty if they are.
    changed: Callable[[Sources], str] = lambda _: ""
    # Chi-square of some items, over the spread of seeds and of printing; None if it is not known.
    chi_square: Callable[[Sources, Sequence[str]], float | None] = lambda _sources, _items: None


class Judge:
    """Claims, errata and results (a folder) of a paper, to judge one claim at a time."""

    def __init__(self, results: Path, paper: Paper) -> None:
        self.paper = paper
        self.claims = read_claims(paper.folder)
        self.sources = paper.sources(results, paper.folder)
        self.errata = read_errata(paper.folder, paper.proofs, next(iter(self.sources.values())))
        self.changed = paper.changed(self.sources)

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
        tolerance, meant = self.claims.classes[claim.tolerance], self._as_meant(claim)
        suspected = [name for name, e in self.errata.items() if claim.id.startswith(tuple(e.items))]
        holds_exact, shown_exact = self._holds(claim, "exact")
        holds_printed, shown_printed = self._holds(claim, "printed")
        try:
            finding = self.finding(claim, next(iter(self.sources)))
        except MissingEvidence as error:
            finding, agreement = Finding(), None
            status, reason = "not judged", str(error)
        else:
            agreement = compare(claim, tolerance, finding)
            refuted = shown_printed if holds_printed is False else None
            status, reason = self._status(claim, finding, agreement, refuted)
            if self.changed and claim.basis in OF_RESULTS:
                status, reason = "not judged", self.changed
        return {
            **claim.model_dump(include={"id", "where", "statement", "printed"}),
            "meant": meant.printed,
            "reproduced": _reproduced(finding),
            "shown": _in_words(claim, finding, agreement),
            "relative": six_digits(relative_deviation(meant, tolerance, finding)),
            "tolerance": {"class": claim.tolerance, "sense": claim.sense}
            | tolerance.model_dump(include={"limit", "measure", "seeds"}),
            **claim.model_dump(include={"unit", "scale", "fact", "basis"}),
            "seeds": _in_seeds(meant, finding),
            "status": status,
            "stands_exact": holds_exact,
            "shown_exact": shown_exact,
            "stands_printed": holds_printed,
            "shown_printed": shown_printed,
            "reason": reason,
            "errata": list(filter(None, (claim.erratum or claim.see, *suspected))),
            "evidence": {**claim.evidence, "compute": claim.compute},
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
        agreement = compare(claim, self.claims.classes[claim.tolerance], finding)
        return agreement is not None, _in_words(claim, finding, agreement)

    def _status(
        self, claim: Claim, finding: Finding, agreement: Agreement, refuted: str | None
    ) -> tuple[str, str]:
        """Status, and the reason of an item that differs.

        `refuted` is the finding of the paper's own tables if it refutes the claim.
        """
        if agreement is not None:
            return agreement, ""
        erratum = self._proved(claim)
        if erratum is not None:
            meant = self._as_meant(claim)
            agrees = finding.holds is False
            if meant != claim:
                agrees = compare(meant, self.claims.classes[claim.tolerance], finding) is not None
            if agrees:
                return "explained", f"erratum {erratum.id}: {erratum.meant}"
        if claim.basis == "arithmetic":
            return "contradicted", "the paper's own formulas and numbers say otherwise"
        if refuted is not None:
            return "contradicted", f"the paper's own tables refute it too: {refuted}"
        return "missed", ""

    def _as_meant(self, claim: Claim) -> Claim:
        """The claim with its printed number replaced by that of a proved erratum, if there is one."""
        erratum = self._proved(claim)
        if erratum is None or claim.id not in erratum.values:
            return claim
        return claim.model_copy(update={"printed": erratum.values[claim.id]})

    def _proved(self, claim: Claim) -> Erratum | None:
        erratum = self.errata[claim.erratum] if claim.erratum else None
        return erratum if erratum and erratum.passes else None


def _in_seeds(claim: Claim, finding: Finding) -> float | None:
    """Deviation of a number of a table or figure in standard deviations over seeds."""
    if finding.value is None or not claim.seed_deviation or not claim.row:
        return None
    return six_digits((finding.value - claim.value) / claim.seed_deviation)


def _in_words(claim: Claim, finding: Finding, agreement: Agreement) -> str:
    """The finding as text, its number written like the printed one."""
    if finding.value is None or claim.tolerance == "decade":
        return finding.shown
    text = as_printed(finding.value, claim, agreement == "exact")
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


def verdict(results: Path, paper: Paper) -> dict[str, Any]:
    """Judge every claim of a paper against a folder of results; return the content of ``verdict.json``."""
    judge = Judge(results, paper)
    items = [judge.judge(claim) for claim in judge.claims.items.values()]
    assumptions = Assumption.read_all(paper.folder, "assumptions.yaml")
    facts = judged_facts(
        judge.claims.facts,
        items,
        assumptions,
        judge.errata,
        lambda names: six_digits(paper.chi_square(judge.sources, names)),
    )
    return {
        **paper.about(judge.sources),
        "headline": headline(facts, assumptions),
        "facts": facts,
        "highlights": paper.highlights(judge.sources, items),
        "items": items,
        "errata": [erratum.model_dump() for erratum in judge.errata.values()],
        "assumptions": {name: entry.model_dump() for name, entry in assumptions.items()},
    }
