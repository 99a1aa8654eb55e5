"""Generated blocks: `judged` of README.md, the others of pages.

`make numbers` writes README's, `make lint` checks that they are current.
"""

from collections import Counter
from collections.abc import Mapping

from fragments import ROOT, stored_numbers, table

from paper.study.paper_2006.paper_models import PAPER_MODELS
from pneumo.physics.models import Model
from pneumo.verdict.judging import STATUSES, read_statuses

NUMBERS = stored_numbers()
MEANINGS = {
    "exact": "equal at the printed digits, or within two sigma of reading a figure",
    "close": "inside a tolerance class written down beforehand, narrowed since",
    "explained": "differs, and one named misprint accounts for it",
    "contradicted": "false: the paper's own tables or formulas refute it as well",
    "missed": "differs, unexplained",
}


def _model_row(model: Model) -> list[str]:
    explicit = model.wall != "none"
    indices = list(dict.fromkeys(str(i).removesuffix(".0") for i in (model.n_V, model.n_in, model.n_out)))
    known = ["n"] * model.has_n + (["k_0" if model.wall == "k_0" else "lambda_0"] if explicit else [])
    return [
        model.name,
        {"constant": "constant", "polytropic": "follows the pressure"}[model.temperature],
        "its own temperature" if model.mixing else "the chamber's temperature",
        model.wall if explicit else f"by the {'indices' if indices[1:] else 'index'}: {', '.join(indices)}",
        ", ".join(known),
    ]


def ten_models() -> str:
    """Table of the paper's models in words."""
    head = ["model", "temperature of the air", "air enters at", "heat through the wall", "parameters"]
    return table(head, map(_model_row, PAPER_MODELS.values()))


def judged() -> str:
    """How many items of both papers agree."""
    verdict, second = NUMBERS["verdict"], read_statuses(ROOT / "paper/2007")
    counts = verdict["counts"]
    of_2007 = _counted(Counter(second.values()))
    return f"""\
Of {counts["items"]} numbers and statements of 2006: {_counted(counts)}. No choice was made in view of
{_unfitted(verdict["measured"])}.
Of {len(second)} of the authors' paper of 2007: {of_2007}."""


def table_7() -> str:
    """Table 7 as printed and as reproduced."""
    return NUMBERS["table_7"]["table"]


def _counted(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{counts[status]} {status}" for status in STATUSES if counts[status])


def _unfitted(measured: Mapping[str, Mapping[str, int]]) -> str:
    turns, others = measured["turns"], measured["others"]
    return (
        f"{turns['items']} turning points of one run, Fig. 7 ({_counted(turns)}), and"
        f" {others['items']} other facts ({_counted(others)})"
    )


def verdict() -> str:
    """Counts of both verdicts, by status and kind of evidence."""
    verdict = NUMBERS["verdict"]
    counts, by_basis, facts = verdict["counts"], verdict["counts_by_basis"], verdict["headline"]
    rows = [
        [status, counts[status], *(of_basis[status] for of_basis in by_basis.values()), meaning]
        for status, meaning in MEANINGS.items()
    ]
    power = "An item that no known mistake would lose counts as set-up."
    return f"""\
{counts["items"]} items, by status and kind of evidence ([decision 38](decisions.md)):

{table(["status", "items", *by_basis, "meaning"], [map(str, row) for row in rows])}

With items that state the same fact counted once, no choice was made in view of
{_unfitted(verdict["measured"])}.
Constants, rules and setup that the paper leaves open were chosen with {facts["fitted"]["items"]} others
in view: {_counted(facts["fitted"])}.
{power} Missed by at most 3 %: {verdict["near_misses"]} of
{counts["missed"]} items."""


OF_PAGES = (ten_models, table_7, verdict)
