"""Page of a verdict: one self-contained HTML file; judging is done in `pneumo.verdict`.

The paper's ``page.yaml`` has the headings and the layout of the tables, its ``findings.html.j2`` the
findings beyond the items, and ``simulators.json`` the counts of the verdicts on other simulators' runs.
"""

import itertools
import json
import math
import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from paper.study.labels import ORIGINS
from paper.study.pages import STATUS_LOOKS, STUDY_TEMPLATES
from pneumo.publish.pages.page import page_text
from pneumo.verdict.claims import BASES
from pneumo.verdict.entries import Entry, read_entries
from pneumo.verdict.judging import EXACT_AS, NEAR_MISS
from pneumo.verdict.published import read_cells

SIZES = {  # largest deviation of a class of the colour scale, and its heading
    0.0: "within the digits",
    0.01: "1 %",
    0.02: "2 %",
    0.05: "5 %",
    math.inf: "more",
}
SIMULATORS = "simulators.json"  # of a paper; `python -m benchmarks.simulators` writes it
BAND, LARGEST = 0.02, 0.1  # deviations of the shaded band and of the edges of the scatter


class Layout(Entry):
    """Layout of a table on the page; names in braces are columns of the table's CSV file."""

    caption: str
    row: str = "{row}"  # heading of a cell's row
    heads: Sequence[str] = ("{column}",)  # headings of its column, one above the other
    order: Mapping[str, Sequence[str]] = {}  # key of the cells -> its values, in the order of the page
    cut: str = ""  # pattern of the text that is left out of a cell


class Page(Entry):
    """One ``page.yaml``."""

    title: str
    authors: str
    journal: str
    doi: str
    how: str  # sentence on the method, before the number of items
    decision: str  # file that defines the tolerance classes
    narrowed: str = ""  # file that narrowed them once results were known
    proofs: str  # module of the proofs of errata
    search: str  # examples of what to search for
    commands: str
    others: Mapping[str, str] = {}  # names and addresses of other verdicts
    titles: Mapping[str, str]  # first part of an item's id -> section of the paper
    names: Mapping[str, str] = {}  # value in a heading -> text in its place
    tables: Mapping[int, Layout] = {}


class Point(NamedTuple):
    """A number of the paper in the scatter."""

    id: str
    x: float  # from 0 to 1 in its group, by printed number
    deviation: float  # as a fraction, at most `LARGEST`
    beyond: bool  # whether the deviation is larger than `LARGEST`
    size: str
    text: str


class Grid(NamedTuple):
    """A table of the paper in the layout of the page."""

    table: int
    caption: str
    heads: Sequence[Sequence[tuple[str, int]]]  # rows of column headings, and the columns that each spans
    rows: Sequence[tuple[str, Sequence[str | None]]]  # row headings, and the claims of their cells


def verdict_page(verdict: Mapping[str, Any], folder: Path, evidence: Sequence[str] = ()) -> str:
    """Write the page of `pneumo.verdict.judging.verdict`, with style and script inside.

    The same verdict gives the same text. `folder` is the paper's; `PaperError` if its ``page.yaml`` is
    missing or wrong. `evidence` has a text for each further file behind the verdict.
    """
    simulators = folder / SIMULATORS
    page = Page.read(folder / "page.yaml", "page", read_entries(folder, "page.yaml"))
    return page_text(
        "verdict.html.j2",
        STUDY_TEMPLATES,
        folder,
        page=page,
        verdict=verdict,
        evidence=evidence,
        simulators=json.loads(simulators.read_text(encoding="utf-8")) if simulators.is_file() else [],
        items={item["id"]: item for item in verdict["items"]},
        statuses=STATUS_LOOKS,
        origins=ORIGINS,
        bases=BASES,
        short=lambda item: _short(item, page),
        size=size_class,
        sizes=SIZES,
        deviation=deviation_text,
        scatter=_scatter(verdict["items"], page),
        band=BAND,
        largest=LARGEST,
        near=NEAR_MISS,
        senses=EXACT_AS,
        grids=[_grid(table, page, folder, verdict["items"]) for table in page.tables],
        groups=_groups(verdict["items"], page),
    )


def size_class(item: Mapping[str, Any]) -> str:
    """Class of an item on the colour scale, by the size of its deviation; ``size-none`` without a number."""
    if item["status"] == "exact":
        return "size-0"
    if item["relative"] is None:
        return "size-none"
    limits = list(SIZES)
    return f"size-{next(i for i, limit in enumerate(limits) if i and abs(item['relative']) <= limit)}"


