"""Drawings of figures as inline SVG: printed and reproduced points and curves."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import Any

WIDTH = 740
LEFT = 78
RIGHT = 12
HEIGHT = 200
BOTTOM = 34
TOP = 22
MOST_TICKS = 5


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


def _frame(title: str, height: int, body: Iterable[str], caption: str) -> str:
    return (
        f'<figure><div class="scroll" tabindex="0"><svg class="chart" viewBox="0 0 {WIDTH} {height}"'
        ' role="img">'
        f"<title>{escape(title)}</title>{''.join(body)}</svg></div><figcaption>{caption}</figcaption></figure>"
    )


def _y_ticks(axis: _Axis) -> Iterator[str]:
    for tick in _ticks(axis.low, axis.high):
        y = axis(tick)
        yield f'<line class="tick" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y}" y2="{y}"/>'
        yield f'<text x="{LEFT - 6}" y="{y + 4}" text-anchor="end">{tick:.6g}</text>'


def curve_chart(curve: Mapping[str, Any]) -> str:
    """A panel of a digitised figure, with the printed band and the reproduced curve."""
    printed = curve["print"]
    reproduced = curve["reproduced"]
    x = _Axis([p[0] for p in printed], LEFT, WIDTH - RIGHT)
    x.low, x.high = printed[0][0], printed[-1][0]
    numbers = [value for point in printed for value in point[1:]] + [y for _, y in reproduced]
    y = _Axis(numbers, HEIGHT - BOTTOM, TOP)
    body = [*_y_ticks(y)]
    for tick in _ticks(x.low, x.high):
        body.append(f'<text x="{x(tick)}" y="{HEIGHT - BOTTOM + 16}" text-anchor="middle">{tick:.6g}</text>')
    label = f"{curve['panel']} [{curve['unit']}]" if curve["unit"] else curve["panel"]
    body.append(f'<text class="axis" x="{LEFT}" y="14">{escape(label)}</text>')
    body.append(f'<text x="{WIDTH - RIGHT}" y="{HEIGHT - 2}" text-anchor="end">{escape(curve["x"])}</text>')
    band = [(p[0], p[1]) for p in printed] + [(p[0], p[2]) for p in reversed(printed)]
    body.append(f'<path class="band" d="{_path(band, x, y)}Z"/>')
    if reproduced:
        body.append(f'<path class="curve" d="{_path(reproduced, x, y)}"/>')
    caption = (
        '<span class="key print" aria-hidden="true"></span> read off the print; '
        '<span class="key filled" aria-hidden="true"></span> reproduced'
    )
    if curve["missing"]:
        caption = f"Not reproduced: {escape(curve['missing'])}"
    return _frame(
        f"{curve['panel']} of Fig. {curve['figure']}, printed and reproduced", HEIGHT, body, caption
    )


def _path(points: Sequence[Sequence[float]], x: _Axis, y: _Axis) -> str:
    return "M" + "L".join(f"{x(a):g} {y(b):g}" for a, b in points)


def point_charts(items: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """A chart for each column of a figure's points: print as open circles, reproduction as dots."""
    for column in dict.fromkeys(item["column"] for item in items):
        points = [i for i in items if i["column"] == column and isinstance(i["reproduced"], float)]
        if points:
            yield _point_chart(column, points)


def _point_chart(column: str, points: Sequence[Mapping[str, Any]]) -> str:
    groups = [", ".join(item["keys"].values()) for item in points]
    several = len(set(groups)) > 1
    height = HEIGHT + 16 * several
    base = HEIGHT - BOTTOM
    values = [(float(item["printed"]), item["reproduced"] / item["scale"]) for item in points]
    y = _Axis([number for pair in values for number in pair], base, TOP)
    step = (WIDTH - LEFT - RIGHT) / len(points)
    body = [*_y_ticks(y)]
    unit = points[0]["unit"]
    body.append(
        f'<text class="axis" x="{LEFT}" y="14">{escape(f"{column} [{unit}]" if unit else column)}</text>'
    )
    for k, (item, (printed, reproduced)) in enumerate(zip(points, values, strict=True)):
        at = round(LEFT + (k + 0.5) * step, 1)
        body.append(f'<line class="link" x1="{at}" x2="{at}" y1="{y(printed)}" y2="{y(reproduced)}"/>')
        title = escape(f"{item['id']}: printed {item['printed']}, reproduced {item['shown']}")
        body.append(f'<circle class="open" cx="{at}" cy="{y(printed)}" r="5"><title>{title}</title></circle>')
        body.append(
            f'<circle class="filled" cx="{at}" cy="{y(reproduced)}" r="2.8"><title>{title}</title></circle>'
        )
        body.append(f'<text x="{at}" y="{base + 16}" text-anchor="middle">{escape(item["row"])}</text>')
        if several and (k == 0 or groups[k] != groups[k - 1]):
            body.append(
                f'<text class="axis" x="{at - step / 2:.1f}" y="{base + 34}">{escape(groups[k])}</text>'
            )
            if k:
                edge = round(at - step / 2, 1)
                body.append(f'<line class="tick" x1="{edge}" x2="{edge}" y1="{TOP}" y2="{base + 36}"/>')
    caption = (
        '<span class="key open" aria-hidden="true"></span> read off the print; '
        '<span class="key filled" aria-hidden="true"></span> reproduced'
    )
    return _frame(f"{column}, printed and reproduced", height, body, caption)
