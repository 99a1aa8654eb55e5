"""Figs 7 to 11: how a settling time is read off, and mean square errors of the models, by source.

Every number comes from a results file or a printed table. Sources are ``published`` (printed in the paper),
``reproduced`` (signals as in the paper) and ``exact`` (exact signals).
"""

import json
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper.study.averages import OVERALL
from paper.study.figures.parts import (
    ALL_BUT_M4,
    BEST_MODELS,
    MSE,
    SOURCE_BAR,
    SOURCE_MARKER,
    SOURCE_OF,
    decades,
    legend_outside,
    message_figure,
    model_ticks,
)
from paper.study.labels import SOURCES
from paper.study.model_looks import MODEL_LOOKS
from paper.study.settling_run import CRITERION
from paper.study.stored_runs import failure_text
from pneumo.publish.style import ACCENT, DOUBLE_MM, GREY, INK, SINGLE_MM, axis_label, new_figure, paper_style
from pneumo.publish.text.formatting import KILO

READ_OFF = "read off the printed figure"


@paper_style()
def fig07(settling: xr.Dataset, printed: Mapping[str, np.ndarray]) -> Figure:
    """Fig. 7: how a settling time is read off, for one file of ``results/settling``; the paper shows E14.

    Force, position, and pressure and temperature of both chambers against time; behind them the curves that
    were read off the paper's figure, `paper.study.paper_2006.printed_tables.traces_of_fig_7`, if any.
    """
    release = settling["release_time"].item()
    if settling["status"]:
        return message_figure(f"{settling['experiment'].item()}: {failure_text(settling, 'settling run')}")
    end = release + 1.5 * settling["settling_time"].max().item()
    shown = settling.sel(t=slice(0, end))
    push = json.loads(settling.attrs["experiment_parameters"])["push"]

    fig = new_figure(DOUBLE_MM, 132)
    axes = fig.subplots(3, 2, sharex=True)
    force, position = axes[0]
    force.plot([0, release, release, end], [push["force"], push["force"], 0, 0], color=INK)
    force.set_ylabel(axis_label("Force", "N"))
    force.annotate("release", (release, 0.5), (4, 0), ("data", "axes fraction"), "offset points", va="center")
    position.plot(shown["t"], shown["x"] * KILO, color=INK, lw=0.8, label=SOURCES["reproduced"])
    position.set_ylabel(axis_label("$x$", "mm"))
    for row, chamber in enumerate(settling["chamber"].values, start=1):
        for ax, quantity, unit, scale in zip(axes[row], "PT", ("kPa", "K"), (KILO, 1.0), strict=True):
            name = f"{quantity}_{chamber}"
            ax.set_ylabel(axis_label(f"${name}$", unit))
            series = settling[quantity].sel(chamber=chamber) / scale
            _settling_panel(ax, series, quantity, release, end, settling["settling_time"].sel(quantity=name))
    scales = {"x": 1 / KILO, "P_A": KILO, "P_B": KILO}
    for ax, name in zip(axes.flat, ("force", "x", "P_A", "T_A", "P_B", "T_B"), strict=True):
        if name in printed:
            t, low, high = printed[name]
            in_window = (t + release >= 0) & (t + release <= end)
            sign = np.sign(push["force"]) if name == "force" else 1.0  # the paper draws its size
            bounds = (sign * bound[in_window] / scales.get(name, 1.0) for bound in (low, high))
            look: dict[str, Any] = {"color": ACCENT, "lw": 2.2, "alpha": 0.5, "capstyle": "round"}
            ax.vlines(t[in_window] + release, *bounds, zorder=0.8, label=READ_OFF, **look)
    if printed:
        legend_outside(fig, position, 1)
    for letter, ax in zip("abcdef", axes.flat, strict=True):
        ax.axvline(release, color=GREY, lw=0.6, ls=(0, (4, 2)), zorder=0)
        ax.set_title(f"({letter})", loc="left")
        ax.set_xlim(0, end)
    for ax in axes[-1]:
        ax.set_xlabel(axis_label("$t$", "s"))
    fig.align_ylabels()
    return fig


