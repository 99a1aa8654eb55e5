"""Parts of schematic figures: blocks, junctions, arrows, streams, restrictions.

Coordinates are millimetres on the printed page, x to the right and y up.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, PathPatch, Polygon, Rectangle
from matplotlib.path import Path

from pneumo.publish.style import ACCENT, GREY, INK, PALE, new_figure

Point = tuple[float, float]

HAIR, LINE, WALL = 0.5, 0.8, 1.1  # line widths in points: dimensions, signals and pipes, solid bodies
HEAD_LENGTH, HEAD_WIDTH = 2.0, 1.5  # arrow head
SMALL = 7.5  # font size of second-rank text


class Box(NamedTuple):
    """A block's centre and its sides, where signals meet it."""

    x: float
    y: float
    left: float
    right: float
    bottom: float
    top: float


def box(x: float, y: float, w: float, h: float) -> Box:
    """Give the sides of a block of a size around (x, y)."""
    return Box(x, y, x - w / 2, x + w / 2, y - h / 2, y + h / 2)


def canvas(width_mm: float, height_mm: float) -> tuple[Figure, Axes]:
    """Make a page whose data coordinates are millimetres."""
    fig = new_figure(width_mm, height_mm, layout=None)
    ax = fig.add_axes((0, 0, 1, 1))
    ax.set_axis_off()
    ax.set(xlim=(0, width_mm), ylim=(0, height_mm))
    return fig, ax


def label(ax: Axes, x: float, y: float, text: str, **kwargs: Any) -> None:
    """Set text; the anchor is its centre unless told otherwise."""
    ax.text(x, y, text, **({"ha": "center", "va": "center", "linespacing": 1.15} | kwargs))


def line(ax: Axes, *points: Point, color: str = INK, lw: float = LINE, ls: Any = "-") -> None:
    """Draw a polyline with sharp corners."""
    patch = PathPatch(Path(points), fill=False, edgecolor=color, linewidth=lw, linestyle=ls)
    patch.set(joinstyle="miter", capstyle="butt")
    ax.add_patch(patch)


def head(ax: Axes, tip: Point, start: Point, color: str = INK, scale: float = 1.0) -> Point:
    """Draw an arrow head at `tip` coming from `start`; give back the middle of its base."""
    end = np.asarray(tip)
    along = end - np.asarray(start)
    along = along / np.hypot(*along)
    base = end - along * HEAD_LENGTH * scale
    across = np.array([-along[1], along[0]]) * HEAD_WIDTH * scale / 2
    ax.add_patch(
        Polygon([end, base + across, base - across], closed=True, facecolor=color, edgecolor="none", zorder=3)
    )
    return float(base[0]), float(base[1])


def arrow(ax: Axes, *points: Point, color: str = INK, lw: float = LINE, scale: float = 1.0) -> None:
    """Draw a polyline that ends in an arrow head."""
    base = head(ax, points[-1], points[-2], color, scale)
    line(ax, *points[:-1], base, color=color, lw=lw)


def flow(ax: Axes, *points: Point) -> None:
    """Draw a stream: straight start, cubic Bezier arcs, straight end with an arrow head."""
    base = head(ax, points[-1], points[-2], ACCENT, scale=1.3)
    codes = [Path.MOVETO, Path.LINETO, *[Path.CURVE4] * (len(points) - 3), Path.LINETO]
    curve = Path([*points[:-1], base], codes)
    ax.add_patch(PathPatch(curve, fill=False, edgecolor=ACCENT, linewidth=1.3, zorder=3))


def dimension(ax: Axes, start: Point, end: Point) -> None:
    """Draw a dimension line with a head at both ends."""
    first, last = head(ax, start, end, scale=0.8), head(ax, end, start, scale=0.8)
    line(ax, first, last, lw=HAIR)


def dot(ax: Axes, x: float, y: float, color: str = INK) -> None:
    """Mark a branching point."""
    ax.add_patch(Circle((x, y), 0.65, facecolor=color, edgecolor="none", zorder=3))


