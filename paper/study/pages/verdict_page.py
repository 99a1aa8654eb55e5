"""Page of a verdict: one self-contained HTML file; judging is done in `paper.verdict`.

The paper's ``page.yaml`` has the headings, its ``findings.html.j2`` the findings beyond the facts, and
``simulators.json`` the counts of the verdicts on other simulators' runs.
"""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from paper.study.labels import ORIGINS
from paper.study.pages import STATUS_LOOKS, STUDY_TEMPLATES
from paper.study.text.verdict_text import deviation_text, size_text
from paper.verdict.claims import BASES, UNITS_IN_TEXT
from paper.verdict.facts import headline_text
from paper.verdict.published import Entry, read_entries
from pneumo.publish.pages.page import page_text

SIMULATORS = "simulators.json"  # of a paper; `python -m benchmarks.simulators` writes it


class Beside(Entry):
    """Table that the page shows first, printed beside reproduced."""

    table: int
    caption: str
    columns: Mapping[str, str]  # column of the table's CSV file -> heading


class Page(Entry):
    """One ``page.yaml``."""

    title: str
    authors: str
    journal: str
    doi: str
    how: str  # sentence on the method, before the number of items
    decision: str  # place of the decision on the tolerance classes
    narrowed: str = ""  # decision that narrowed them once results were known
    proofs: str  # module of the proofs of errata
    commands: str
    others: Mapping[str, str] = {}  # names and addresses of other verdicts
    beside: Beside | None = None


class Pair(NamedTuple):
    """A printed number and the reproduced one."""

    id: str
    printed: str
    reproduced: str
    ratio: str


def verdict_page(verdict: Mapping[str, Any], folder: Path, evidence: Sequence[str] = ()) -> str:
    """Write the page of `paper.verdict.judging.verdict`, with style and script inside.

    The same verdict gives the same text. `folder` is the paper's; `PaperError` if its ``page.yaml`` is
    missing or wrong. `evidence` has a text for each further file behind the verdict.
    """
    simulators = folder / SIMULATORS
    page = Page.read(folder / "page.yaml", "page", read_entries(folder, "page.yaml"))
    items = {
        fact["name"]: [i for i in verdict["items"] if i["fact"] == fact["name"]] for fact in verdict["facts"]
    }
    pairs = _beside(page.beside, verdict["items"]) if page.beside else {}
    ratios = [float(row[0].ratio) for row in pairs.values() if row[0].ratio]
    return page_text(
        "verdict.html.j2",
        STUDY_TEMPLATES,
        folder,
        page=page,
        verdict=verdict,
        headline=headline_text(verdict["headline"]),
        evidence=evidence,
        simulators=json.loads(simulators.read_text(encoding="utf-8")) if simulators.is_file() else [],
        statuses=STATUS_LOOKS,
        origins=ORIGINS,
        bases=BASES,
        size=size_text,
        ordinal=lambda number: {1: "", 2: "second", 3: "third"}.get(number, f"{number}th"),
        on_log_axis=axis_fraction,
        off=deviation_text,
        scaled=_scaled,
        beside=pairs,
        within=max((abs(ratio - 1) for ratio in ratios), default=None),
        members=items,
    )


def _beside(beside: Beside, items: Sequence[Mapping[str, Any]]) -> dict[str, list[Pair]]:
    """Numbers of a table by row, in the order of its columns."""
    cells = {(i["row"], i["column"]): i for i in items if i["table"] == beside.table}
    rows: dict[str, list[Pair]] = {}
    for row in dict.fromkeys(row for row, _ in cells):
        for item in (cells[row, column] for column in beside.columns):
            printed, value = float(item["printed"]) * item["scale"], item["reproduced"]
            ratio = f"{value / printed:.3f}" if isinstance(value, float) else ""
            shown = item["shown"].split(" ", 1)[0]
            rows.setdefault(row, []).append(Pair(item["id"], item["printed"], shown, ratio))
    return rows


def _scaled(item: Mapping[str, Any]) -> str:
    """Power of ten and unit in which a table prints an item, as its head has them."""
    exponent = round(math.log10(item["scale"]))
    if exponent <= 0:
        return ""
    power = "".join("⁰¹²³⁴⁵⁶⁷⁸⁹"[int(digit)] for digit in str(exponent))
    return f"× 10{power} {UNITS_IN_TEXT.get(item['unit'], item['unit'])}"


def axis_fraction(value: float, lowest: float, highest: float) -> float:
    """Position of a value on a logarithmic axis, from 0 at `lowest` to 1 at `highest`, limited to these."""
    return min(max(math.log(value / lowest) / math.log(highest / lowest), 0.0), 1.0)
