"""Figures 7 to 11, and two that the paper lacks: datasets in, pictures out.

Every number comes from a results file or a printed table. Sources are ``published`` (printed in the paper),
``reproduced`` (replays with the published transport) and ``exact`` (replays with the exact one).
"""

import json
import textwrap
from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, LogLocator, MaxNLocator, NullFormatter

from pneumo.physics.models import MODELS
from pneumo.publish.model_looks import MODEL_STYLE
from pneumo.publish.style import (
    DOUBLE_MM,
    GREY,
    INK,
    SINGLE_MM,
    SOURCE_BAR,
    SOURCE_MARKER,
    axis_label,
    new_figure,
    paper_style,
)
from pneumo.simulation.settling import CRITERION
from pneumo.statistics.averages import OVERALL, concatenated
from pneumo.storage.layout import failure_text

SOURCE_OF = {"published": "reproduced", "exact": "exact"}  # transport -> source
SOURCE_NAME = {
    "published": "printed in the paper",
    "reproduced": "reproduced",
    "exact": "reproduced, exact transport",
}
TRANSPORT_NAME = {"published": "transport as published", "exact": "exact transport"}

NINE = [model for model in MODEL_STYLE if model != "M4"]
SIX = ["M5", "M6", "M7", "M8", "M9", "M10"]
TRACED = ["M1", "M5", "M7", "M8"]
WITHOUT_N = [name for name, model in MODELS.items() if not model.has_n]

MSE = axis_label("MSE", "Pa$^2$")
KILO = 1e3


def symbol(name: str) -> str:
    """Give a model's or an experiment's name as the paper sets it: M10 becomes M with a subscript.

    Examples
    --------
    >>> symbol("M10"), symbol("E06")
    ('$M_{10}$', '$E_{6}$')
    """
    return f"${name[0]}_{{{int(name[1:])}}}$" if name[1:].isdigit() else name


def _message(text: str) -> Figure:
    """Say what there is to say in place of a picture."""
    fig = new_figure(DOUBLE_MM, 30)
    fig.text(0.5, 0.5, textwrap.fill(text, 90), ha="center", va="center")
    return fig


# --- Fig. 7: settling times ------------------------------------------------------------------------


@paper_style()
def fig07(settling: xr.Dataset) -> Figure:
    """Fig. 7: how a settling time is read off, for one settling run.

    Parameters
    ----------
    settling : xarray.Dataset
        A file of ``results/settling``; the paper shows E14.

    Returns
    -------
    matplotlib.figure.Figure
        Force, position, and pressure and temperature of both chambers against time.
    """
    release = settling["release_time"].item()
    if settling["status"]:
        return _message(f"{settling['experiment'].item()}: {failure_text(settling, 'settling run')}")
    end = release + 1.5 * settling["settling_time"].max().item()
    shown = settling.sel(t=slice(0, end))
    push = json.loads(settling.attrs["experiment_parameters"])["push"]

    fig = new_figure(DOUBLE_MM, 132)
    axes = fig.subplots(3, 2, sharex=True)
    force, position = axes[0]
    force.plot([0, release, release, end], [push["force"], push["force"], 0, 0], color=INK)
    force.set_ylabel(axis_label("Force", "N"))
    force.annotate("release", (release, 0.5), (4, 0), ("data", "axes fraction"), "offset points", va="center")
    position.plot(shown["t"], shown["x"] * KILO, color=INK, lw=0.8)
    position.set_ylabel(axis_label("$x$", "mm"))
    for row, chamber in enumerate(settling["chamber"].values, start=1):
        for ax, quantity, unit, scale in zip(axes[row], "PT", ("kPa", "K"), (KILO, 1.0), strict=True):
            name = f"{quantity}_{chamber}"
            ax.set_ylabel(axis_label(f"${name}$", unit))
            series = settling[quantity].sel(chamber=chamber) / scale
            _settling_panel(ax, series, quantity, release, end, settling["settling_time"].sel(quantity=name))
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
    # As in `pneumo.simulation.settling`: delta P from the release, delta T from the largest excursion.
    extreme = free[0] if quantity == "P" else free[np.abs(free.values - final).argmax()]
    start, t_start, t_s = extreme.item(), extreme["t"].item(), settling_time.item()
    band = CRITERION * abs(start - final)

    shown = series.sel(t=slice(0, end))
    low, high = shown.min().item(), shown.max().item()
    room = (high - low) or 1.0
    ax.set_ylim(low - 0.08 * room, high + 0.34 * room)  # the strip above the data carries the settling time
    ax.axhspan(final - band, final + band, color="#b5b5b5", lw=0, zorder=0.5)
    ax.plot(shown["t"], shown, color=INK, lw=0.8)

    both = {"arrowstyle": "<|-|>", "color": INK, "lw": 0.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 6}
    x = t_start - 0.03 * end if quantity == "P" else t_start
    ax.annotate("", (x, start), (x, final), arrowprops=both)
    ax.plot([x - 0.02 * end, release], [final, final], color=GREY, lw=0.5)
    ax.text(
        min(x, release) - 0.015 * end, (start + final) / 2, rf"$\Delta {quantity}$", ha="right", va="center"
    )
    top = high + 0.1 * room
    ax.plot([release + t_s] * 2, [final, top], color=GREY, lw=0.6, ls=(0, (1.2, 1.2)))
    ax.annotate("", (release, top), (release + t_s, top), arrowprops=both)
    ax.text(release + t_s / 2, top + 0.03 * room, f"$t_s$ = {t_s:.3f} s", ha="center", va="bottom")
    ax.text(end, final + band, r"$\pm$1 %", ha="right", va="bottom", fontsize=7.5)


