"""Curves of digitised figures, printed and reproduced."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from paper_verdict.errors import PaperError, nearest
from paper_verdict.files import Entry, check_number, read_csv
from paper_verdict.values import Values

MOST_BINS = 300  # along the axis of a drawn curve; each keeps its lowest and its highest value


class Trace(Entry):
    """The reproduced curve of a panel."""

    file: str
    variable: str
    against: str  # variable of the abscissa
    select: Mapping[str, str | float] = {}
    minus: float | str = 0.0  # taken off the abscissa: a number, or a variable
    factor: float = 1.0  # from the file's unit to the print's


class Curves(Entry):
    """An entry of ``curves`` in ``claims.yaml``: the panels of a figure."""

    figure: int
    file: str  # of published/, without suffix: row (the panel), x, and y or low and high
    x: str = "x"  # column of the abscissa
    x_unit: str = ""
    panels: Mapping[str, Trace] = {}  # row of the file -> reproduced curve


def drawn_curves(every: Sequence[Curves], folder: Path, values: Values) -> Iterator[dict[str, Any]]:
    """Yield the panels of all figures: `print` as (x, low, high) and `reproduced` as (x, y).

    A panel whose results are missing has no reproduced curve, and says why.
    """
    for curves in every:
        for panel, points in _printed(curves, folder).items():
            trace = curves.panels[panel]
            first = points[0][0]
            last = points[-1][0]
            try:
                x = values.series(trace.file, trace.against, {})
                y = values.series(trace.file, trace.variable, trace.select)
                shift = trace.minus
                if isinstance(shift, str):
                    (shift,) = values.series(trace.file, shift, {})
            except PaperError as error:
                reproduced, missing = [], str(error).removeprefix(f"{values.folder}/")
            else:
                missing = ""
                pairs = [(a - shift, b * trace.factor) for a, b in zip(x, y, strict=True)]
                reproduced = _thinned([pair for pair in pairs if first <= pair[0] <= last])
            yield {
                "figure": curves.figure,
                "panel": panel,
                "x": f"{curves.x} [{curves.x_unit}]" if curves.x_unit else curves.x,
                "unit": points[0][3],
                "print": [point[:3] for point in points],
                "reproduced": reproduced,
                "missing": missing,
            }


def _printed(curves: Curves, folder: Path) -> dict[str, list[tuple[float, float, float, str]]]:
    """Points of each panel with a reproduced curve: x, lowest and highest y, and the unit."""
    file = folder / "published" / f"{curves.file}.csv"
    rows = read_csv(file)
    head = list(rows[0]) if rows else []
    low, high = ("low", "high") if "low" in head else ("y", "y")
    for name in ("row", curves.x, low, high):
        if name not in head:
            raise PaperError(f"{file}:1: no column {name!r}{nearest(name, head)}")
    panels: dict[str, list[tuple[float, float, float, str]]] = {}
    for row in rows:
        for name in (curves.x, low, high):
            check_number(row[name], f"{row.place}: {name}", numbers_only=True)
        numbers = (float(row[curves.x]), float(row[low]), float(row[high]))
        panels.setdefault(row["row"], []).append((*numbers, row.get("unit", "")))
    for name in curves.panels:
        if name not in panels:
            raise PaperError(f"claims.yaml: curves: panels: {name!r}: no such row{nearest(name, panels)}")
    return {name: points for name, points in panels.items() if name in curves.panels}


def _thinned(pairs: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Lowest and highest point of each of `MOST_BINS` stretches, rounded to six digits."""
    size = max(1, len(pairs) // MOST_BINS)
    kept: list[tuple[float, float]] = []
    for start in range(0, len(pairs), size):
        stretch = pairs[start : start + size]
        ends = {min(stretch, key=lambda pair: pair[1]), max(stretch, key=lambda pair: pair[1])}
        kept += sorted(ends)
    return [(float(f"{x:.6g}"), float(f"{y:.6g}")) for x, y in kept]
