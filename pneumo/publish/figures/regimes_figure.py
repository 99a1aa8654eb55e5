"""Map of the regimes: gain of refinements on random cylinders over two dimensionless groups."""

import numpy as np
import xarray as xr
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure

from pneumo.publish.figures.panels import symbol
from pneumo.publish.style import DOUBLE_MM, INK, new_figure, paper_style
from pneumo.statistics.model_pairs import MODEL_PAIRS

THERMAL = "thermal time constant / time between reversals"
EXCHANGE = "air through the valve per thermal time constant / air in a chamber"
LARGEST_RATIO = 10.0  # larger ratios have the colour of this one; likewise below its inverse


@paper_style()
def regime_map(runs: xr.Dataset) -> Figure:
    """Draw the map of ``results/cylinders.nc``; a dot is where the interval of a ratio excludes 1."""
    ratios, loops = runs["map_ratio"], runs["loop"].values
    fig = new_figure(DOUBLE_MM, 110)
    names = runs["map_ratio_of"].values
    axes = fig.subplots(len(loops), len(names), sharex=True, sharey=True)
    norm, shades = TwoSlopeNorm(0, -np.log10(LARGEST_RATIO), np.log10(LARGEST_RATIO)), None
    x, y = runs["thermal_edge"].values, runs["exchange_edge"].values
    centres = [np.sqrt(edges[1:] * edges[:-1]) for edges in (x, y)]
    for row, loop in zip(axes, loops, strict=True):
        for ax, name in zip(row, names, strict=True):
            at = ratios.sel(map_ratio_of=name, loop=loop).transpose("bound", "thermal_bin", "exchange_bin")
            value, low, high = at.sel(bound=["value", "low", "high"]).values
            shade = np.clip(np.log10(value), norm.vmin, norm.vmax)
            shades = ax.pcolormesh(x, y, shade.T, norm=norm, cmap="RdBu_r", edgecolors="none")
            ax.set(xscale="log", yscale="log")
            clear = np.nonzero((low > 1) | (high < 1))
            ax.plot(*(c[i] for c, i in zip(centres, clear, strict=True)), ".", color=INK, ms=2)
            if loop == loops[0]:
                shown = MODEL_PAIRS[name].refinement if name in MODEL_PAIRS else "no $k_0$"
                models = "/".join(symbol(model) for model in name.split("/"))
                ax.set_title(f"{models}, {shown}")
        row[-1].text(1.03, 0.5, f"{loop} loop", rotation=270, va="center", transform=row[-1].transAxes)
    fig.supxlabel(THERMAL, fontsize=8.5)
    fig.supylabel(EXCHANGE, fontsize=8.5)
    assert shades is not None
    ticks = [0.1, 0.3, 1.0, 3.0, 10.0]
    bar = fig.colorbar(shades, ax=axes, ticks=np.log10(ticks), aspect=40, pad=0.04)
    bar.ax.set_yticklabels([f"{tick:g}" for tick in ticks])
    bar.set_label("ratio of mean square errors, geometric mean")
    return fig
