"""Bars of `pneumo study`: expected errors by cause, as numbers for its page and as a figure for notebooks."""

from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from pneumo.publish.style import DOUBLE_MM, INK, axis_label, new_figure, paper_style, symbol
from pneumo.publish.text.formatting import KILO
from pneumo.selection.answer import Answer
from pneumo.statistics.error_budget import FULL_ORDER, Row

MOST_SHOWN = 4.0  # times the lowest error: models with more have no bar
ITSELF = "model itself"
PART_COLORS = ("#2f74b5", "#f0922f", "#007a62", "#8a6d1f", "#6b6b6b")  # of the groups, then of the model


class Bar(NamedTuple):
    """Expected error of a model, divided in proportion to the squares of its causes; in kPa."""

    row: Row
    parts: tuple[tuple[float, float, str], ...]  #: left end, width and colour of each cause
    low: float
    high: float
    measured: float  #: on data held out of a fit; NaN without


def causes(answer: Answer) -> dict[str, str]:
    """Causes of the errors, in the order of a bar's parts, with their colours."""
    return dict(zip([*answer.budget.groups, ITSELF], PART_COLORS, strict=False))


def budget_bars(answer: Answer) -> list[Bar]:
    """Bar of each model whose expected error is at most four times the lowest one."""
    bars: list[Bar] = []
    for row in answer.rows:
        if row.rms > MOST_SHOWN * answer.rows[0].rms:
            continue
        squares = [*(row.part(group) ** 2 for group in answer.budget.groups), row.own**2]
        ends = row.rms / KILO * np.cumsum([0.0, *squares]) / (sum(squares) or 1.0)
        parts = tuple(zip(ends[:-1].tolist(), np.diff(ends).tolist(), causes(answer).values(), strict=True))
        measured = answer.budget.measured.get(row.model, np.nan) / KILO
        bars.append(Bar(row, parts, row.low / KILO, row.high / KILO, measured))
    return bars


@paper_style()
def budget_figure(answer: Answer) -> Figure:
    """Draw each model's expected error as a bar of its parts, and the 95 % interval as a line."""
    fig = new_figure(DOUBLE_MM, 84)
    ax, bars, labels = fig.subplots(), budget_bars(answer), list(causes(answer))
    for place, label in enumerate(labels):
        lefts, widths, (color, *_) = zip(*(bar.parts[place] for bar in bars), strict=True)
        ax.barh(range(len(bars)), widths, left=lefts, color=color, label=label, height=0.62)
    for y, bar in enumerate(bars):
        ax.plot([bar.low, bar.high], [y, y], color=INK, lw=0.9)
        ax.plot(bar.measured, y, "D", color=INK, ms=4)
    names = [bar.row.model if bar.row.model == FULL_ORDER else symbol(bar.row.model) for bar in bars]
    ends = [f", $n$ = {bar.row.n:g}" if np.isfinite(bar.row.n) else "" for bar in bars]
    ax.set_yticks(range(len(bars)), [name + end for name, end in zip(names, ends, strict=True)])
    ax.invert_yaxis()
    ax.set_xlabel(axis_label("RMS error", "kPa"))
    ax.grid(axis="x")
    fig.legend(loc="outside lower center", ncols=len(labels))
    return fig
