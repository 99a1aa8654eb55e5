"""Map of the regimes: what refinements pay on random cylinders, over two groups of the tree."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pneumo.evidence.regimes import GOOD
from pneumo.publish.style import DOUBLE_MM, INK, new_figure, paper_style

PANELS = {  # title: model above, models below
    "$M_8/M_7$, mixing": ("M8", ("M7",)),
    "$M_{10}/M_8$, wall law": ("M10", ("M8",)),
    "$M_6$/best, no $k_0$": ("M6", GOOD),
}
AXES = ("thermal", "exchange")  # where the tree asks for fewer groups
WORDS = {
    "thermal": "thermal time constant / time between reversals",
    "exchange": "air through the valve per thermal time constant / air in a chamber",
    "breath": "air through the valve between reversals / air in a chamber",
    "way": "way between reversals / stroke",
    "command": "rms command / limit",
    "friction": "friction / force of the pressure at rest",
    "inertia": "force to reverse / force of the pressure at rest",
    "stiffness": "natural frequency × time between reversals",
    "dead": "dead volume / half the stroke's volume",
    "supply": "supply pressure / atmospheric pressure",
}
REACH = 10.0  # ratios beyond this or its inverse have the colour of it
SHAPES = {"open": "o", "closed": "s"}


def asked(node: Mapping[str, Any]) -> list[str]:
    """Groups that a tree asks for, the first questions first."""
    found, level = [], [node]
    while level:
        found += [n["group"] for n in level if n.get("group") in WORDS]
        level = [n[side] for n in level if "group" in n for side in ("below", "above")]
    return list(dict.fromkeys(found))


def _boundaries(ax: Axes, node: Mapping[str, Any], names: list[str], box: list[list[float]]) -> None:
    """Draw the thresholds that lie on the axes, each only where the questions above it leave room."""
    if "group" not in node:
        return
    boxes = [[list(ends) for ends in box], [list(ends) for ends in box]]
    if node["group"] in names:
        axis, at = names.index(node["group"]), node["threshold"]
        line = [[at, at], box[1]] if axis == 0 else [box[0], [at, at]]
        ax.plot(*line, color=INK, lw=0.9, ls=(0, (4, 2)), scalex=False, scaley=False)
        boxes[0][axis][1] = boxes[1][axis][0] = at
    _boundaries(ax, node["below"], names, boxes[0])
    _boundaries(ax, node["above"], names, boxes[1])


@paper_style()
def regimes(runs: xr.Dataset, tree: str) -> Figure:
    """Ratios of mean square errors of every run that counts, and the tree's boundaries.

    Parameters
    ----------
    runs : xarray.Dataset
        ``results/cylinders.nc``.
    tree : str
        Text of ``results/recommendation.json``.

    Returns
    -------
    matplotlib.figure.Figure
    """
    node = json.loads(tree)["tree"]
    names = [*asked(node), *(name for name in AXES if name not in asked(node))][:2]
    fig = new_figure(DOUBLE_MM, 74)
    axes = fig.subplots(1, len(PANELS), sharex=True, sharey=True)
    norm, points = TwoSlopeNorm(0, -np.log10(REACH), np.log10(REACH)), None
    for ax, (title, (above, below)) in zip(axes, PANELS.items(), strict=True):
        lowest = runs["lowest"].where(runs["counts"] == 1)
        ratio = lowest.sel(model=above) / lowest.sel(model=list(below)).min("model")
        ax.set(xscale="log", yscale="log", title=title)
        for loop, marker in SHAPES.items():
            x, y = (runs[name].sel(loop=loop) for name in names)
            shade = np.clip(np.log10(ratio.sel(loop=loop)), norm.vmin, norm.vmax)
            look = {"norm": norm, "cmap": "RdBu_r", "edgecolors": INK, "linewidths": 0.25}
            points = ax.scatter(x, y, 11, shade, marker=marker, **look)
    for ax in axes:
        _boundaries(ax, node, names, [list(ax.get_xlim()), list(ax.get_ylim())])
    fig.supxlabel(WORDS[names[0]], fontsize=8.5)
    axes[0].set_ylabel(WORDS[names[1]].replace(" / ", " /\n"))
    assert points is not None
    ticks = [0.1, 0.3, 1.0, 3.0, 10.0]
    bar = fig.colorbar(points, ax=axes, ticks=np.log10(ticks), aspect=30, pad=0.01)
    bar.ax.set_yticklabels([f"{tick:g}" for tick in ticks])
    bar.set_label("ratio of mean square errors")
    shapes = [
        Line2D([], [], ls="", marker=marker, mfc="white", mec=INK, label=f"{loop} loop")
        for loop, marker in SHAPES.items()
    ]
    shapes.append(Line2D([], [], color=INK, lw=0.9, ls=(0, (4, 2)), label="boundary of the tree"))
    fig.legend(handles=shapes, loc="outside upper center", ncols=3)
    return fig
