"""Figures of `pneumo study`, from its cells and ranking."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from pneumo.physics.models import MODELS
from pneumo.publish.figures.panels import one_two_five, symbol
from pneumo.publish.model_looks import MODEL_LOOKS
from pneumo.publish.style import DOUBLE_MM, GREY, INK, axis_label, new_figure, paper_style
from pneumo.publish.text.formatting import KILO
from pneumo.selection.answer import Answer
from pneumo.statistics.error_budget import FULL_ORDER
from pneumo.statistics.intervals import CONFIDENCE
from pneumo.statistics.ranking import Ranking

RMS = axis_label("RMS error", "kPa")
SHOWN_S = 2.0  # length of the traces
MOST_SHOWN = 4.0  # times the lowest error: models with more have no bar
PART_COLORS = ("#2f74b5", "#f0922f", "#007a62", "#8a6d1f", "#6b6b6b")  # of the groups, then of the model


@paper_style()
def ranking_figure(ranking: Ranking) -> Figure:
    """Draw every model's RMS error with its interval, best on top."""
    fig = new_figure(DOUBLE_MM, 74)
    ax = fig.subplots()
    rows = [row for row in ranking.rows if np.isfinite(row.mse.value)]
    for y, row in enumerate(rows):
        look = MODEL_LOOKS[row.model]
        rms, low, high = (max(value, 0.0) ** 0.5 / KILO for value in row.mse)
        if row.mse.known:
            # The lower end may be zero or below, which a logarithmic axis cannot show.
            ax.plot([low or rms / 10, high], [y, y], color=look.color, lw=1.4)
        ax.plot(rms, y, marker=look.marker, color=look.color, ls="none", ms=5)
        n = f", $n$ = {row.n:g}" if np.isfinite(row.n) else ""
        end = (high if row.mse.known else rms, y)
        ax.annotate(f"{rms:.3g} kPa{n}", end, (6, 0), textcoords="offset points", va="center")
    values = [row.mse.value**0.5 / KILO for row in rows]
    ax.set_xscale("log")
    ax.set_xlim(0.7 * min(values), 2.6 * max(values))
    ax.set_yticks(range(len(rows)), [symbol(row.model) for row in rows])
    ax.invert_yaxis()
    ax.set_xlabel(f"{RMS}, bars: {100 * CONFIDENCE:.0f} % over seeds")
    ax.grid(axis="x")
    one_two_five(ax.xaxis)
    return fig


@paper_style()
def budget_figure(answer: Answer) -> Figure:
    """Draw each model's expected error as a bar of its parts, and the 95 % interval as a line."""
    fig = new_figure(DOUBLE_MM, 84)
    ax = fig.subplots()
    rows = [c.row for c in answer.contenders if c.row.rms <= MOST_SHOWN * answer.contenders[0].row.rms]
    parts = [*answer.budget.groups, "model itself"]
    lefts = np.zeros(len(rows))
    for part, color in zip(parts, PART_COLORS, strict=False):
        squares = np.array([(row.own if part == "model itself" else row.part(part)) ** 2 for row in rows])
        totals = np.array(
            [row.own**2 + sum(row.part(group) ** 2 for group in answer.budget.groups) for row in rows]
        )
        widths = np.array([row.rms for row in rows]) / KILO * squares / np.where(totals > 0, totals, 1.0)
        ax.barh(range(len(rows)), widths, left=lefts, color=color, label=part, height=0.62)
        lefts += widths
    for y, row in enumerate(rows):
        ax.plot([row.low / KILO, row.high / KILO], [y, y], color=INK, lw=0.9)
        ax.plot(answer.budget.measured.get(row.model, np.nan) / KILO, y, "D", color=INK, ms=4)
    names = [row.model if row.model == FULL_ORDER else symbol(row.model) for row in rows]
    ends = [f", $n$ = {row.n:g}" if np.isfinite(row.n) else "" for row in rows]
    ax.set_yticks(range(len(rows)), [name + end for name, end in zip(names, ends, strict=True)])
    ax.invert_yaxis()
    ax.set_xlabel(RMS)
    ax.grid(axis="x")
    fig.legend(loc="outside lower center", ncols=len(parts))
    return fig


