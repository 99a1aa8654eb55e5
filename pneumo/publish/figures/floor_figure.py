"""Figure of the floor: the error that sampled signals cause, measured and predicted."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

from pneumo.publish.figures.panels import every_decade
from pneumo.publish.labels import SAMPLING
from pneumo.publish.style import ACCENT, DOUBLE_MM, INK, axis_label, new_figure, paper_style

COLUMNS = 4  # experiments side by side: both cylinders, both loops
SAMPLING_LOOKS: dict[str, dict[str, Any]] = {
    "linear": {"color": INK, "marker": "o"},
    "hold": {"color": "#c2701f", "marker": "s"},
    "delay": {"color": ACCENT, "marker": "^"},
}
DASHED: Any = (0, (2.4, 1.2))
ROWS = (  # prefix of the variables, dimension, scale of its ticks, label
    ("", "period", 1e3, axis_label("time between samples", "ms")),
    ("rate_", "rate", 1.0, axis_label("draws of the excitation", "1/s")),
    ("size_", "size", 1.0, "area of the valve / the study's"),
)


@paper_style()
def floor_figure(floor: xr.Dataset) -> Figure:
    """Draw the floor of the first four experiments of ``results/floor.nc``, a column each.

    Rows by time between samples, rate of the excitation and size of the valve. Marks are measured, lines
    predicted along the run, dashes the closed formula.
    """
    experiments = floor["experiment"].values[:COLUMNS]
    fig = new_figure(DOUBLE_MM, 165)
    axes = fig.subplots(len(ROWS), len(experiments), sharex="row", sharey="row", squeeze=False)
    for row, (prefix, dimension, scale, label) in zip(axes, ROWS, strict=True):
        for ax, name in zip(row, experiments, strict=True):
            _panel(ax, floor.sel(experiment=name), prefix, dimension, scale)
            ax.tick_params(labelleft=ax is row[0])
        row[0].set_ylabel(axis_label("RMS error", "Pa"))
        row[len(row) // 2].set_xlabel(label, x=0.0 if len(row) % 2 == 0 else 0.5)
    for ax, name in zip(axes[0], experiments, strict=True):
        labels = floor.sel(experiment=name)
        ax.set_title(f"{name}: {labels['cylinder'].item()}, {labels['loop'].item()} loop")
    fig.align_ylabels()
    handles = [
        Line2D([], [], ls="none", mfc="white", label=SAMPLING[name], **look)
        for name, look in SAMPLING_LOOKS.items()
    ]
    handles += [Line2D([], [], color=INK, label="theory along the run")]
    handles += [Line2D([], [], color=INK, ls=DASHED, label="closed formula")]
    fig.legend(handles=handles, loc="outside upper center", ncols=len(handles), columnspacing=1.3)
    return fig


def _panel(ax: Axes, floor: xr.Dataset, prefix: str, dimension: str, scale: float) -> None:
    """Draw one experiment's floor along one dimension."""
    at = floor[dimension].values * scale
    for name, look in SAMPLING_LOOKS.items():
        kinds = ("measured", "predicted", "formula")
        measured, predicted, formula = (floor[prefix + kind].sel(transport=name) for kind in kinds)
        ax.plot(at, predicted, "-", color=look["color"])
        ax.plot(at, formula, linestyle=DASHED, color=look["color"], linewidth=0.8)
        ax.plot(at, measured, linestyle="none", markerfacecolor="white", **look)
    ax.set(xscale="log", yscale="log")
    every_decade(ax.yaxis)
    ax.xaxis.set_minor_formatter(NullFormatter())
    if dimension != "period":
        ax.set_xticks(at)
        ax.set_xticks([], minor=True)
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: np.format_float_positional(value, trim="-")))
    ax.grid(axis="y")
