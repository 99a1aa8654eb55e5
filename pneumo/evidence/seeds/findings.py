"""The paper's statements about models, judged over many sets of seeds, with published and exact signals.

Each statement is judged by the verdict's computation and tolerance class. It is confirmed or refuted by a
95 per cent interval over the seed sets: ``paper/decisions/0039-tolerances-from-seeds.md``.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Study
from pneumo.papers.paper_2006.computations import finding_for
from pneumo.papers.paper_2006.results import ComputedResults, PrintedTables, StudyResults
from pneumo.simulation.signals import EXACT, PUBLISHED, STUDY_SAMPLINGS
from pneumo.statistics.intervals import fraction_interval, student_interval
from pneumo.verdict.claims import UNITS_IN_TEXT, Claim, Claims, ToleranceClass
from pneumo.verdict.comparison import as_printed, compare, where_true
from pneumo.verdict.sources import MissingEvidence


def over_seeds(study: Study, ensemble: xr.Dataset) -> dict[str, list[StudyResults]]:
    """Results of every seed set, by signal sampling, from the ensemble that `ensemble_statistics` takes."""
    return {
        transport: [
            ComputedResults(study, transport, ensemble.sel(seeds=seeds, transport=transport).drop_attrs())
            for seeds in ensemble["seeds"].values
        ]
        for transport in STUDY_SAMPLINGS
    }


DEPENDS = "depends"  # answer to a statement that another limit or one experiment turns


class StatementOverSets(NamedTuple):
    """A statement over all seed sets; no `value` where it is only true or false."""

    #: Mean over the sets of the statement's number, in the claim's unit, or of its margin; quotients of mean
    #: square errors in place of decades.
    value: float | None
    low: float | None  #: 95 per cent interval of that mean, by Student
    high: float | None
    holds: int  #: seed sets in which the statement holds
    sets: int  #: all seed sets
    share_low: float  #: exact (Clopper-Pearson) 95 per cent interval of the fraction holds / sets
    share_high: float
    #: Whether the whole interval lies where the statement is true; None if in part. Without a number it is
    #: the interval of the fraction, and true is above one half.
    stands: bool | None


def holds_in(source: StudyResults, claim: Claim, claims: Claims) -> tuple[bool, float]:
    """Whether a statement holds in some results, and its number or margin; NaN if it has neither."""
    finding = finding_for(claim, source)
    value = finding.margin if finding.holds is not None else finding.value
    agreement = compare(claim, claims.classes[claim.tolerance], finding).agreement
    return agreement is not None, math.nan if value is None else value


def _stands(interval: tuple[float, float], true: tuple[float, float]) -> bool | None:
    """Whether a statement is true on the whole interval; None if it is true on a part of it."""
    if true[0] <= interval[0] and interval[1] <= true[1]:
        return True
    return False if interval[1] < true[0] or interval[0] > true[1] else None


def over_seed_sets(claim: Claim, claims: Claims, sources: Iterable[StudyResults]) -> StatementOverSets:
    """Judge one statement on the results of each seed set."""
    holds, values = zip(*(holds_in(source, claim, claims) for source in sources), strict=True)
    count, total = sum(holds), len(holds)
    share = fraction_interval(count, total)
    counted = count, total, share.low, share.high
    if not np.isfinite(values).all():
        return StatementOverSets(None, None, None, *counted, _stands((share.low, share.high), (0.5, 1.0)))
    tolerance = claims.classes[claim.tolerance]
    interval = student_interval(np.array(values))
    stands = _stands((interval.low, interval.high), where_true(claim, tolerance))
    decades = tolerance.measure in ("log10", "truth")
    value, low, high = (10**end for end in interval) if decades else interval
    return StatementOverSets(value, low, high, *counted, stands)


def number_with_unit(value: float, claim: Claim) -> str:
    """Number of a statement with its unit; below 10 with one digit more than printed."""
    if claim.tolerance in ("decade", "statement"):
        return f"{value:.2f}"
    text = as_printed(value, claim, exact=True)
    scaled = value / claim.scale
    if abs(scaled) < 10:
        text = f"{scaled:.{len(text.partition('.')[2]) + 1}f}"
    return f"{text} {UNITS_IN_TEXT.get(claim.unit, claim.unit)}".rstrip()


def claim_in_words(claim: Claim, classes: Mapping[str, ToleranceClass]) -> str:
    """Statement with its printed number, or with the limit that the verdict gives to its words."""
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
    count = f"{judged.holds} of {judged.sets}"
    return count if judged.value is None else f"{number_with_unit(judged.value, claim)}; {count}"


def _interval(judged: StatementOverSets, claim: Claim) -> str:
    if judged.low is None or judged.high is None:
        return f"{100 * judged.share_low:.0f} to {100 * judged.share_high:.0f} % of seed sets"
    low, high = number_with_unit(judged.low, claim), number_with_unit(judged.high, claim)
    return f"{low.split(' ')[0]} to {high}"


def _answer(published: StatementOverSets, exact: StatementOverSets) -> tuple[str, str]:
    """Whether a statement is true with exact signals, and how the published signals change that."""
    if exact.stands is None:
        return "in part", "depends on the seeds"
    if published.stands is exact.stands:
        return ("yes", "") if exact.stands else ("no", "with either signal sampling")
    if published.stands is None:
        return "yes" if exact.stands else "no", "with signals as in the paper it depends on the seeds"
    if exact.stands:
        return "yes", "hidden by signals as in the paper"
    return "no", "true only with signals as in the paper"


def findings(
    study: Study,
    sources: Mapping[str, Sequence[StudyResults]],
    claims: Claims,
    results: Path,
    turned: Mapping[str, Sequence[str]] | None = None,
) -> dict[str, Any]:
    """Judge every statement about models over the seed sets, with published and exact signals.

    `sources` is from `over_seeds`; `results` is the folder with ``parameters.json``; `turned` lists, by
    statement, the changes that turn its answer, which is then "depends". Returns ``claims``, a list with the
    texts of a table's row (``claim``, ``source``, ``published``, ``exact``, ``interval``, ``stands``,
    ``why``), the item's ``id``, whether it is a ``headline``, whether the paper's own tables support it
    (``printed_stands``), and the ``numbers`` of both signal samplings; the number of ``seed_sets``; ``note``;
    ``config_sha256``.
    """
    printed = PrintedTables(results)
    rows: list[dict[str, Any]] = []
    for claim in claims.items.values():
        if not claim.about_models:
            continue
        text = claim_in_words(claim, claims.classes)
        row: dict[str, Any] = {"id": claim.id, "headline": claim.headline, "claim": text}
        row |= {"source": claim.where, "published": "", "exact": "", "interval": "", "stands": "not run"}
        row |= {"why": "", "printed_stands": _printed_stands(claim, claims, printed), "numbers": {}}
        rows.append(row)
        try:
            judged = {name: over_seed_sets(claim, claims, sets) for name, sets in sources.items()}
        except MissingEvidence as error:
            row["why"] = str(error)
            continue
        row |= {name: _cell(statement, claim) for name, statement in judged.items()}
        row["interval"] = _interval(judged[EXACT], claim)
        row["stands"], row["why"] = _answer(judged[PUBLISHED], judged[EXACT])
        if (turned or {}).get(claim.id):
            row["why"] = f"{row['stands']}, but not with {', '.join((turned or {})[claim.id])}"
            row["stands"] = DEPENDS
        row["numbers"] = {name: statement._asdict() for name, statement in judged.items()}
    sets = len(sources[EXACT])
    note = f"{sets} sets of seeds, the whole study with each. "
    note += (
        "A cell has the mean of the statement's number over the sets, and in how many sets the statement"
        " holds; for a ranking, the number is the factor by which the next model's mean square error is"
        " larger. The interval is that of the mean (Student), with exact signals; where there is no number,"
        " that of the fraction of sets (Clopper-Pearson). A statement is true (yes) if the whole interval"
        " lies where it is true, for a fraction above one half; false (no) if none of it does. It depends if"
        " the answer is another with one experiment left out, or with another limit for words such as"
        " 'cannot be distinguished'."
    )
    return {"seed_sets": sets, "note": note, "claims": rows, "config_sha256": study.config_sha256}


def _printed_stands(claim: Claim, claims: Claims, printed: PrintedTables) -> bool | None:
    """Whether the paper's own tables support a statement; None where they print nothing about it."""
    try:
        return holds_in(printed, claim, claims)[0]
    except MissingEvidence:
        return None