# --- Figs 8 to 11: performance ---------------------------------------------------------------------


@paper_style()
def fig08(statistics: Mapping[str, xr.Dataset], table7: xr.Dataset) -> Figure:
    """Fig. 8: average MSE of all models, each experiment at its best n.

    Parameters
    ----------
    statistics : mapping of str to xarray.Dataset
        Transport -> ``results/TRANSPORT/statistics.nc``.
    table7 : xarray.Dataset
        From `pneumo.verdict.published.table7`.

    Returns
    -------
    matplotlib.figure.Figure
        Bars on a logarithmic axis: M4 is three hundred times M9.
    """
    fig = new_figure(DOUBLE_MM, 68)
    ax = fig.subplots()
    ax.set_yscale("log")
    averages = _averages(statistics, OVERALL, table7)
    _bars(ax, list(MODEL_STYLE), averages)
    lowest = min(average.min().item() for average in averages.values())
    ax.set_ylim(bottom=10 ** np.floor(np.log10(lowest / 1.5)))  # even the lowest bar is seen
    _log_decades(ax)
    _left_out(fig, statistics)
    _legend_above(fig, ax)
    return fig


@paper_style()
def fig09(statistics: Mapping[str, xr.Dataset], table7: xr.Dataset) -> Figure:
    """Fig. 9: MSE of the nine best models, average and 10 and 90 per cent percentiles.

    Parameters and result as in `fig08`; the paper's percentiles are not printed, its averages are.
    """
    fig = new_figure(DOUBLE_MM, 72)
    ax = fig.subplots()
    _ranges(ax, NINE, statistics, OVERALL, table7)
    _left_out(fig, statistics)
    _legend_above(fig, ax)
    return fig


@paper_style()
def fig10(statistics: Mapping[str, xr.Dataset], table7: xr.Dataset) -> Figure:
    """Fig. 10: average MSE of the six best models on a linear axis; parameters as in `fig08`."""
    fig = new_figure(SINGLE_MM, 66)
    ax = fig.subplots()
    _bars(ax, SIX, _averages(statistics, OVERALL, table7))
    ax.set_ylim(bottom=0)
    _left_out(fig, statistics)
    _legend_above(fig, ax, columns=2)
    return fig


