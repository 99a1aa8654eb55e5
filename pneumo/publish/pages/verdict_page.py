"""Page of the verdict: one self-contained HTML file; judging is done in `pneumo.verdict`."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from pneumo.publish.pages.page import STATUS_LOOKS, page_text
from pneumo.verdict.published import read_table

CONDUCTANCES_OF_LEVEL = {"adiabatic": "0.02, 0.1", "typical": "0.1, 0.5", "isothermal": "0.5, 2.5"}
COLUMN_SIGNS = {"mu": "μ", "sigma": "σ", "mse": "MSE", "A_q0": "A_q", "wall_heat": "wall heat"}
CAPTIONS = {
    1: "Features of the reduced models",
    2: "Cylinders: derived quantities (bores and strokes are inputs)",
    4: "Heat transfer coefficients λ₀, W/(m² K)",
    5: "Settling times, s",
    6: "Simulation times, s: at least ten settling times?",
    7: "Average error over all experiments, each at its best n: μ, σ in Pa, MSE in Pa²",
    8: "Best n",
    9: "Average error with the best constant n of each level: μ in 10² Pa, σ in 10³ Pa, MSE in 10⁶ Pa²",
}
LOOP_HEADS = {"open": "open loop", "closed": "closed loop"}
CHART = {"left": 150.0, "width": 560.0, "row": 17.0, "lowest": 0.05, "highest": 4.0}  # of M8/M7, in px


class Grid(NamedTuple):
    """A table of the paper, as it is laid out on the page.

    `heads` are rows of column headings with the columns that each spans, after the corner; `rows` are row
    headings with the claims of their cells.
    """

    table: int
    caption: str
    heads: Sequence[Sequence[tuple[str, int]]]
    rows: Sequence[tuple[str, Sequence[str | None]]]


def verdict_page(verdict: Mapping[str, Any]) -> str:
    """Write the page of `pneumo.verdict.judging.verdict`, with style and script inside.

    The same verdict gives the same text.
    """
    return page_text(
        "verdict.html.j2",
        verdict=verdict,
        items={item["id"]: item for item in verdict["items"]},
        statuses=STATUS_LOOKS,
        short=_short,
        grids=[_grid(table, verdict["items"]) for table in CAPTIONS],
        groups=_groups(verdict["items"]),
        chart=_chart(verdict["highlights"]["by_experiment"]),
    )


def _short(item: Mapping[str, Any]) -> str:
    """Reproduced value without its comment, for a cell of a table."""
    return str(item["shown"] if isinstance(item["reproduced"], str) else item["shown"].split(" ", 1)[0])


def _groups(items: Sequence[Mapping[str, Any]]) -> list[tuple[str, str, list[Mapping[str, Any]]]]:
    """Items by table, or by section of the text, with an anchor and a heading."""
    groups: dict[str, tuple[str, str, list[Mapping[str, Any]]]] = {}
    for item in items:
        if item["table"]:
            key, title = f"table-{item['table']}", f"Table {item['table']}"
        else:
            part = item["id"].split(".")[0]
            key, title = f"text-{part}", TITLES[part]
        groups.setdefault(key, (key, title, []))[2].append(item)
    return sorted(groups.values(), key=lambda group: not group[0].startswith("text"))


TITLES = {
    "ABS": "Abstract",
    "S1": "Section 1, introduction",
    "S2": "Section 2, the full-order model",
    "S3": "Section 3, the reduced models",
    "S4": "Section 4, the comparison",
    "S5": "Section 5, conclusions",
    "A1": "Appendix 1, notation",
    "A2": "Appendix 2, equilibrium pressure",
}


def _grid(table: int, items: Sequence[Mapping[str, Any]]) -> Grid:
    of_table = [item for item in items if item["table"] == table]
    if table in (5, 6):
        return _by_conductance(table, of_table)
    if table == 4:
        cells = {(item["row"], item["id"].split("=")[1]): item["id"] for item in of_table}
        columns = list(dict.fromkeys(key[1] for key in cells))
        heads = [[("k₀ = " + k_0 + " W/K", 1) for k_0 in columns]]
        rows = [(f"cylinder {row}", [cells[row, k_0] for k_0 in columns]) for row in "DE"]
        return Grid(table, CAPTIONS[table], heads, rows)
    columns = list(dict.fromkeys((item["level"], item["column"]) for item in of_table))
    cells = {(item["row"], item["level"], item["column"]): item["id"] for item in of_table}
    rows = [
        (name, [cells.get((name, *column)) for column in columns])
        for name in dict.fromkeys(item["row"] for item in of_table)
    ]
    heads = [[(COLUMN_SIGNS.get(column, str(column)), 1) for _, column in columns]]
    if table == 9:
        heads.insert(0, [(f"{level}, k₀ = {k_0} W/K", 3) for level, k_0 in CONDUCTANCES_OF_LEVEL.items()])
    return Grid(table, CAPTIONS[table], heads, rows)


def _by_conductance(table: int, items: Sequence[Mapping[str, Any]]) -> Grid:
    """Tables 5 and 6 as printed: cylinders below each other, loops and conductances beside each other."""
    lines = {cell["row"]: cell for cell in read_table(table)}
    places = {
        (line["cylinder"], item["column"], line["type"], line["k_0"]): item["id"]
        for item in items
        for line in [lines[item["row"]]]
    }
    columns = list(dict.fromkeys((kind, k_0) for _, _, kind, k_0 in places))
    columns.sort(key=lambda column: (column[0] != "open", float(column[1])))
    names = list(dict.fromkeys((cylinder, column) for cylinder, column, _, _ in places))
    names.sort(key=lambda name: name[0])
    heads = [[(head, 4) for head in LOOP_HEADS.values()], [(f"k₀ = {k_0}", 1) for _, k_0 in columns]]
    rows = [(name, [places.get((*name, *place)) for place in columns]) for name in names]
    named = "{}, {}" if table == 5 else "cylinder {}"
    return Grid(table, CAPTIONS[table], heads, [(named.format(*name), cells) for name, cells in rows])


def _chart(by_experiment: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Coordinates of M8/M7 by experiment on a logarithmic axis, in pixels."""
    if not by_experiment:
        return None

    def x(value: float) -> float:
        share = math.log(value / CHART["lowest"]) / math.log(CHART["highest"] / CHART["lowest"])
        return round(CHART["left"] + CHART["width"] * min(max(share, 0.0), 1.0), 1)

    names = [*by_experiment["experiments"], "geometric mean"]
    published, exact = (
        [*by_experiment[name], by_experiment[f"{name}_geometric_mean"]] for name in ("published", "exact")
    )
    rows = list(zip(names, published, exact, strict=True))
    return {
        "rows": [
            {"name": name, "y": 34 + CHART["row"] * i, "published": (one, x(one)), "exact": (other, x(other))}
            for i, (name, one, other) in enumerate(rows)
        ],
        "ticks": [(value, x(value)) for value in (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0)],
        "height": round(34 + CHART["row"] * len(rows) + 16),
    }
