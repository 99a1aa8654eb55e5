"""Figure of the error budget: from what each model's MSE comes, at each level of heat transfer."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from pneumo.publish.figures import symbol
from pneumo.publish.style import ACCENT, DOUBLE_MM, INK, axis_label, new_figure, paper_style

MSE = "Pa$^2$"
PARTS: dict[str, tuple[str, dict[str, Any]]] = {
    "model_error": ("model", {"facecolor": "#cfcfcf", "edgecolor": INK}),
    "transport_error": ("signal transport", {"facecolor": ACCENT, "edgecolor": INK}),
    "discretisation_error": (
        "discretisation, 1 ms",
        {"facecolor": "white", "edgecolor": INK, "hatch": "//////"},
    ),
}
POINTS: dict[str, tuple[str, dict[str, Any]]] = {
    "model_error": ("model", {"marker": "o", "markerfacecolor": "#cfcfcf"}),
    "transport_error": ("signal transport", {"marker": "s", "markerfacecolor": ACCENT}),
    "discretisation_error": ("discretisation, 1 ms", {"marker": "D", "markerfacecolor": "white"}),
    "regularised_discretisation": (
        "the same, flow linear near equal pressures",
        {"marker": "_", "markersize": 6},
    ),
    "reference_fine": ("step of 1/16 ms, against adaptive solver", {"marker": "x"}),
}


@paper_style()
def error_budget(budget: xr.Dataset) -> Figure:
    """Draw the parts of each model's MSE at each level.

    Parameters
    ----------
    budget : xarray.Dataset
        ``results/error_budget.nc``.

    Returns
    -------
    matplotlib.figure.Figure
        A column per level. Above, the parts on top of one another and, as a mark, the study's MSE, which
        differs from their sum by the cross term; below, each part alone, on a scale of decades.
    """
    levels, models = budget["level"].values, list(budget["model"].values)
    fig = new_figure(DOUBLE_MM, 128)
    axes = fig.subplots(2, len(levels), sharex=True, sharey="row", squeeze=False, height_ratios=[1, 1.25])
    x = np.arange(len(models))
    for (stack, alone), level in zip(axes.T, levels, strict=True):
        data = budget.sel(level=level)
        _stacked(stack, x, data)
        for name, (label, look) in POINTS.items():
            style = {"markersize": 3.6, "markeredgecolor": INK, "linestyle": "none"} | look
            alone.plot(x, data[f"level_{name}"], label=label, **style)
        alone.set_yscale("log")
        alone.yaxis.set_major_locator(LogLocator(10.0, numticks=20))
        alone.yaxis.set_minor_formatter(NullFormatter())
        alone.grid(axis="y")
        alone.set_xticks(x, [symbol(model) for model in models])
        alone.tick_params(axis="x", length=0)
        stack.set_title(str(level))
    # The highest model may be far above all others: the scale is theirs, and it says how high it is.
    heights = budget["level_total"].max("level").sortby(budget["level_total"].max("level"))
    axes[0, 0].set_ylim(0, 1.15 * heights.dropna("model").values[-2:].min())
    _say_what_is_cut(axes[0], budget)
    axes[0, 0].set_ylabel(axis_label("MSE, parts stacked", MSE))
    axes[1, 0].set_ylabel(axis_label("MSE of each part", MSE))
    fig.align_ylabels()
    fig.legend(
        *axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4, columnspacing=1.5
    )
    fig.legend(
        *axes[1, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3, columnspacing=1.5
    )
    return fig


def _stacked(ax: Axes, x: np.ndarray, data: xr.Dataset) -> None:
    bottom = np.zeros(len(x))
    for name, (label, look) in PARTS.items():
        height = data[f"level_{name}"].values
        ax.bar(x, height, 0.72, bottom=bottom, label=label, linewidth=0.6, **look)
        bottom = bottom + height
    ax.plot(
        x,
        data["level_total"],
        "_",
        color="#c22f1f",
        markersize=9,
        mew=1.4,
        label="MSE of the study (sum and cross term)",
    )
    ax.grid(axis="y")
    ax.set_xlim(-0.6, len(x) - 0.4)


def _say_what_is_cut(axes: np.ndarray, budget: xr.Dataset) -> None:
    """Write the study's MSE beside every bar that leaves its panel."""
    for ax, level in zip(axes, budget["level"].values, strict=True):
        top = ax.get_ylim()[1]
        for i, total in enumerate(budget["level_total"].sel(level=level).values):
            if total > top:
                power = int(np.floor(np.log10(total)))
                text = rf"${total / 10**power:.1f}\times10^{{{power}}}$"
                ax.text(i + 0.45, 0.97 * top, text, va="top", ha="left", fontsize=7.5)
