"""Figs 8 to 11: mean square errors of the models, by source.

Every number comes from a results file or a printed table. Sources are ``published`` (printed in the paper),
``reproduced`` (replays with the published transport) and ``exact`` (replays with the exact one).
"""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pneumo.publish.figures.panels import MSE, SOURCE_OF, decades, legend_outside, model_ticks
from pneumo.publish.model_looks import ADDED_MODELS, MODEL_LOOKS
from pneumo.publish.style import DOUBLE_MM, SINGLE_MM, SOURCE_BAR, SOURCE_MARKER, new_figure, paper_style
from pneumo.statistics.averages import OVERALL

SOURCE_NAME = {
    "published": "printed in the paper",
    "reproduced": "reproduced",
    "exact": "reproduced, exact transport",
}
ALL_BUT_M4 = [model for model in MODEL_LOOKS if model != "M4"]
BEST_SIX = ["M5", "M6", "M7", "M8", "M9", "M10", *ADDED_MODELS]


@paper_style()
def fig08(statistics: Mapping[str, xr.Dataset], table7: xr.Dataset) -> Figure:
    """Fig. 8: average MSE of all models, each experiment at its best n.

    Bars on a logarithmic axis: M4's is three hundred times M9's. An added model has no printed bar.

    Parameters
    ----------
    statistics : mapping of str to xarray.Dataset
        Transport -> ``results/TRANSPORT/statistics.nc``.
    table7 : xarray.Dataset
        From `pneumo.verdict.published.table7`.
    """
    fig = new_figure(DOUBLE_MM, 68)
    ax = fig.subplots()
    ax.set_yscale("log")
    averages = _averages(statistics, OVERALL, table7)
    _bars(ax, list(MODEL_LOOKS), averages)
    lowest = min(average.min().item() for average in averages.values())
    ax.set_ylim(bottom=10 ** np.floor(np.log10(lowest / 1.5)))  # even the lowest bar is seen
    decades(ax)
    return _finished(fig, ax, statistics)


@paper_style()
def fig09(statistics: Mapping[str, xr.Dataset], table7: xr.Dataset) -> Figure:
    """Fig. 9: MSE of all models but M4, average and 10 and 90 per cent percentiles.

    Parameters as in `fig08`; the paper's percentiles are not printed, its averages are.
    """
    fig = new_figure(DOUBLE_MM, 72)
    ax = fig.subplots()
    _ranges(ax, ALL_BUT_M4, statistics, OVERALL, table7)
    return _finished(fig, ax, statistics)


@paper_style()
def fig10(statistics: Mapping[str, xr.Dataset], table7: xr.Dataset) -> Figure:
    """Fig. 10: average MSE of the six best models and of added ones, linear; parameters as in `fig08`."""
    fig = new_figure(SINGLE_MM, 66)
    ax = fig.subplots()
    _bars(ax, BEST_SIX, _averages(statistics, OVERALL, table7))
    ax.set_ylim(bottom=0)
    return _finished(fig, ax, statistics, columns=2)


@paper_style()
def fig11(statistics: Mapping[str, xr.Dataset], table9: xr.Dataset) -> Figure:
    """Fig. 11: as Fig. 9 at each level of heat transfer, each model at its best constant n.

    Parameters as in `fig08`, but for `table9`, from `pneumo.verdict.published.table9`. A level
    without experiments is marked as not reproduced.
    """
    levels = [level for level in statistics["published"]["level"].values if level != OVERALL]
    fig = new_figure(DOUBLE_MM, 76)
    axes = fig.subplots(1, len(levels), sharey=True, squeeze=False)[0]
    for ax, level in zip(axes, levels, strict=True):
        published = table9.sel(level=level) if level in table9["level"].values else None
        _ranges(ax, ALL_BUT_M4, statistics, level, published)
        ax.set_title(level)
    for ax in axes:
        ax.label_outer()
    return _finished(fig, axes[0], statistics)


def _averages(
    statistics: Mapping[str, xr.Dataset], level: str, published: xr.Dataset | None
) -> dict[str, xr.DataArray]:
    """Average MSE by source."""
    averages = {} if published is None else {"published": published["mse"]}
    return averages | {SOURCE_OF[key]: data["mse"].sel(level=level) for key, data in statistics.items()}


def _slots(models: Sequence[str], sources: Sequence[str], width: float) -> dict[str, np.ndarray]:
    """Where the marks of each source stand, one group per model, the group `width` wide."""
    offsets = (np.arange(len(sources)) - (len(sources) - 1) / 2) * width / len(sources)
    return {source: np.arange(len(models)) + offset for source, offset in zip(sources, offsets, strict=True)}


def _bars(ax: Axes, models: Sequence[str], averages: Mapping[str, xr.DataArray]) -> None:
    for source, x in _slots(models, list(averages), width=0.78).items():
        height = averages[source].reindex(model=models)
        ax.bar(x, height, 0.78 / len(averages), label=SOURCE_NAME[source], **SOURCE_BAR[source])
    model_ticks(ax, models)
    ax.set_ylabel(MSE)


def _ranges(
    ax: Axes,
    models: Sequence[str],
    statistics: Mapping[str, xr.Dataset],
    level: str,
    published: xr.Dataset | None,
) -> None:
    """Draw average and percentiles of one level, a group per model."""
    averages = _averages(statistics, level, published)
    slots = _slots(models, list(averages), width=0.72)
    spread = {SOURCE_OF[key]: data.sel(level=level) for key, data in statistics.items()}
    ax.set_yscale("log")
    for source, x in slots.items():
        if source in spread:
            low, high = (spread[source][name].sel(model=models) for name in ("p10", "p90"))
            color = SOURCE_MARKER[source]["markeredgecolor"]
            ax.vlines(x, low, high, color=color, lw=1.0)
            for ends in (low, high):
                ax.plot(x, ends, ls="none", marker="_", markersize=4, color=color, markeredgewidth=1.0)
        ax.plot(x, averages[source].reindex(model=models), label=SOURCE_NAME[source], **SOURCE_MARKER[source])
    ax.set_xticks(np.arange(len(models) - 1) + 0.5, minor=True)
    ax.grid(axis="x", which="minor")
    model_ticks(ax, models)
    ax.set_ylabel(MSE)
    decades(ax)
    if all(data["mse"].sel(model=models).isnull().all() for data in spread.values()):
        ax.text(0.5, 0.04, "not reproduced: no experiment", ha="center", transform=ax.transAxes)


def _finished(fig: Figure, ax: Axes, statistics: Mapping[str, xr.Dataset], columns: int = 3) -> Figure:
    """Add the legend, and the names of the experiments that the averages leave out."""
    time = statistics["published"]["failure_time"].dropna("experiment")
    if len(time):
        names = ", ".join(time["experiment"].values)
        fig.supxlabel(f"left out, since the full-order run failed: {names}", fontsize=8.0)
    legend_outside(fig, ax, columns, columnspacing=1.5)
    return fig