def deviation_text(item: Mapping[str, Any]) -> str:
    """Deviation of an item in per cent, with its pull if there is one; empty for statements."""
    if item["relative"] is None:
        return ""
    pull = "" if item["pull"] is None else f", pull {item['pull']:+.1f}"
    per_cent = (
        f"{100 * item['relative']:+.2f}" if abs(item["relative"]) < 0.1 else f"{100 * item['relative']:+.0f}"
    )
    return f"{'0' if float(per_cent) == 0 else per_cent} %{pull}"


def _scatter(items: Sequence[Mapping[str, Any]], page: Page) -> list[tuple[str, int, list[Point]]]:
    """Deviations of numbers, by table or figure: heading, number of points beyond the edges, points."""
    groups: dict[str, list[Mapping[str, Any]]] = defaultdict(list)
    for item in items:
        if item["row"] and item["relative"] is not None and item["basis"] != "set-up":
            groups[_group(item, page)[1].partition(",")[0]].append(item)
    result: list[tuple[str, int, list[Point]]] = []
    for heading, members in groups.items():
        members = sorted(members, key=lambda item: abs(float(item["meant"]) * item["scale"]))
        points = [
            Point(
                item["id"],
                (i + 0.5) / len(members),
                min(max(item["relative"], -LARGEST), LARGEST),
                abs(item["relative"]) > LARGEST,
                size_class(item),
                f"{item['id']}: printed {item['meant']}, reproduced {item['shown']}, {deviation_text(item)}",
            )
            for i, item in enumerate(members)
        ]
        result.append((heading, sum(point.beyond for point in points), points))
    return result


def _group(item: Mapping[str, Any], page: Page) -> tuple[str, str]:
    """Anchor and heading of the table, figure or section that an item belongs to."""
    if item["table"]:
        return f"table-{item['table']}", f"Table {item['table']}"
    part = item["id"].split(".")[0]
    return f"{'figure' if item['row'] else 'text'}-{part}", page.titles.get(part, part)


def _short(item: Mapping[str, Any], page: Page) -> str:
    """Reproduced value without its comment, for a cell of a table."""
    if cut := page.tables[item["table"]].cut:
        return re.sub(cut, "", item["shown"])
    whole = isinstance(item["reproduced"], str | list)
    return str(item["shown"] if whole else item["shown"].split(" ", 1)[0])


def _groups(items: Sequence[Mapping[str, Any]], page: Page) -> list[tuple[str, str, list[Mapping[str, Any]]]]:
    """Items by table, or by section of the text, with an anchor and a heading."""
    groups: dict[str, tuple[str, str, list[Mapping[str, Any]]]] = {}
    for item in items:
        key, title = _group(item, page)
        groups.setdefault(key, (key, title, []))[2].append(item)
    return sorted(groups.values(), key=lambda group: not group[0].startswith("text"))


def _grid(table: int, page: Page, folder: Path, items: Sequence[Mapping[str, Any]]) -> Grid:
    """Claims of a table in the layout of the printed table."""
    layout = page.tables[table]
    cells: dict[tuple[str, ...], list[Mapping[str, str]]] = defaultdict(list)
    for cell in read_cells(f"table{table}", folder):
        cells[cell["row"], cell["column"], cell.get("level", "")].append(cell)
    of_table = [
        (item["id"], cells[item["row"], item["column"], item["level"]].pop(0))
        for item in items
        if item["table"] == table
    ]
    of_table.sort(key=lambda cell: [values.index(cell[1][key]) for key, values in layout.order.items()])
    places: dict[tuple[str, tuple[str, ...]], str] = {}
    for name, cell in of_table:
        words = {key: page.names.get(value, value) for key, value in cell.items()}
        places[layout.row.format(**words), tuple(head.format(**words) for head in layout.heads)] = name
    columns = list(dict.fromkeys(column for _, column in places))
    rows = [
        (row, [places.get((row, column)) for column in columns])
        for row in dict.fromkeys(row for row, _ in places)
    ]
    above = [
        [(head, len([*same])) for head, same in itertools.groupby(column[level] for column in columns)]
        for level in range(len(layout.heads) - 1)
    ]
    return Grid(table, layout.caption, [*above, [(column[-1], 1) for column in columns]], rows)
