"""Facts of a paper: ``facts.yaml`` groups the items; the status of a fact follows from those of its items.

Assumptions are what was taken where the paper leaves something open: ``assumptions.yaml``.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any, Literal

from scipy.special import chdtrc

from paper.verdict.errata import Erratum
from paper.verdict.published import Entry, PaperError

FACT_STATUSES = {  # best first -> in words, of one fact and of several
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
AGREES, SCATTER, MISPRINT, EXPLAINED, UNEXPLAINED, NOT_JUDGED = FACT_STATUSES
SIGNIFICANT = 0.05  # a chi-square that is exceeded less often is no scatter
WITHIN = 2.0  # standard deviations over seeds, where there is no chi-square

ChiSquare = Callable[[Sequence[str]], float | None]


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
    alternatives: dict[str, dict[str, Any] | str]
    left_out: Mapping[str, str] = {}


def fact_of(item: str, facts: Mapping[str, Fact]) -> str:
    """Name of the first fact that an item belongs to; `PaperError` if there is none."""
    for name, fact in facts.items():
        if any(fnmatchcase(item, pattern) for pattern in fact.items):
            return name
    raise PaperError(f"facts.yaml: no fact has a pattern of the item {item!r}")


def choices(names: Sequence[str], assumptions: Mapping[str, Assumption]) -> dict[str, int]:
    """Number of choices in each assumption: a list of values counts as that many."""
    if unknown := set(names) - set(assumptions):
        raise PaperError(f"facts.yaml: chosen = {min(unknown)!r}: not in assumptions.yaml")
    values = {name: assumptions[name].value for name in names}
    return {name: len(value) if isinstance(value, list) else 1 for name, value in values.items()}


def judged_facts(
    facts: Mapping[str, Fact],
    items: Sequence[Mapping[str, Any]],
    assumptions: Mapping[str, Assumption],
    errata: Mapping[str, Erratum],
    chi_square: ChiSquare,
) -> list[dict[str, Any]]:
    """Return one row per fact with its status, worst first.

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
        judged = [item for item in members[name] if item["status"] != NOT_JUDGED]
        number = choices(fact.chosen, assumptions)
        spent = sum(len(members[name]) * number[choice] / shared[choice] for choice in fact.chosen)
        complete = len(judged) == len(members[name])
        value = chi_square([item["id"] for item in judged]) if complete else None
        left = len(members[name]) - spent
        off = [item for item in judged if item["status"] not in ("exact", "close")]
        largest = max(judged, key=lambda item: abs(item["relative"] or 0.0), default=None)
        seeds = [abs(item["seeds"]) for item in judged if item["seeds"] is not None]
        erratum = errata.get(fact.erratum or "")
        erratum = erratum if erratum and erratum.passes else None
        cause = fact.why or (erratum.cause if erratum else "")
        exceeded = None if value is None else chdtrc(left, value)
        proved = erratum is not None and not erratum.items
        status = _status(fact, judged, off, exceeded, proved, cause != "")
        rows.append(
            {
                "name": name,
                **fact.model_dump(include={"says", "basis", "chosen"}),
                "status": status,
                "items": len(members[name]),
                "judged": len(judged),
                "agree": len(judged) - len(off),
                "chi_square": value,
                "spent": round(spent, 1),
                "left": round(left, 1),
                "largest": largest["relative"] if largest else None,
                "seeds": max(seeds, default=None),
                "why": cause or off[0]["reason"] if status in (MISPRINT, EXPLAINED) else "",
            }
        )
    order = (UNEXPLAINED, EXPLAINED, MISPRINT, SCATTER, AGREES, NOT_JUDGED)
    return sorted(rows, key=lambda row: (order.index(row["status"]), -abs(row["largest"] or 0.0)))


def _status(
    fact: Fact,
    judged: Sequence[Mapping[str, Any]],
    off: Sequence[Mapping[str, Any]],
    exceeded: float | None,
    misprint: bool,
    explained: bool,
) -> str:
    """Status of a fact; `exceeded` is the probability of a larger chi-square."""
    if fact.basis == "set-up" or not judged:
        return NOT_JUDGED
    if not off:
        return AGREES
    scatter = [item["seeds"] is not None and abs(item["seeds"]) <= WITHIN for item in off]
    if all(scatter) if exceeded is None else exceeded >= SIGNIFICANT:
        return SCATTER
    if misprint or all(item["status"] == "explained" for item in off):
        return MISPRINT
    if explained or all(item["status"] in ("explained", "contradicted") for item in off):
        return EXPLAINED
    return UNEXPLAINED


def headline(rows: Sequence[Mapping[str, Any]], assumptions: Mapping[str, Assumption]) -> dict[str, Any]:
    """Counts: facts by status, free choices made, and predictions that came out."""
    judged = [row for row in rows if row["status"] != NOT_JUDGED]
    predictions = [row for row in judged if row["basis"] == "prediction"]
    names = sorted({name for row in judged for name in row["chosen"]})
    return {
        "facts": len(judged),
        "statuses": {status: sum(row["status"] == status for row in rows) for status in FACT_STATUSES},
        "choices": sum(choices(names, assumptions).values()),
        "predictions": len(predictions),
        "came_out": sum(row["status"] in (AGREES, SCATTER) for row in predictions),
    }


def headline_text(counts: Mapping[str, Any]) -> str:
    """Return the headline as two sentences."""
    judged = {name: n for name, n in counts["statuses"].items() if n and name != NOT_JUDGED}
    statuses = [f"{n} {FACT_STATUSES[name][n > 1]}" for name, n in judged.items()]
    made = f"{counts['choices']} free choices were made" if counts["choices"] else "No free choice was made"
    text = f"{counts['facts']} independent facts: {'; '.join(statuses)}. {made}"
    if counts["predictions"]:
        text += f"; {counts['came_out']} of {counts['predictions']} predictions came out"
    return text + "."
