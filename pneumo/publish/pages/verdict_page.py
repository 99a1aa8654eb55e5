"""Page of a verdict: one self-contained HTML file; judging is done in `pneumo.verdict`.

The paper's ``page.yaml`` has the headings and the layout of the tables, its ``findings.html.j2`` the
findings beyond the items.
"""

import itertools
import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pneumo.publish.labels import ORIGINS
from pneumo.publish.pages.page import STATUS_LOOKS, page_text
from pneumo.verdict.claims import BASES
from pneumo.verdict.entries import Entry, read_entries
from pneumo.verdict.published import read_cells


class Layout(Entry):
    """How a table is laid out: texts in braces are filled with a cell's values in its file."""

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
    alternatives: str  # text on the effects of alternative assumptions, if they were not run
    search: str  # examples of what to search for
    commands: str
    others: Mapping[str, str] = {}  # names and addresses of other verdicts
    titles: Mapping[str, str]  # first part of an item's id -> section of the paper
    names: Mapping[str, str] = {}  # value in a heading -> text in its place
    tables: Mapping[int, Layout] = {}


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
    page = Page.read(folder / "page.yaml", "page", read_entries(folder, "page.yaml"))
    return page_text(
        "verdict.html.j2",
        folder,
        page=page,
        verdict=verdict,
        evidence=evidence,
        items={item["id"]: item for item in verdict["items"]},
        statuses=STATUS_LOOKS,
        origins=ORIGINS,
        bases=BASES,
        short=lambda item: _short(item, page),
        grids=[_grid(table, page, folder, verdict["items"]) for table in page.tables],
        groups=_groups(verdict["items"], page),
    )


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
        if item["table"]:
            key, title = f"table-{item['table']}", f"Table {item['table']}"
        else:
            part = item["id"].split(".")[0]
            key, title = f"{'figure' if item['row'] else 'text'}-{part}", page.titles.get(part, part)
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
