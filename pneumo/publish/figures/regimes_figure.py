"""Map of the regimes: what refinements pay on random cylinders, over two dimensionless groups."""

import numpy as np
import xarray as xr
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pneumo.evidence.model_pairs import REFINED_MODELS
from pneumo.publish.style import DOUBLE_MM, INK, new_figure, paper_style

REGIME_PANELS = {  # title: model above, models below
    "$M_8/M_7$, mixing": ("M8", ("M7",)),
    "$M_{10}/M_8$, wall law": ("M10", ("M8",)),
    "$M_6$/best, no $k_0$": ("M6", REFINED_MODELS),
}
AXES = {  # group on each axis, and its label
    "thermal": "thermal time constant / time between reversals",
    "exchange": "air through the valve per thermal time constant /\nair in a chamber",
}
LARGEST_RATIO = 10.0  # ratios beyond this or its inverse have the colour of it
SHAPES = {"open": "o", "closed": "s"}


@paper_style()
def regime_map(runs: xr.Dataset) -> Figure:
    """Draw ratios of mean square errors of every run of ``results/cylinders.nc`` that counts."""
    fig = new_figure(DOUBLE_MM, 74)
    axes = fig.subplots(1, len(REGIME_PANELS), sharex=True, sharey=True)
    norm, points = TwoSlopeNorm(0, -np.log10(LARGEST_RATIO), np.log10(LARGEST_RATIO)), None
    for ax, (title, (above, below)) in zip(axes, REGIME_PANELS.items(), strict=True):
        lowest = runs["lowest"].where(runs["counts"] == 1)
        ratio = lowest.sel(model=above) / lowest.sel(model=list(below)).min("model")
        ax.set(xscale="log", yscale="log", title=title)
        for loop, marker in SHAPES.items():
            x, y = (runs[name].sel(loop=loop) for name in AXES)
            shade = np.clip(np.log10(ratio.sel(loop=loop)), norm.vmin, norm.vmax)
            look = {"norm": norm, "cmap": "RdBu_r", "edgecolors": INK, "linewidths": 0.25}
            points = ax.scatter(x, y, 11, shade, marker=marker, **look)
    fig.supxlabel(AXES["thermal"], fontsize=8.5)
    axes[0].set_ylabel(AXES["exchange"])
    assert points is not None
    ticks = [0.1, 0.3, 1.0, 3.0, 10.0]
    bar = fig.colorbar(points, ax=axes, ticks=np.log10(ticks), aspect=30, pad=0.01)
    bar.ax.set_yticklabels([f"{tick:g}" for tick in ticks])
    bar.set_label("ratio of mean square errors")
    shapes = [
        Line2D([], [], ls="", marker=marker, mfc="white", mec=INK, label=f"{loop} loop")
        for loop, marker in SHAPES.items()
    ]
    fig.legend(handles=shapes, loc="outside upper center", ncols=2)
    return fig
