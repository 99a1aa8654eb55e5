"""Facts of a paper: ``facts.yaml`` groups the items; the status of a fact is the worst of its items.

Assumptions are what was taken where the paper leaves something open: ``assumptions.yaml``.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Literal

from paper_verdict.chi_square import exceeded_probability
from paper_verdict.errata import Erratum
from paper_verdict.errors import PaperError, nearest
from paper_verdict.files import Entry

STATUSES = {  # best first -> in words, of one fact and of several
    "agrees": ("agrees", "agree"),
    "agrees within the seeds' scatter": (
        "agrees within the seeds' scatter",
        "agree within the seeds' scatter",
    ),
    "misprint": ("is a misprint", "are misprints"),
    "differs, explained": ("differs, explained", "differ, explained"),
    "differs, unexplained": ("differs, unexplained", "differ, unexplained"),
    "not judged": ("is not judged", "are not judged"),
}
AGREES, SCATTER, MISPRINT, EXPLAINED, UNEXPLAINED, NOT_JUDGED = STATUSES
WORST_FIRST = (UNEXPLAINED, EXPLAINED, MISPRINT, SCATTER, AGREES, NOT_JUDGED)
BASES = {  # kind of evidence -> what it is
    "prediction": "no constant and no rule was chosen with it in view",
    "fitted": "constants or a setup that the paper leaves open were chosen with it in view",
    "arithmetic": "follows from the paper's own numbers and formulas",
    "set-up": "an input, a count or an identity: it cannot fail",
}
SET_UP = "set-up"
SIGNIFICANT = 0.05  # a chi-square that is exceeded less often is no scatter
WITHIN = 2.0  # standard deviations over seeds, where there is no chi-square

ChiSquare = Callable[[Sequence[str]], float | None]
Item = dict[str, Any]


class Fact(Entry):
    """One entry of ``facts.yaml``."""

    says: str
    basis: Literal["prediction", "fitted", "arithmetic", "set-up"]
    items: Sequence[str]  # patterns of ids
    chosen: Sequence[str] = ()  # assumptions that were chosen with its numbers in view
    erratum: str | None = None  # that accounts for what differs
    why: str = ""  # other explanation


class Assumption(Entry):
    """One entry of ``assumptions.yaml``."""

    open: str
    value: Any
    unit: str = ""
    config: Sequence[str] = ()
    code: str = ""
    basis: str
    alternatives: Mapping[str, Mapping[str, Any] | str] = {}
    left_out: Mapping[str, str] = {}


def fact_of(item: str, facts: Mapping[str, Fact], file: Path) -> str:
    """Name of the first fact that an item belongs to; `PaperError` if there is none."""
    for name, fact in facts.items():
        if any(fnmatchcase(item, pattern) for pattern in fact.items):
            return name
    raise PaperError(f"{file}: no fact has a pattern of the item {item!r}; add it to the items of one")


def choices(names: Sequence[str], assumptions: Mapping[str, Assumption]) -> dict[str, int]:
    """Number of choices in each assumption: a list of values counts as that many."""
    values: dict[str, Any] = {}
    for name in names:
        if name not in assumptions:
            near = nearest(name, assumptions)
            raise PaperError(f"facts.yaml: chosen = {name!r}: not in assumptions.yaml{near}")
        values[name] = assumptions[name].value
    return {name: len(value) if isinstance(value, list) else 1 for name, value in values.items()}


def judged_facts(
    facts: Mapping[str, Fact],
    items: Sequence[Item],
    assumptions: Mapping[str, Assumption],
    errata: Mapping[str, Erratum],
    chi_square: ChiSquare,
) -> list[dict[str, Any]]:
    """Return one row per fact with its status, worst first, and settle the statuses of its items.

    `chi_square` is that of some items over the spread of seeds, None if it is not known. Choices that several
    facts share are divided among them in proportion to their numbers of items: `spent`, with what is `left`
    of the degrees of freedom.
    """
    members = {name: [item for item in items if item["fact"] == name] for name in facts}
    shared = Counter[str]()
    for name, fact in facts.items():
        shared.update(dict.fromkeys(fact.chosen, len(members[name])))
    rows: list[dict[str, Any]] = []
    for name, fact in facts.items():
        number = choices(fact.chosen, assumptions)
        spent = sum(len(members[name]) * number[choice] / shared[choice] for choice in fact.chosen)
        rows.append({"name": name} | _row(fact, members[name], errata, chi_square, spent))
    return sorted(rows, key=lambda row: (WORST_FIRST.index(row["status"]), -abs(row["largest"] or 0.0)))


def _row(
    fact: Fact, members: Sequence[Item], errata: Mapping[str, Erratum], chi_square: ChiSquare, spent: float
) -> dict[str, Any]:
    judged = [item for item in members if item["status"] != NOT_JUDGED]
    complete = len(judged) == len(members)
    value = chi_square([item["id"] for item in judged]) if complete else None
    left = len(members) - spent
    exceeded = None if value is None else exceeded_probability(value, left)
    erratum = errata.get(fact.erratum or "")
    erratum = erratum if erratum and erratum.passes else None
    cause = fact.why or (erratum.cause if erratum else "")
    status = _settled(judged, exceeded, erratum, cause)
    if fact.basis == SET_UP and status == AGREES:
        status = NOT_JUDGED
        for item in judged:
            item["status"] = NOT_JUDGED
            item["reason"] = BASES[SET_UP]
    off = [item for item in judged if item["agreement"] is None]
    largest = max(judged, key=lambda item: abs(item["relative"] or 0.0), default=None)
    seeds = [abs(item["seeds"]) for item in judged if item["seeds"] is not None]
    return {
        **fact.model_dump(include={"says", "basis", "chosen"}),
        "status": status,
        "items": len(members),
        "judged": len(judged),
        "agree": len(judged) - len(off),
        "chi_square": value,
        "spent": round(spent, 1),
        "left": round(left, 1),
        "largest": largest["relative"] if largest else None,
        "seeds": max(seeds, default=None),
        "why": cause or off[0]["reason"] if status in (MISPRINT, EXPLAINED) else "",
    }


def _settled(judged: Sequence[Item], exceeded: float | None, erratum: Erratum | None, cause: str) -> str:
    """Status of a fact, having given its items that differ theirs.

    `exceeded` is the probability of a larger chi-square.
    """
    off = [item for item in judged if item["agreement"] is None]
    for item in off:
        few = item["seeds"] is not None and abs(item["seeds"]) <= WITHIN
        if item["status"] == MISPRINT:
            continue
        if exceeded >= SIGNIFICANT if exceeded is not None else few:
            item["status"] = SCATTER
        elif erratum is not None and erratum.is_proof:
            if not erratum.values:  # else it is about the items to which it gives a number
                item["status"] = MISPRINT
                item["reason"] = f"erratum {erratum.id}: {erratum.meant}"
        elif cause:
            item["status"] = EXPLAINED
            item["reason"] = cause
        elif few:
            item["status"] = SCATTER
    statuses = {item["status"] for item in judged}
    if exceeded is not None and exceeded < SIGNIFICANT and off and statuses <= {AGREES, SCATTER}:
        return UNEXPLAINED  # each item alone could be scatter, but not all together
    return next((status for status in WORST_FIRST if status in statuses), NOT_JUDGED)


def headline(rows: Sequence[Mapping[str, Any]], assumptions: Mapping[str, Assumption]) -> dict[str, Any]:
    """Counts: facts by status, free choices made, and predictions that came out."""
    judged = [row for row in rows if row["status"] != NOT_JUDGED]
    predictions = [row for row in judged if row["basis"] == "prediction"]
    names = sorted({name for row in judged for name in row["chosen"]})
    return {
        "facts": len(judged),
        "statuses": {status: sum(row["status"] == status for row in rows) for status in STATUSES},
        "choices": sum(choices(names, assumptions).values()),
        "predictions": len(predictions),
        "came_out": sum(row["status"] in (AGREES, SCATTER) for row in predictions),
    }


def headline_text(counts: Mapping[str, Any]) -> str:
    """Return the headline as two sentences."""
    judged = {name: n for name, n in counts["statuses"].items() if n and name != NOT_JUDGED}
    statuses = [f"{n} {STATUSES[name][n > 1]}" for name, n in judged.items()]
    made = {0: "No free choice was made", 1: "1 free choice was made"}
    facts = "1 independent fact" if counts["facts"] == 1 else f"{counts['facts']} independent facts"
    text = f"{facts}: {'; '.join(statuses) or 'none'}. "
    text += made.get(counts["choices"], f"{counts['choices']} free choices were made")
    if counts["predictions"]:
        text += f"; {counts['came_out']} of {counts['predictions']} predictions came out"
    return text + "."
