"""Figure of `pneumo study` for notebooks."""

import numpy as np
from matplotlib.figure import Figure

from pneumo.publish.figures.budget_bars import budget_bars, causes
from pneumo.publish.style import DOUBLE_MM, INK, axis_label, new_figure, paper_style, symbol
from pneumo.selection.answer import Answer
from pneumo.selection.error_budget import FULL_ORDER


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