@paper_style()
def fig11(statistics: Mapping[str, xr.Dataset], table9: xr.Dataset) -> Figure:
    """Fig. 11: MSE of the nine best models at three levels of heat transfer, each at its best constant n.

    Parameters
    ----------
    statistics : mapping of str to xarray.Dataset
        Transport -> ``results/TRANSPORT/statistics.nc``.
    table9 : xarray.Dataset
        From `pneumo.verdict.published.table9`.

    Returns
    -------
    matplotlib.figure.Figure
        One panel per level; a level without experiments says so.
    """
    levels = [level for level in statistics["published"]["level"].values if level != OVERALL]
    fig = new_figure(DOUBLE_MM, 76)
    axes = fig.subplots(1, len(levels), sharey=True, squeeze=False)[0]
    for ax, level in zip(axes, levels, strict=True):
        published = table9.sel(level=level) if level in table9["level"].values else None
        _ranges(ax, NINE, statistics, level, published)
        ax.set_title(level)
    for ax in axes:
        ax.label_outer()
    _left_out(fig, statistics)
    _legend_above(fig, axes[0])
    return fig


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


def _model_axis(ax: Axes, models: Sequence[str]) -> None:
    ax.set_xticks(np.arange(len(models)), [symbol(model) for model in models])
    ax.tick_params(axis="x", which="both", length=0)
    ax.set_xlim(-0.6, len(models) - 0.4)
    ax.set_ylabel(MSE)
    ax.grid(axis="y")


def _bars(ax: Axes, models: Sequence[str], averages: Mapping[str, xr.DataArray]) -> None:
    for source, x in _slots(models, list(averages), width=0.78).items():
        height = averages[source].sel(model=models)
        ax.bar(x, height, 0.78 / len(averages), label=SOURCE_NAME[source], **SOURCE_BAR[source])
    _model_axis(ax, models)


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
        ax.plot(x, averages[source].sel(model=models), label=SOURCE_NAME[source], **SOURCE_MARKER[source])
    ax.set_xticks(np.arange(len(models) - 1) + 0.5, minor=True)
    ax.grid(axis="x", which="minor")
    _model_axis(ax, models)
    _log_decades(ax)
    if all(data["mse"].sel(model=models).isnull().all() for data in spread.values()):
        ax.text(0.5, 0.04, "not reproduced: no experiment", ha="center", transform=ax.transAxes)


def _log_decades(ax: Axes) -> None:
    """Put ticks at decades and unlabelled ones between."""
    ax.yaxis.set_major_locator(LogLocator(10.0))
    ax.yaxis.set_minor_locator(LogLocator(10.0, subs="auto"))
    ax.yaxis.set_minor_formatter(NullFormatter())


def _left_out(fig: Figure, statistics: Mapping[str, xr.Dataset]) -> None:
    """Name the experiments that the averages leave out."""
    time = statistics["published"]["failure_time"].dropna("experiment")
    if len(time):
        names = ", ".join(time["experiment"].values)
        fig.supxlabel(f"left out, since the full-order run failed: {names}", fontsize=8.0)


def _legend_above(fig: Figure, ax: Axes, columns: int = 3) -> None:
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=columns, columnspacing=1.5)


# --- Beyond the paper ------------------------------------------------------------------------------


