"""The verdict: every printed number and statement of a paper, judged against the results."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from paper_verdict.about import About
from paper_verdict.claims import UNITS_IN_TEXT, Claim, ToleranceClass, read_claims
from paper_verdict.comparison import (
    Agreement,
    as_printed,
    check_kind,
    compare,
    deviation_in_seeds,
    relative_deviation,
)
from paper_verdict.curves import drawn_curves
from paper_verdict.errata import Erratum, Proof, check_errata, read_errata
from paper_verdict.errors import PaperError, nearest
from paper_verdict.facts import (
    AGREES,
    MISPRINT,
    NOT_JUDGED,
    UNEXPLAINED,
    Assumption,
    Item,
    headline,
    judged_facts,
)
from paper_verdict.findings import Computation, Finding, MissingEvidence, as_finding
from paper_verdict.places import overview
from paper_verdict.values import Values, deviation

OF_RESULTS = ("prediction", "fitted")  # kinds of evidence of items that depend on the parameters
FEWEST_REPEATS = 2  # for a deviation over seeds

# Sources that computations read, by name. The first decides; claims may name others under `also`.
Sources = Mapping[str, Any]

WHOLE = {"study": "", "failures": {}}  # the paper's own study; no run failed


class Paper(NamedTuple):
    """A paper to be judged: its files and the functions that its files name."""

    folder: Path  # of claims, errata, assumptions, recorded statuses and published tables
    computations: Mapping[str, Computation] = {}  # by the name that ``claims.yaml`` gives under ``compute``
    proofs: Mapping[str, Proof] = {}  # by the name that ``errata.yaml`` gives under ``proof``
    # From a folder of results and the paper's folder.
    sources: Callable[[Path, Path], Sources] = lambda results, _folder: {"results": results}
    # What the paper's own part of the page shows, from the sources and the judged items.
    highlights: Callable[[Sources, Sequence[Item]], dict[str, Any]] = lambda _sources, _items: {}
    about: Callable[[Sources], dict[str, Any]] = lambda _: WHOLE  # name of the study, and runs that failed
    # Why numbers of the results are not the paper's, such as changed parameters; empty if they are.
    changed: Callable[[Sources], str] = lambda _: ""
    # Chi-square of some items, over the spread of seeds and of printing; None if it is not known.
    chi_square: Callable[[Sources, Sequence[str]], float | None] = lambda _sources, _items: None


class Judge:
    """Claims, errata and results (a folder) of a paper, to judge one claim at a time.

    `PaperError` if a file of the paper is wrong, or names what is not there.
    """

    def __init__(self, paper: Paper, results: Path | None = None) -> None:
        self.paper = paper
        self.about = About.of(paper.folder)
        self.results = results or paper.folder / self.about.results
        self.claims = read_claims(paper.folder)
        self.assumptions = Assumption.read_all(paper.folder / "assumptions.yaml")
        self._check_names()
        self.sources = paper.sources(self.results, paper.folder)
        self.errata = read_errata(paper.folder, paper.proofs, next(iter(self.sources.values())))
        self._check_errata()
        self.changed = paper.changed(self.sources)
        self.values = Values(self.results)

    def _check_names(self) -> None:
        """Refuse names of computations that are not there, and values without a file."""
        for claim in self.claims.items.values():
            if claim.compute and claim.compute not in self.paper.computations:
                near = nearest(claim.compute, self.paper.computations)
                where = "no such function in computations.py"
                raise PaperError(f"{claim.source}: {claim.id}: compute = {claim.compute!r}: {where}{near}")

    def _check_errata(self) -> None:
        """Refuse errata of unknown items, and claims and facts that name unknown errata."""
        printed = {name: claim.printed for name, claim in self.claims.items.items()}
        check_errata(self.errata, printed, self.paper.folder / "errata.yaml")
        named = [(c.source, c.id, name) for c in self.claims.items.values() for name in (c.erratum, c.see)]
        file = str(self.paper.folder / "facts.yaml")
        named += [(file, name, fact.erratum) for name, fact in self.claims.facts.items()]
        for place, owner, erratum in named:
            if erratum is not None and erratum not in self.errata:
                near = nearest(erratum, self.errata)
                raise PaperError(f"{place}: {owner}: erratum = {erratum!r}: not in errata.yaml{near}")
        claimed = {claim.erratum for claim in self.claims.items.values()}
        claimed |= {fact.erratum for fact in self.claims.facts.values()}
        for name, erratum in self.errata.items():
            for item in erratum.values:
                own = self.claims.items[item].erratum
                if own != name and self.claims.facts[self.claims.items[item].fact].erratum != name:
                    raise PaperError(
                        f"{self.paper.folder / 'errata.yaml'}: {name}.values: {item}: does not name this"
                        f" erratum; add erratum: {name} to its fact or claim, or to errata of its table"
                    )

    def finding(self, claim: Claim, source: str) -> Finding:
        """Finding of a claim by a source; `MissingEvidence` if a result that it needs is missing."""
        if not claim.compute:
            return self.number(claim, self.values)
        finding = self.computed(claim, self.sources[source])
        if not finding.is_finite:
            raise MissingEvidence("a run that it needs failed")
        return finding

    def number(self, claim: Claim, values: Values) -> Finding:
        """Finding of a claim whose number is read from a file."""
        cell = self.cell(claim, values)
        value = values.number(cell, claim.unit, claim.source)
        if not math.isfinite(value):
            raise MissingEvidence(f"{cell.file}: {cell}: is not a finite number")
        return Finding(value)

    def cell(self, claim: Claim, values: Values | None = None) -> Any:
        """Where the reproduced number of a claim is that has no computation."""
        if claim.values:
            return claim.values
        file = f"{claim.place.replace('Table ', 'table').replace('Fig. ', 'figure')}.csv"
        cell = (values or self.values).in_table(file, claim.row, claim.column, claim.keys)
        return cell.model_copy(update={"factor": claim.scale})  # laid out as printed: in the print's scale

    def computed(self, claim: Claim, source: Any) -> Finding:
        """Finding of a claim's computation by a source."""
        place = f"{claim.source}: {claim.id}: {claim.compute}"
        try:
            result = self.paper.computations[claim.compute](source, **claim.arguments)
        except MissingEvidence:
            raise
        except Exception as error:
            error.add_note(place)
            raise
        finding = as_finding(result, place)
        check_kind(claim, self.claims.classes[claim.tolerance], finding, place)
        return finding

    @cached_property
    def repeated(self) -> "list[_OfSeed]":
        """The results of other seeds."""
        pattern = self.claims.repeats
        folders = sorted(each for each in self.results.glob(pattern) if each.is_dir()) if pattern else []
        if pattern and len(folders) < FEWEST_REPEATS:
            raise PaperError(
                f"{self.claims.file}: repeats = {pattern!r}: {len(folders)} folders of {self.results}"
                f" match; a deviation over seeds needs {FEWEST_REPEATS}"
            )
        return [_OfSeed(self, folder) for folder in folders]

    def _with_deviation(self, claim: Claim) -> Claim:
        """The claim with its deviation over the repeated results, if it has none and there are such."""
        tolerance = self.claims.classes[claim.tolerance]
        if (
            claim.seed_deviation is not None
            or not self.claims.repeats
            or tolerance.measure in ("truth", "log10")
        ):
            return claim
        numbers = [of_seed.number(claim) for of_seed in self.repeated]
        return claim.model_copy(update={"seed_deviation": deviation(numbers)})

    def judge(self, claim: Claim) -> Item:
        """Judge one claim alone; the item's status is settled with those of its fact."""
        claim = self._with_deviation(claim)
        tolerance = self.claims.classes[claim.tolerance]
        meant = self._as_meant(claim)
        suspected = [name for name, e in self.errata.items() if claim.id.startswith(tuple(e.items))]
        agreement: Agreement = None
        try:
            finding = self.finding(claim, next(iter(self.sources)))
        except MissingEvidence as error:
            finding = Finding()
            status, reason = NOT_JUDGED, str(error)
        else:
            agreement = compare(claim, tolerance, finding)
            status, reason = self._status(claim, tolerance, finding, agreement)
            if self.changed and claim.basis in OF_RESULTS:
                status, reason = NOT_JUDGED, self.changed
        return {
            **claim.model_dump(include={"id", "where", "statement", "printed"}),
            "meant": meant.printed,
            "reproduced": _reproduced(finding),
            "shown": _in_words(claim, tolerance, finding, agreement),
            "relative": six_digits(relative_deviation(meant, tolerance, finding)),
            "tolerance": {"class": claim.tolerance, "sense": claim.sense}
            | tolerance.model_dump(include={"limit", "measure", "seeds", "floor"}),
            **claim.model_dump(include={"unit", "scale", "fact", "basis"}),
            "seeds": six_digits(deviation_in_seeds(meant, tolerance, finding)),
            "status": status,
            "agreement": agreement,
            "reason": reason,
            "also": {source: self._by(claim, tolerance, source) for source in claim.also},
            "errata": list(filter(None, (claim.erratum or claim.see, *suspected))),
            "evidence": self._evidence(claim),
            **claim.model_dump(include={"place", "row", "column", "keys"}),
            "source": self._inside(claim.source),
        }

    def _inside(self, source: str) -> str:
        """A file and line relative to the paper's folder: the same wherever that is."""
        file, _, line = source.rpartition(":")
        return f"{Path(file).relative_to(self.paper.folder).as_posix()}:{line}"

    def _by(self, claim: Claim, tolerance: ToleranceClass, source: str) -> dict[str, Any] | None:
        """Whether a claim holds by a further source, and the finding as text; None without the source."""
        if source not in self.sources:
            return None
        try:
            finding = self.finding(claim, source)
        except MissingEvidence as error:
            return {"holds": None, "shown": str(error)}
        agreement = compare(claim, tolerance, finding)
        shown = _in_words(claim, tolerance, finding, agreement)
        return {"holds": agreement is not None, "shown": shown}

    def _evidence(self, claim: Claim) -> dict[str, str]:
        """File, place in it, and computation of the reproduced number."""
        if claim.compute:
            return {"path": "", "select": "", **claim.evidence, "compute": claim.compute}
        try:
            cell = self.cell(claim)
        except PaperError:
            return {"path": "", "select": "", "compute": ""}
        return {"path": f"{self.results.name}/{cell.file}", "select": str(cell), "compute": ""}

    def _status(
        self, claim: Claim, tolerance: ToleranceClass, finding: Finding, agreement: Agreement
    ) -> tuple[str, str]:
        """Status, and the reason of an item that differs. Only a proof can say that the paper is wrong."""
        if agreement is not None:
            return AGREES, ""
        erratum = self._proved(claim)
        if erratum is None:
            return UNEXPLAINED, ""
        meant = self._as_meant(claim)
        # Without a meant number the proof says that the print is wrong, not what is right.
        if meant == claim or compare(meant, tolerance, finding) is not None:
            return MISPRINT, f"erratum {erratum.id}: {erratum.meant}"
        return UNEXPLAINED, f"erratum {erratum.id} is proved, but what it means is not reproduced either"

    def _as_meant(self, claim: Claim) -> Claim:
        """The claim with its printed number replaced by that of a proved erratum, if there is one."""
        erratum = self._proved(claim)
        if erratum is None or claim.id not in erratum.values:
            return claim
        return claim.model_copy(update={"printed": erratum.values[claim.id]})

    def _proved(self, claim: Claim) -> Erratum | None:
        """The proved erratum of a claim, or of its fact if that gives a meant number for the claim."""
        of_fact = self.errata.get(self.claims.facts[claim.fact].erratum or "")
        erratum = self.errata[claim.erratum] if claim.erratum else None
        if erratum is None and of_fact is not None and claim.id in of_fact.values:
            erratum = of_fact
        return erratum if erratum and erratum.passes and erratum.is_proof else None

    def facts(self, items: Sequence[Item], names: Sequence[str] | None = None) -> list[dict[str, Any]]:
        """Rows of the facts of judged items, worst first; settles the items' statuses."""
        facts = self.claims.facts
        return judged_facts(
            facts if names is None else {name: facts[name] for name in names},
            items,
            self.assumptions,
            self.errata,
            lambda ids: six_digits(self.paper.chi_square(self.sources, ids)),
        )

    def explain(self, name: str) -> Item:
        """Judge one item with those of its fact; `PaperError` if there is no such item."""
        if name not in self.claims.items:
            raise PaperError(f"{name}: no such item{nearest(name, self.claims.items)}")
        fact = self.claims.items[name].fact
        items = [self.judge(claim) for claim in self.claims.items.values() if claim.fact == fact]
        self.facts(items, [fact])
        return next(item for item in items if item["id"] == name)

    def verdict(self) -> dict[str, Any]:
        """Judge every claim; return the content of ``verdict.json``."""
        items = [self.judge(claim) for claim in self.claims.items.values()]
        facts = self.facts(items)
        drawn = [f"Fig. {curves.figure}" for curves in self.claims.curves]
        return {
            **self.paper.about(self.sources),
            "paper": self.about.model_dump(exclude={"places", "results"}),
            "headline": headline(facts, self.assumptions),
            "places": overview(items, self.claims.facts, self.assumptions, self.about, drawn),
            "facts": facts,
            "highlights": self.paper.highlights(self.sources, items),
            "items": items,
            "curves": list(drawn_curves(self.claims.curves, self.paper.folder, self.values)),
            "errata": [erratum.model_dump() for erratum in self.errata.values()],
            "assumptions": {name: entry.model_dump() for name, entry in self.assumptions.items()},
        }


class _OfSeed(NamedTuple):
    """The results of other seeds, as a judge's claims read them."""

    judge: Judge
    folder: Path

    def number(self, claim: Claim) -> float:
        """The reproduced number of a claim with these seeds; NaN if it is missing."""
        try:
            if claim.compute:
                source = next(iter(self.judge.paper.sources(self.folder, self.judge.paper.folder).values()))
                finding = self.judge.computed(claim, source)
            else:
                finding = self.judge.number(claim, Values(self.folder))
        except MissingEvidence:
            return math.nan
        return finding.nearest(claim.value)


def _in_words(claim: Claim, tolerance: ToleranceClass, finding: Finding, agreement: Agreement) -> str:
    """The finding as text, its number written like the printed one."""
    if finding.value is None or tolerance.measure == "log10":
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


def verdict(paper: Paper, results: Path | None = None) -> dict[str, Any]:
    """Judge every claim of a paper against a folder of results; return the content of ``verdict.json``."""
    return Judge(paper, results).verdict()