@paper_style()
def error_over_n(cells: xr.Dataset, ranking: Ranking) -> Figure:
    """Draw the RMS error of every model over n; open marks at each model's best n."""
    fig = new_figure(DOUBLE_MM, 84)
    ax = fig.subplots()
    part = cells.sel(experiment=list(ranking.experiments))
    part = part.sel(run=(part["run_status"] == 0).all("experiment"))
    rms = part["mse"].mean(("experiment", "run", "chamber"), skipna=False) ** 0.5 / KILO
    for name in MODELS:
        look, row = MODEL_LOOKS[name], ranking.row(name)
        ax.plot(rms["n"], rms.sel(model=name), label=symbol(name), **look.line())
        if np.isfinite(row.n):
            ax.plot(row.n, row.mse.value**0.5 / KILO, **look.points())
    ax.set_yscale("log")
    one_two_five(ax.yaxis)
    ax.set_xlabel("$n$")
    ax.set_ylabel(RMS)
    ax.grid()
    fig.legend(loc="outside right upper")
    return fig


@paper_style()
def gain_figure(ranking: Ranking) -> Figure:
    """Draw the reduction of the mean square error by each refinement, with its interval."""
    fig = new_figure(DOUBLE_MM, 62)
    ax = fig.subplots()
    for y, gain in enumerate(ranking.gains):
        value, low, high = gain.percent
        if not np.isfinite(value):
            continue
        color = MODEL_LOOKS[gain.refined].color
        if gain.percent.known:
            ax.plot([low, high], [y, y], color=color, lw=1.4)
        ax.plot(value, y, "o", color=color)
        ax.annotate(f"{value:.0f} %", (value, y), (0, 5), textcoords="offset points", ha="center")
    ax.axvline(0, color=INK, lw=0.8)
    pairs = (f"{symbol(gain.without)} to {symbol(gain.refined)}" for gain in ranking.gains)
    words = (gain.refinement.replace("A_q", "$A_q$") for gain in ranking.gains)
    names = [f"{word}: {pair}" for word, pair in zip(words, pairs, strict=True)]
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(ranking.gains) - 0.4, -0.8)
    ax.set_xlabel("reduction of the mean square error (per cent; negative: increase)")
    ax.grid(axis="x")
    return fig


@paper_style()
def first_run(cells: xr.Dataset, answer: Answer, experiment: str) -> Figure:
    """Draw the start of an experiment's first run, with errors of the chosen and the best reduced models."""
    ranking = answer.ranking
    part = cells.sel(experiment=experiment)
    t = part["trace_t"].values
    shown = t <= SHOWN_S
    best = [row.model for row in ranking.rows[:3]]
    models = best if answer.chosen in (*best, FULL_ORDER) else [answer.chosen, *best[:2]]
    fig = new_figure(DOUBLE_MM, 96)
    position, pressure, error = fig.subplots(3, 1, sharex=True, height_ratios=[0.7, 1.2, 1])
    position.plot(t[shown], part["trace_x"].values[shown] * KILO, color=INK)
    position.set_ylabel(axis_label("$x$", "mm"))
    for chamber, style in (("A", "-"), ("B", (0, (4, 1.5)))):
        full = part["trace_P"].sel(chamber=chamber).values
        pressure.plot(t[shown], full[shown] / KILO, color=INK, ls=style, lw=0.9, label=f"$P_{chamber}$")
        for name in models:
            n = ranking.row(name).n
            predicted = part["trace_pressure"].sel(model=name, chamber=chamber)
            predicted = predicted.sel(n=n) if np.isfinite(n) else predicted.isel(n=0)
            look = {"color": MODEL_LOOKS[name].color, "ls": style, "lw": 0.9}
            label = symbol(name) if chamber == "A" else None
            error.plot(t[shown], (full - predicted.values)[shown] / KILO, label=label, **look)
    pressure.set_ylabel(axis_label("full-order $P$", "kPa"))
    error.axhline(0, color=GREY, lw=0.5)
    error.set_ylabel(axis_label("error", "kPa"))
    error.set_xlabel(axis_label("$t$", "s"))
    for ax in (pressure, error):
        ax.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=3)
    fig.align_ylabels()
    return fig
