"""Figure of the error budget: the sources of each model's MSE, at each level of heat transfer."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pneumo.physics.models import MODELS
from pneumo.publish.figures.panels import BELOW, every_decade, legend_outside, model_ticks
from pneumo.publish.style import ACCENT, DOUBLE_MM, INK, axis_label, new_figure, paper_style

TOTAL = "#c22f1f"
PARTS: dict[str, tuple[str, dict[str, Any]]] = {
    "model_error": ("model", {"facecolor": "#cfcfcf", "edgecolor": INK}),
    "transport_error": ("signal sampling", {"facecolor": ACCENT, "edgecolor": INK}),
    "discretisation_error": ("discretisation", {"facecolor": "white", "edgecolor": INK, "hatch": "//////"}),
}
POINTS: dict[str, tuple[str, dict[str, Any]]] = {
    "transport_error": ("signal sampling", {"marker": "s", "markerfacecolor": ACCENT}),
    "model_error": ("model", {"marker": "o", "markerfacecolor": "#cfcfcf"}),
    "discretisation_error": ("discretisation", {"marker": "D", "markerfacecolor": "white"}),
    "chatter": ("chatter near equal pressures", {"marker": "_", "markersize": 7}),
    "reference_fine": ("discretisation left at 1/16 of the step", {"marker": "x"}),
}


@paper_style()
def error_budget_figure(budget: xr.Dataset) -> Figure:
    """Draw the parts of each model's MSE, from ``results/error_budget.nc``, a column per level.

    Above, the parts on top of one another and, as a mark, the study's MSE, which differs from their sum by
    the cross term; bars that exceed the scale have their height as text. Below, each part alone, on decades.
    """
    levels, models = budget["level"].values, list(budget["model"].values)
    fig = new_figure(DOUBLE_MM, 140)
    axes = fig.subplots(2, len(levels), sharex=True, squeeze=False, height_ratios=[1, 1.1])
    x = np.arange(len(models))
    for (stack, alone), level in zip(axes.T, levels, strict=True):
        data = budget.sel(level=level)
        _stacked(stack, x, data)
        for name, (label, look) in POINTS.items():
            style = {"markersize": 4.0, "markeredgecolor": INK, "linestyle": "none"} | look
            alone.plot(x, data[f"level_{name}"], label=label, **style)
        alone.set_yscale("log")
        every_decade(alone.yaxis)
        model_ticks(alone, models)
        alone.sharey(axes[1, 0])
        alone.tick_params(labelleft=alone is axes[1, 0])
        stack.set_title(str(level))
    for ax in axes[0]:
        ax.ticklabel_format(axis="y", useMathText=True)
    axes[0, 0].set_ylabel(axis_label("MSE, parts stacked", "Pa$^2$"))
    axes[1, 0].set_ylabel(axis_label("MSE of each part", "Pa$^2$"))
    fig.align_ylabels()
    legend_outside(fig, axes[0, 0], 4, columnspacing=1.5)
    legend_outside(fig, axes[1, 0], 3, BELOW, columnspacing=1.5)
    return fig


def _stacked(ax: Axes, x: np.ndarray, data: xr.Dataset) -> None:
    """Stack the parts on the scale of the polytropic models; a higher bar has its height as text."""
    bottom = np.zeros(len(x))
    for name, (label, look) in PARTS.items():
        height = data[f"level_{name}"].values
        ax.bar(x, height, 0.72, bottom=bottom, label=label, linewidth=0.6, **look)
        bottom = bottom + height
    total = data["level_total"].values
    ax.plot(x, total, "_", color=TOTAL, markersize=9, mew=1.4, label="MSE of the study: sum and cross term")
    polytropic = [MODELS[name].temperature == "polytropic" for name in data["model"].values]
    highest = np.fmax(bottom, total)
    if np.isfinite(highest[polytropic]).any():
        ax.set_ylim(0, 1.1 * np.nanmax(highest[polytropic]))
    top = ax.get_ylim()[1]
    for i in np.flatnonzero(highest > top):
        power = int(np.floor(np.log10(total[i])))
        text = rf"${total[i] / 10**power:.1f}\times10^{{{power}}}$"
        ax.text(x[i], 0.96 * top, text, rotation=90, va="top", ha="center", fontsize=7.5)
    ax.grid(axis="y")
