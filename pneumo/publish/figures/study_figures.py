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
from pneumo.statistics.ranking import Ranking

RMS = axis_label("RMS error", "kPa")
SHOWN_S = 2.0  # length of the traces
MOST_SHOWN = 4.0  # times the lowest error: models with more have no bar
PART_COLORS = ("#2f74b5", "#f0922f", "#007a62", "#8a6d1f", "#6b6b6b")  # of the groups, then of the model


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
