"""Drawings of figures as inline SVG, narrow enough for a phone: printed and reproduced points and curves."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import Any

from paper_verdict.claims import UNITS_IN_TEXT

WIDTH = 380
LEFT = 62
RIGHT = 10
HEIGHT = 190
BOTTOM = 34
TOP = 22
MOST_TICKS = 5
LOGARITHM = "log10("  # how the unit of a printed logarithm begins
PER_CENT = 0.01  # scale of numbers whose unit is %
DECADES = 1.5  # numbers that span more are drawn on a logarithmic axis
PRINT_KEY = {"band": "print", "points": "open"}  # kind of chart -> class of the print's mark

Item = Mapping[str, Any]


def _ticks(low: float, high: float) -> list[float]:
    """Round numbers between two numbers."""
    if high <= low:
        return [low]
    raw = (high - low) / MOST_TICKS
    decade = 10.0 ** math.floor(math.log10(raw))
    step = next(factor * decade for factor in (1, 2, 5, 10) if factor * decade >= raw)
    first = math.ceil(low / step - 1e-9)
    return [float(f"{k * step:.12g}") for k in range(first, math.floor(high / step + 1e-9) + 1)]


class _Axis:
    """Linear map from numbers to pixels."""

    def __init__(self, values: Iterable[float], first: float, last: float) -> None:
        every = list(values)
        low = min(every)
        high = max(every)
        margin = 0.05 * (high - low) or 0.05 * abs(high) or 1.0
        self.low = low - margin
        self.high = high + margin
        self.first = first
        self.last = last

    def __call__(self, value: float) -> float:
        fraction = (value - self.low) / (self.high - self.low)
        return round(self.first + fraction * (self.last - self.first), 1)


def chart_grid(charts: Iterable[str], kind: str) -> str:
    """Charts side by side where there is room, and what their marks mean; `kind` is band or points."""
    key = (
        f'<span class="key {PRINT_KEY[kind]}" aria-hidden="true"></span> read off the print; '
        '<span class="key filled" aria-hidden="true"></span> reproduced'
    )
    return f'<div class="charts">{"".join(charts)}</div><p class="marks">{key}</p>'


def _frame(title: str, body: Iterable[str], caption: str = "") -> str:
    return (
        f'<figure><svg class="chart" viewBox="0 0 {WIDTH} {HEIGHT}" role="img">'
        f"<title>{escape(title)}</title>{''.join(body)}</svg>"
        f"{f'<figcaption>{caption}</figcaption>' if caption else ''}</figure>"
    )


def _y_ticks(axis: _Axis, is_logarithm: bool = False) -> Iterator[str]:
    ticks = _ticks(axis.low, axis.high)
    if is_logarithm and any(tick.is_integer() for tick in ticks):
        ticks = [tick for tick in ticks if tick.is_integer()]
    for tick in ticks:
        y = axis(tick)
        label = f"{10**tick:.2g}" if is_logarithm else f"{tick:.6g}"
        yield f'<line class="tick" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y}" y2="{y}"/>'
        yield f'<text x="{LEFT - 6}" y="{y + 4}" text-anchor="end">{label.replace("e+0", "e")}</text>'


def _heading(name: str, unit: str) -> str:
    unit = UNITS_IN_TEXT.get(unit, unit)
    return f'<text class="axis" x="{LEFT}" y="14">{escape(f"{name} ({unit})" if unit else name)}</text>'


def curve_chart(curve: Mapping[str, Any]) -> str:
    """A panel of a digitised figure, with the printed band and the reproduced curve."""
    printed = curve["print"]
    reproduced = curve["reproduced"]
    x = _Axis([p[0] for p in printed], LEFT, WIDTH - RIGHT)
    x.low, x.high = printed[0][0], printed[-1][0]
    numbers = [value for point in printed for value in point[1:]] + [y for _, y in reproduced]
    y = _Axis(numbers, HEIGHT - BOTTOM, TOP)
    body = [*_y_ticks(y), _heading(curve["panel"], curve["unit"])]
    for tick in _ticks(x.low, x.high):
        body.append(f'<text x="{x(tick)}" y="{HEIGHT - BOTTOM + 16}" text-anchor="middle">{tick:.6g}</text>')
    body.append(f'<text x="{WIDTH - RIGHT}" y="{HEIGHT - 2}" text-anchor="end">{escape(curve["x"])}</text>')
    band = [(p[0], p[1]) for p in printed] + [(p[0], p[2]) for p in reversed(printed)]
    body.append(f'<path class="band" d="{_path(band, x, y)}Z"/>')
    if reproduced:
        body.append(f'<path class="curve" d="{_path(reproduced, x, y)}"/>')
    missing = f"Not reproduced: {escape(curve['missing'])}" if curve["missing"] else ""
    return _frame(f"{curve['panel']} of Fig. {curve['figure']}, printed and reproduced", body, missing)


def _path(points: Sequence[Sequence[float]], x: _Axis, y: _Axis) -> str:
    return "M" + "L".join(f"{x(a):g} {y(b):g}" for a, b in points)


def point_charts(items: Sequence[Item], linear: bool = False) -> Iterator[str]:
    """A chart for each column and group of a figure's points: print as open circles, reproduction as dots.

    Numbers over several decades, and those printed as logarithms, are drawn on a logarithmic axis unless
    `linear`. The charts of a column have the same axis.
    """
    for column in dict.fromkeys(item["column"] for item in items):
        of_column = [i for i in items if i["column"] == column and isinstance(i["reproduced"], float)]
        if of_column:
            yield from _column_charts(column, of_column, linear)


def _column_charts(column: str, items: Sequence[Item], linear: bool) -> Iterator[str]:
    unit = items[0]["unit"]
    pairs = [_in_unit(item) for item in items]
    numbers = [number for pair in pairs for number in pair]
    positive = min(numbers) > 0
    several_decades = positive and math.log10(max(numbers) / min(numbers)) > DECADES
    is_logarithm = not linear and positive and (unit.startswith(LOGARITHM) or several_decades)
    if is_logarithm:
        pairs = [(math.log10(printed), math.log10(reproduced)) for printed, reproduced in pairs]
    y = _Axis([number for pair in pairs for number in pair], HEIGHT - BOTTOM, TOP)
    groups = [", ".join(item["keys"].values()) for item in items]
    for group in dict.fromkeys(groups):
        members = [k for k, name in enumerate(groups) if name == group]
        name = f"{column}, {group}" if group and len(set(groups)) > 1 else column
        body = [*_y_ticks(y, is_logarithm), _heading(name, unit.removeprefix(LOGARITHM).removesuffix(")"))]
        body += _points([items[k] for k in members], [pairs[k] for k in members], y)
        yield _frame(f"{name}, printed and reproduced", body)


def _in_unit(item: Item) -> tuple[float, float]:
    """Printed and reproduced number in the unit of the print; those printed as logarithms without it."""
    printed = float(item["printed"])
    reproduced = item["reproduced"] / item["scale"]
    if item["unit"].startswith(LOGARITHM):
        return 10**printed, 10**reproduced
    factor = 1.0 if item["scale"] == PER_CENT else item["scale"]
    return printed * factor, reproduced * factor


def _points(items: Sequence[Item], pairs: Sequence[tuple[float, float]], y: _Axis) -> Iterator[str]:
    """Marks of printed and reproduced numbers above the names of their rows."""
    step = (WIDTH - LEFT - RIGHT) / len(items)
    for k, (item, (printed, reproduced)) in enumerate(zip(items, pairs, strict=True)):
        at = round(LEFT + (k + 0.5) * step, 1)
        yield f'<line class="link" x1="{at}" x2="{at}" y1="{y(printed)}" y2="{y(reproduced)}"/>'
        title = escape(f"{item['id']}: printed {item['printed']}, reproduced {item['shown']}")
        yield f'<circle class="open" cx="{at}" cy="{y(printed)}" r="5"><title>{title}</title></circle>'
        yield f'<circle class="filled" cx="{at}" cy="{y(reproduced)}" r="2.8"><title>{title}</title></circle>'
        row = escape(item["row"])
        yield f'<text x="{at}" y="{HEIGHT - BOTTOM + 16}" text-anchor="middle">{row}</text>'