def _settling_panel(
    ax: Axes, series: xr.DataArray, quantity: str, release: float, end: float, settling_time: xr.DataArray
) -> None:
    """Draw one trace with its change, its 1 per cent band and its settling time."""
    free = series.sel(t=slice(release, None))
    final = free[-1].item()
    # As in `paper.study.settling_run`: delta P from the release, delta T from the largest excursion.
    extreme = free[0] if quantity == "P" else free[np.abs(free.values - final).argmax()]
    start, t_start, t_s = extreme.item(), extreme["t"].item(), settling_time.item()
    band = CRITERION * abs(start - final)

    shown = series.sel(t=slice(0, end))
    low, high = shown.min().item(), shown.max().item()
    room = (high - low) or 1.0
    ax.set_ylim(low - 0.08 * room, high + 0.34 * room)  # room for the settling time above the data
    ax.axhspan(final - band, final + band, color="#b5b5b5", lw=0, zorder=0.5)
    ax.plot(shown["t"], shown, color=INK, lw=0.8)

    both = {"arrowstyle": "<|-|>", "color": INK, "lw": 0.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 6}
    x = t_start - 0.03 * end if quantity == "P" else t_start
    ax.annotate("", (x, start), (x, final), arrowprops=both)
    ax.plot([x - 0.02 * end, release], [final, final], color=GREY, lw=0.5)
    left = min(x, release) - 0.015 * end
    ax.text(left, (start + final) / 2, rf"$\Delta {quantity}$", ha="right", va="center")
    top = high + 0.1 * room
    ax.plot([release + t_s] * 2, [final, top], color=GREY, lw=0.6, ls=(0, (1.2, 1.2)))
    ax.annotate("", (release, top), (release + t_s, top), arrowprops=both)
    ax.text(release + t_s / 2, top + 0.03 * room, f"$t_s$ = {t_s:.3f} s", ha="center", va="bottom")
    ax.text(end, final + band, r"$\pm$1 %", ha="right", va="bottom", fontsize=7.5)


@paper_style()
def fig08(statistics: Mapping[str, xr.Dataset], table7: xr.Dataset) -> Figure:
    """Fig. 8: average MSE of all models, each experiment at its best n.

    From ``results/TRANSPORT/statistics.nc`` by sampling, and the printed table. Above, the paper's form:
    bars on a logarithmic axis, since M4's is three hundred times M9's. Below, what bars on such an axis hide:
    dots, each error over the printed one. An added model has no printed error.
    """
    fig = new_figure(DOUBLE_MM, 104)
    ax, below = fig.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    ax.set_yscale("log")
    models, tables = list(MODEL_LOOKS), _tables(statistics, OVERALL, table7)
    printed = tables["published"]["mse"].reindex(model=models)
    for source, x in _slots(models, tables, width=0.6).items():
        if source != "published":
            below.plot(x, tables[source]["mse"].reindex(model=models) / printed, **SOURCE_MARKER[source])
    below.axhline(1.0, color=INK, lw=0.6)
    below.set_ylabel("MSE / printed")
    model_ticks(below, models)
    _bars(ax, models, tables)
    lowest = min(table["mse"].min().item() for table in tables.values())
    ax.set_ylim(bottom=10 ** np.floor(np.log10(lowest / 1.5)))  # even the lowest bar is seen
    decades(ax)
    return _finished(fig, ax, statistics)


@paper_style()
def fig09(statistics: Mapping[str, xr.Dataset], table7: xr.Dataset) -> Figure:
    """Fig. 9: MSE of all models but M4, average and 10 and 90 per cent percentiles.

    `table7` is the printed Table 7, with the percentiles read off Fig. 9 as ``p10`` and ``p90``.
    """
    fig = new_figure(DOUBLE_MM, 72)
    ax = fig.subplots()
    _ranges(ax, statistics, OVERALL, table7)
    _explain_whiskers(ax)
    return _finished(fig, ax, statistics)


@paper_style()
def fig10(statistics: Mapping[str, xr.Dataset], table7: xr.Dataset) -> Figure:
    """Fig. 10: average MSE and percentiles of the six best models and added ones, on a linear axis."""
    fig = new_figure(SINGLE_MM, 66)
    ax = fig.subplots()
    tables = _tables(statistics, OVERALL, table7)
    _bars(ax, BEST_MODELS, tables)
    for source, x in _slots(BEST_MODELS, tables, width=0.78).items():
        _whiskers(ax, x, tables[source].reindex(model=BEST_MODELS), INK)
    ax.set_ylim(bottom=0)
    ax.ticklabel_format(axis="y", useMathText=True)
    _explain_whiskers(ax)
    return _finished(fig, ax, statistics, columns=2)


