"""The paper's statements about models, judged again over many sets of seeds and with both transports.

Each statement is judged by the verdict's computation and tolerance class, on other results. The share of seed
sets in which it must hold was fixed in ``paper/decisions/0031-findings.md`` before there were results.
"""

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy import stats

from pneumo.configuration.experiment import Study
from pneumo.evidence.ensemble import complete_sets
from pneumo.papers.paper_2006.computations import COMPUTATIONS
from pneumo.simulation.signals import EXACT, PUBLISHED
from pneumo.statistics.averages import concatenated, statistics
from pneumo.statistics.intervals import CONFIDENCE
from pneumo.verdict.claims import UNITS_IN_TEXT, Claim, Claims, ToleranceClass
from pneumo.verdict.comparison import as_printed, compare
from pneumo.verdict.sources import MissingEvidence, PrintedTables, StudyResults

STANDING_SHARE = 0.95  # of the seed sets, for "yes"; one less this, for "no"


class SeedSet(StudyResults):
    """One seed set of the ensemble, replayed with one transport, in place of results."""

    def __init__(self, study: Study, cells: xr.Dataset, transport: str) -> None:
        super().__init__(Path(), transport)
        self.study = study
        self.statistics = statistics(cells, study.experiments_by_level)
        self.cells = concatenated(cells)


class StatementOverSets(NamedTuple):
    """A statement over the seed sets, with one transport; no `value` where it is only true or false."""

    #: Mean of what is measured, in the claim's unit (a quotient of mean square errors in place of decades).
    value: float | None
    low: float | None  #: 95 per cent interval of that mean, by Student
    high: float | None
    holds: int  #: seed sets in which the statement holds
    sets: int  #: seed sets that there are
    share_low: float  #: exact (Clopper-Pearson) 95 per cent interval of the share of them in which it holds
    share_high: float

    @property
    def stands(self) -> bool | None:
        """Whether it holds in at least 95 of 100 seed sets; None where it depends on them."""
        share = self.holds / self.sets
        return True if share >= STANDING_SHARE else False if share <= 1 - STANDING_SHARE else None


def over_seed_sets(claim: Claim, claims: Claims, sources: Iterable[StudyResults]) -> StatementOverSets:
    """Judge one statement on several sources, one for each seed set."""
    values: list[float] = []
    holds: list[bool] = []
    for source in sources:
        finding = COMPUTATIONS[claim.compute](source, **claim.arguments)
        values.append(math.nan if finding.holds is not None or finding.value is None else finding.value)
        holds.append(compare(claim, claims.classes[claim.tolerance], finding).agreement is not None)
    count, total = sum(holds), len(holds)
    share = stats.binomtest(count, total).proportion_ci(CONFIDENCE)
    middle = low = high = None
    if np.isfinite(values).all():
        middle = float(np.mean(values))
        student = float(stats.t.ppf((1 + CONFIDENCE) / 2, total - 1))
        half = student * float(np.std(values, ddof=1)) / math.sqrt(total)
        low, high = middle - half, middle + half
        if claim.tolerance == "decade":
            middle, low, high = 10**middle, 10**low, 10**high
    return StatementOverSets(middle, low, high, count, total, share.low, share.high)


def number_with_unit(value: float, claim: Claim) -> str:
    """Number of a statement with its unit; below 10 with one digit more than printed."""
    if claim.tolerance == "decade":
        return f"{value:.2f}"
    text = as_printed(value, claim, exact=True)
    scaled = value / claim.scale
    if abs(scaled) < 10:
        text = f"{scaled:.{len(text.partition('.')[2]) + 1}f}"
    return f"{text} {UNITS_IN_TEXT.get(claim.unit, claim.unit)}".rstrip()


def claim_in_words(claim: Claim, classes: Mapping[str, ToleranceClass]) -> str:
    """Statement with its printed number, or with the limit that the verdict takes its words to mean."""
    if claim.tolerance == "decade":
        sense = "at most" if claim.sense == "at_most" else "at least"
        return f"{claim.statement} (quotient of MSE {sense} {10 ** classes['decade'].limit:.2f})"
    printed = f"{claim.printed} {UNITS_IN_TEXT.get(claim.unit, claim.unit)}".rstrip()
    if claim.statement.endswith(("about", "at most")):
        return f"{claim.statement} {printed}"
    numeric = claim.kind not in ("ranking", "qualitative")
    model = "claimed" in claim.arguments and claim.printed not in claim.statement
    return f"{claim.statement}: {printed}" if numeric or model else claim.statement