@paper_style()
def traces(
    datum: xr.Dataset,
    replays: Mapping[str, xr.Dataset],
    statistics: Mapping[str, xr.Dataset],
    start: float = 20.0,
    length: float = 2.0,
) -> Figure:
    """Pressure of chamber A against time: datum and four models, with their residuals below.

    Parameters
    ----------
    datum : xarray.Dataset
        A file of ``results/datum``.
    replays : mapping of str to xarray.Dataset
        Transport -> the same experiment's file of ``results/TRANSPORT/replay``.
    statistics : mapping of str to xarray.Dataset
        Transport -> ``results/TRANSPORT/statistics.nc``, which knows the best n.
    start, length : float
        Window, s; a run that is over before shows its last `length` seconds.

    Returns
    -------
    matplotlib.figure.Figure
        One column per transport.
    """
    name = datum["experiment"].item()
    if datum["status"]:
        return _message(f"{name}: the full-order run failed at t = {datum['failure_time'].item():g} s")
    stop = min(start + length, datum["t"].values[-1])
    window = slice(max(0.0, stop - length), stop)
    full = (datum["P"].sel(chamber="A", t=window) / KILO).load()

    fig = new_figure(DOUBLE_MM, 120)
    axes = fig.subplots(3, len(replays), sharex=True, sharey="row", squeeze=False, height_ratios=[1.4, 1, 1])
    for column, (transport, replay) in zip(axes.T, replays.items(), strict=True):
        pressure = replay["pressure"].sel(chamber="A", t=window) / KILO
        column[0].plot(full["t"], full, color="#b5b5b5", lw=2.4, label="full order")
        best = statistics[transport]["best_n"].sel(experiment=name)
        for ax, models in ((column[1], TRACED[:2]), (column[2], TRACED[2:])):
            ax.axhline(0, color=GREY, lw=0.5, zorder=0)
            ax.set_title("    ".join(_with_n(model, best) for model in models), loc="left", fontsize=8.0)
            for model in models:
                if best.sel(model=model).isnull():
                    continue  # failed at every n
                trace = pressure.sel(model=model, n=best.sel(model=model))
                residual = full.sel(t=trace["t"], method="nearest").values - trace
                look = MODEL_STYLE[model].line() | {"lw": 1.0}
                column[0].plot(trace["t"], trace, label=symbol(model), **look)
                ax.plot(trace["t"], residual, **look)
        column[0].set_title(TRANSPORT_NAME[transport])
        column[-1].set_xlabel(axis_label("$t$", "s"))
        column[-1].set_xlim(window.start, window.stop)
        column[-1].xaxis.set_major_locator(MaxNLocator(5))
    axes[0, 0].set_ylabel(axis_label("$P_A$", "kPa"))
    for ax in axes[1:, 0]:
        ax.set_ylabel(axis_label("Residual", "kPa"))
    fig.align_ylabels()
    _legend_above(fig, axes[0, 0], columns=5)
    fig.set_layout_engine("constrained", w_pad=0.06)  # tick labels of neighbouring columns stay apart
    return fig


def _with_n(model: str, best: xr.DataArray) -> str:
    n = best.sel(model=model).item()
    return symbol(model) if model in WITHOUT_N or np.isnan(n) else f"{symbol(model)}, $n$ = {n:.2f}"


@paper_style()
def mse_over_n(grids: Mapping[str, xr.Dataset], levels: Mapping[str, Sequence[float]]) -> Figure:
    """MSE against n, averaged over the experiments of each level of heat transfer.

    Parameters
    ----------
    grids : mapping of str to xarray.Dataset
        Transport -> grid from `pneumo.storage.files.open_grid`.
    levels : mapping of str to sequence of float
        Conductances k_0, W/K, of each level.

    Returns
    -------
    matplotlib.figure.Figure
        A row per transport, a column per level; models without n are horizontal lines.
    """
    fig = new_figure(DOUBLE_MM, 128)
    axes = fig.subplots(len(grids), len(levels), sharex=True, sharey=True, squeeze=False)
    for row, (transport, grid) in zip(axes, grids.items(), strict=True):
        mse = concatenated(grid)["mse"]
        mse = mse.dropna("experiment", how="all")  # those that failed
        for ax, conductances in zip(row, levels.values(), strict=True):
            ax.set_yscale("log")
            inside = np.isin(mse["k_0"], conductances)
            none = xr.DataArray(np.nan, {"n": mse["n"], "model": mse["model"]}, ["model", "n"])
            mean = mse.sel(experiment=inside).mean("experiment", skipna=False) if inside.any() else none
            for model, look in MODEL_STYLE.items():
                keywords = look.line() if model in WITHOUT_N else look.points() | {"markersize": 3.4}
                ax.plot(mean["n"], mean.sel(model=model), label=symbol(model), **keywords)
            ax.grid(axis="y")
            ax.xaxis.set_major_locator(FixedLocator(mean["n"].values[::2].tolist()))
            ax.xaxis.set_minor_locator(FixedLocator(mean["n"].values.tolist()))
            _log_decades(ax)
        row[0].set_ylabel(f"{TRANSPORT_NAME[transport]}\n{MSE}")
    for ax, level in zip(axes[0], levels, strict=True):
        ax.set_title(level)
    for ax in axes[-1]:
        ax.set_xlabel("$n$")
    _legend_above(fig, axes[0, 0], columns=10)
    return fig
