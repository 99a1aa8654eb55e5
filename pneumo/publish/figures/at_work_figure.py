"""Figure of models at work: error in use against replay error, both relative to the best model's."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from pneumo.evidence.at_work.at_work_statistics import ENOUGH, USES, Use, carried_at
from pneumo.publish.figures.panels import fixed_ticks, legend_outside, symbol
from pneumo.publish.model_looks import MODEL_LOOKS
from pneumo.publish.style import DOUBLE_MM, GREY, INK, new_figure, paper_style

PANELS = {  # title: uses
    "observer, no pressure": ("observer, open loop, none", "observer, closed loop, none"),
    "observer, $P_A$": ("observer, open loop, one", "observer, closed loop, one"),
    "observer, both pressures": ("observer, open loop, both", "observer, closed loop, both"),
    "controller, sine and handling": ("controller, following, none", "controller, following, both"),
}
TICKS = (1.0, 2.0, 5.0, 10.0, 20.0)


def _over_best(cells: xr.Dataset, use: Use) -> tuple[xr.DataArray, xr.DataArray]:
    """RMS replay error and error in `use` by model and plant, both relative to the plant's lowest."""
    replayed, used = cells["replay_error"].sel(loop=use.replayed), cells[use.error].sel(use.at)
    both = [(errors**2).mean("seed") ** 0.5 for errors in (replayed, used)]
    return both[0] / both[0].min("model"), both[1] / both[1].min("model")


@paper_style()
def at_work_figure(at_work: xr.Dataset) -> Figure:
    """Draw ``results/at_work.nc`` with the right k_0: a point per model, plant, and loop or sensors."""
    cells = carried_at(at_work, 1.0)
    fig = new_figure(DOUBLE_MM, 70)
    axes = fig.subplots(1, len(PANELS), sharex=True, sharey=True)
    for ax, (title, uses) in zip(axes, PANELS.items(), strict=True):
        for name in cells["model"].values:
            x, y = zip(*(_over_best(cells, USES[use]) for use in uses), strict=True)
            points = (np.concatenate([errors.sel(model=name).values for errors in each]) for each in (x, y))
            look = MODEL_LOOKS[name].points() | {"linestyle": "none", "markersize": 3.6}
            ax.plot(*points, label=symbol(name), **look)
        ax.set(xscale="log", yscale="log", title=title)
        ax.axline((1, 1), (2, 2), color=GREY, linewidth=0.6, linestyle=(0, (3, 2)))
        ax.axhline(ENOUGH, color=INK, linewidth=0.5)
        ax.grid()
        for axis in (ax.xaxis, ax.yaxis):
            fixed_ticks(axis, TICKS)
    axes[0].set_ylabel("error of use over the best model's")
    fig.supxlabel("replay error over the best model's", fontsize=8.5)
    legend_outside(fig, axes[0], cells.sizes["model"])
    return fig