def _cell(judged: StatementOverSets, claim: Claim) -> str:
    share = f"{judged.holds} of {judged.sets}"
    return share if judged.value is None else f"{number_with_unit(judged.value, claim)}; {share}"


def _interval(judged: StatementOverSets, claim: Claim) -> str:
    if judged.low is None or judged.high is None:
        return f"{100 * judged.share_low:.0f} to {100 * judged.share_high:.0f} % of seed sets"
    low, high = number_with_unit(judged.low, claim), number_with_unit(judged.high, claim)
    return f"{low.split(' ')[0]} to {high}"


def _answer(published: StatementOverSets, exact: StatementOverSets) -> tuple[str, str]:
    """Whether a statement stands, and what the published transport has to do with it."""
    if exact.stands is None:
        return "in part", "depends on the seeds"
    if published.stands is exact.stands:
        return ("yes", "") if exact.stands else ("no", "with neither transport")
    if published.stands is None:
        return "yes" if exact.stands else "no", "with the published transport it depends on the seeds"
    if exact.stands:
        return "yes", "hidden by the published transport"
    return "no", "made by the published transport"


def findings(study: Study, ensemble: xr.Dataset, claims: Claims, results: Path) -> dict[str, Any]:
    """Judge every statement about models over the seed sets, with both transports.

    `ensemble` is what `ensemble_statistics` takes; `results` is the folder of the paper's own tables.

    Returns
    -------
    dict
        ``claims``, a list with the texts of a table's row (``claim``, ``source``, ``published``, ``exact``,
        ``interval``, ``stands``, ``why``), its ``id``, whether it is a ``headline``, whether the paper's own
        tables support it (``printed_stands``), and the ``numbers`` of both transports; ``seed_sets`` that
        are complete, of those ``drawn``; ``note``; ``config_sha256``.
    """
    whole = complete_sets(ensemble, study.experiments_by_level)
    drawn, sets = len(whole), ensemble["seeds"].values[whole.values]
    sources = {
        transport: [
            SeedSet(study, ensemble.sel(seeds=seeds, transport=transport).drop_attrs(), transport)
            for seeds in sets
        ]
        for transport in (PUBLISHED, EXACT)
    }
    rows: list[dict[str, Any]] = []
    for claim in claims.items.values():
        if not claim.models or claim.table is not None:
            continue
        row: dict[str, Any] = {
            "id": claim.id,
            "headline": claim.headline,
            "claim": claim_in_words(claim, claims.classes),
            "source": claim.where,
            **dict.fromkeys(("published", "exact", "interval"), ""),
            "stands": "not run",
            "why": "",
            "printed_stands": _printed_stands(claim, claims, results),
            "numbers": {},
        }
        try:
            judged = {name: over_seed_sets(claim, claims, of) for name, of in sources.items()}
        except MissingEvidence as error:
            row["why"] = str(error)
        else:
            row |= {name: _cell(statement, claim) for name, statement in judged.items()}
            row["interval"] = _interval(judged[EXACT], claim)
            row["stands"], row["why"] = _answer(judged[PUBLISHED], judged[EXACT])
            row["numbers"] = {name: statement._asdict() for name, statement in judged.items()}
        rows.append(row)
    note = f"{len(sets)} sets of seeds, the whole study with each. "
    if drawn > len(sets):
        note += (
            f"{drawn - len(sets)} more are left out: in them a full-order run, or every replay of a model,"
            " left the positive pressures at the study's step. "
        )
    note += (
        "A cell has the mean over them and in how many the statement holds; the interval is that of the mean"
        " (Student) or of the share (Clopper-Pearson), exact transport. It stands if it holds in at least"
        f" {100 * STANDING_SHARE:.0f} % of them with exact transport,"
        f" not if in at most {100 * (1 - STANDING_SHARE):.0f} %."
    )
    counts = {"seed_sets": len(sets), "drawn": drawn}
    return counts | {"note": note, "claims": rows, "config_sha256": study.config_sha256}


def _printed_stands(claim: Claim, claims: Claims, results: Path) -> bool | None:
    """Whether the paper's own tables support a statement; None where they print nothing about it."""
    try:
        finding = COMPUTATIONS[claim.compute](PrintedTables(results), **claim.arguments)
    except MissingEvidence:
        return None
    return compare(claim, claims.classes[claim.tolerance], finding).agreement is not None