@paper_style()
def fig11(statistics: Mapping[str, xr.Dataset], table9: xr.Dataset) -> Figure:
    """Fig. 11: average MSE and percentiles at each level of heat transfer, each model at its best constant n.

    A level without experiments is marked as not reproduced.
    """
    levels = [level for level in statistics["published"]["level"].values if level != OVERALL]
    fig = new_figure(DOUBLE_MM, 76)
    axes = fig.subplots(1, len(levels), sharey=True, squeeze=False)[0]
    for ax, level in zip(axes, levels, strict=True):
        published = table9.sel(level=level) if level in table9["level"].values else None
        _ranges(ax, statistics, level, published)
        ax.set_title(level)
        ax.label_outer()
    _explain_whiskers(axes[0])
    return _finished(fig, axes[0], statistics)


def _tables(
    statistics: Mapping[str, xr.Dataset], level: str, published: xr.Dataset | None
) -> dict[str, xr.Dataset]:
    """Average MSE and percentiles by source."""
    tables = {} if published is None else {"published": published}
    return tables | {SOURCE_OF[key]: data.sel(level=level) for key, data in statistics.items()}


def _slots(models: Sequence[str], sources: Collection[str], width: float) -> dict[str, np.ndarray]:
    """Positions of each source's marks on x, one group per model, the group `width` wide."""
    offsets = (np.arange(len(sources)) - (len(sources) - 1) / 2) * width / len(sources)
    return {source: np.arange(len(models)) + offset for source, offset in zip(sources, offsets, strict=True)}


def _bars(ax: Axes, models: Sequence[str], tables: Mapping[str, xr.Dataset]) -> None:
    for source, x in _slots(models, tables, width=0.78).items():
        height = tables[source]["mse"].reindex(model=models)
        ax.bar(x, height, 0.78 / len(tables), label=SOURCES[source], **SOURCE_BAR[source])
    model_ticks(ax, models)
    ax.set_ylabel(MSE)


def _ranges(ax: Axes, statistics: Mapping[str, xr.Dataset], level: str, published: xr.Dataset | None) -> None:
    """Draw average and percentiles of all models but M4 at one level, a group per model."""
    tables = _tables(statistics, level, published)
    ax.set_yscale("log")
    for source, x in _slots(ALL_BUT_M4, tables, width=0.72).items():
        look, table = SOURCE_MARKER[source], tables[source].reindex(model=ALL_BUT_M4)
        _whiskers(ax, x, table, look["markeredgecolor"])
        ax.plot(x, table["mse"], label=SOURCES[source], **look)
    ax.set_xticks(np.arange(len(ALL_BUT_M4) - 1) + 0.5, minor=True)
    ax.grid(axis="x", which="minor")
    model_ticks(ax, ALL_BUT_M4)
    ax.set_ylabel(MSE)
    decades(ax)
    if all(data["mse"].sel(level=level).isnull().all() for data in statistics.values()):
        ax.text(0.5, 0.04, "not reproduced: no experiment", ha="center", transform=ax.transAxes)


def _whiskers(ax: Axes, x: np.ndarray, table: xr.Dataset, color: str) -> None:
    """Draw a line from the 10 to the 90 per cent percentile of each model."""
    ax.vlines(x, table["p10"], table["p90"], color=color, lw=1.0)
    for name in ("p10", "p90"):
        ax.plot(x, table[name], ls="none", marker="_", ms=4, color=color, mew=1.0)


def _explain_whiskers(ax: Axes) -> None:
    """Say in the legend from which to which percentile the lines go."""
    ax.plot([], [], color=INK, lw=1.0, marker="_", ms=4, label="10 to 90 % of runs")


def _finished(fig: Figure, ax: Axes, statistics: Mapping[str, xr.Dataset], columns: int = 4) -> Figure:
    """Add the legend, and the names of the experiments that the averages leave out."""
    time = statistics["published"]["failure_time"].dropna("experiment")
    if len(time):
        names = ", ".join(time["experiment"].values)
        fig.supxlabel(f"left out, since the full-order run failed: {names}", fontsize=8.0)
    legend_outside(fig, ax, columns, columnspacing=1.5)
    return fig
