"""Common parts of figures: names, logarithmic axes, legends, named rows."""

import textwrap
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from pneumo.publish.style import DOUBLE_MM, axis_label, new_figure

SOURCE_OF = {"published": "reproduced", "exact": "exact"}  # sampling -> source
MSE = axis_label("MSE", "Pa$^2$")
Place = Literal["outside upper center", "outside lower center"]
ABOVE: Place = "outside upper center"
BELOW: Place = "outside lower center"


def symbol(name: str) -> str:
    """Return a model's or an experiment's name as the paper sets it: M10 becomes M with a subscript.

    Examples
    --------
    >>> symbol("M10"), symbol("E06")
    ('$M_{10}$', '$E_{6}$')
    """
    return f"${name[0]}_{{{int(name[1:])}}}$" if name[1:].isdigit() else name


def message_figure(text: str) -> Figure:
    """Return a figure with only a sentence, for results that failed."""
    fig = new_figure(DOUBLE_MM, 30)
    fig.text(0.5, 0.5, textwrap.fill(text, 90), ha="center", va="center")
    return fig


def one_two_five(axis: Axis) -> None:
    """Label 1, 2 and 5 of every decade."""
    axis.set_major_locator(LogLocator(10.0, subs=(1.0, 2.0, 5.0), numticks=20))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def decades(ax: Axes) -> None:
    """Put labelled ticks at decades of y and unlabelled ones between."""
    ax.yaxis.set_major_locator(LogLocator(10.0))
    ax.yaxis.set_minor_locator(LogLocator(10.0, subs="auto"))
    ax.yaxis.set_minor_formatter(NullFormatter())


def model_ticks(ax: Axes, models: Sequence[str]) -> None:
    """Label the places 0, 1, 2 ... of the x axis with the models' names."""
    ax.set_xticks(np.arange(len(models)), [symbol(model) for model in models])
    ax.tick_params(axis="x", which="both", length=0)
    ax.set_xlim(-0.6, len(models) - 0.4)
    ax.grid(axis="y")


def legend_outside(fig: Figure, ax: Axes, columns: int, loc: Place = ABOVE, **keywords: Any) -> None:
    """Put the legend of a panel above or below the figure; `keywords` go to `Figure.legend`."""
    fig.legend(*ax.get_legend_handles_labels(), loc=loc, ncols=columns, **keywords)