def body(ax: Axes, left: float, bottom: float, w: float, h: float, color: str = PALE, **kwargs: Any) -> None:
    """Draw a solid part in section."""
    look = {"facecolor": color, "edgecolor": INK, "linewidth": LINE} | kwargs
    ax.add_patch(Rectangle((left, bottom), w, h, **look))


def block(ax: Axes, x: float, y: float, w: float, h: float, text: str = "") -> Box:
    """Draw a block of a block diagram around (x, y)."""
    ax.add_patch(Rectangle((x - w / 2, y - h / 2), w, h, facecolor="white", edgecolor=INK, linewidth=WALL))
    label(ax, x, y, text)
    return box(x, y, w, h)


# Small curves inside blocks, on the square [-1, 1] x [-1, 1].
JITTER = (0, 0.5, -0.4, 0.1, 0.9, -0.2, -0.9, 0.3, -0.1, 0.7, -0.6, 0.2, 0)
NOISE = list(zip(np.linspace(-1, 1, len(JITTER)), JITTER, strict=True))
SIGN = [(-1, -0.75), (0, -0.75), (0, 0.75), (1, 0.75)]
LIMIT = [(-1, -0.75), (-0.5, -0.75), (0.5, 0.75), (1, 0.75)]


def icon(ax: Axes, x: float, y: float, curve: Sequence[Point], caption: str, axes: bool = True) -> Box:
    """Draw a block that shows its characteristic curve and carries its name below."""
    frame = block(ax, x, y, 12, 12)
    if axes:
        line(ax, (x - 4.6, y), (x + 4.6, y), color=GREY, lw=HAIR)
        line(ax, (x, y - 4.6), (x, y + 4.6), color=GREY, lw=HAIR)
    line(ax, *((x + 4.2 * u, y + 4.2 * v) for u, v in curve), lw=WALL, color=ACCENT)
    label(ax, x, y - 7.2, caption, va="top", fontsize=SMALL)
    return frame


def gain(ax: Axes, x: float, y: float, caption: str, text: str = "") -> Box:
    """Draw an amplifier triangle."""
    corners = [(x - 5, y - 6), (x + 6, y), (x - 5, y + 6)]
    ax.add_patch(Polygon(corners, closed=True, facecolor="white", edgecolor=INK, linewidth=WALL))
    label(ax, x - 1.4, y, text)
    label(ax, x, y - 7.2, caption, va="top", fontsize=SMALL)
    return box(x + 0.5, y, 11, 12)


def junction(ax: Axes, x: float, y: float, signs: dict[str, Point]) -> Box:
    """Draw a summing junction; `signs` maps a sign to its offset from the centre."""
    ax.add_patch(Circle((x, y), 2.2, facecolor="white", edgecolor=INK, linewidth=WALL))
    for sign, (dx, dy) in signs.items():
        label(ax, x + dx, y + dy, sign)
    return box(x, y, 4.4, 4.4)


def restriction(
    ax: Axes, x: float, y: float, vertical: bool = False, color: str = INK, variable: bool = False
) -> None:
    """Draw a throttle on a pipe through (x, y), with an oblique arrow if its area varies."""
    for side in (-1, 1):
        bow = [(-2.4, 2.1 * side), (0, -0.5 * side), (2.4, 2.1 * side)]
        points = [(x + v, y + u) if vertical else (x + u, y + v) for u, v in bow]
        curve = Path(points, [Path.MOVETO, Path.CURVE3, Path.CURVE3])
        ax.add_patch(PathPatch(curve, fill=False, edgecolor=color, linewidth=WALL + 0.3, zorder=3))
    if variable:
        arrow(ax, (x - 3.2, y - 3.2), (x + 3.4, y + 3.4), color=color, lw=HAIR)


def badge(ax: Axes, x: float, y: float, text: str, color: str = INK) -> None:
    """Write a circled number."""
    ax.add_patch(Circle((x, y), 2.0, facecolor="white", edgecolor=color, linewidth=LINE, zorder=4))
    label(ax, x, y - 0.1, text, color=color, fontsize=SMALL, zorder=5)
