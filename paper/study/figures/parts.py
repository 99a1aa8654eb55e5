"""Looks and common parts of the study's figures: sources, chosen models, axes, legends."""

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from paper.study.model_looks import ADDED_MODELS
from pneumo.physics.models import MODELS
from pneumo.publish.style import ACCENT, DOUBLE_MM, INK, axis_label, new_figure, symbol

# Models of figures and pages that do not show all; added models join where the figure has room.
ALL_BUT_M4 = [name for name in MODELS if name != "M4"]  # Figs 9 and 11: M4's error would hide the others'
BEST_MODELS = ["M5", "M6", "M7", "M8", "M9", "M10", *ADDED_MODELS]  # Fig. 10: the paper's "six best"
# Second and third row of the traces: without and with wall heat; section 4 compares M7 and M8.
TRACED_MODELS = (("M1", "M5"), ("M7", "M8", *ADDED_MODELS))
FIRST_SHOWN = (
    "M6",
    "M7",
    "M8",
)  # on the report, before a reader chooses: with mixing, with wall heat, with both

SOURCE_OF = {"published": "reproduced", "exact": "exact"}  # sampling -> source
MSE = axis_label("MSE", "Pa$^2$")
# Published is open and hatched, reproduced is filled, exact signals are pale: readable without colour.
SOURCE_BAR: dict[str, dict[str, Any]] = {
    "published": {"facecolor": "white", "edgecolor": INK, "hatch": "//////", "linewidth": 0.7},
    "reproduced": {"facecolor": ACCENT, "edgecolor": INK, "linewidth": 0.7},
    "exact": {"facecolor": "#cfcfcf", "edgecolor": INK, "linewidth": 0.7},
}
_MARK: dict[str, Any] = {"linestyle": "none", "markeredgewidth": 0.9, "markeredgecolor": INK}
SOURCE_MARKER: dict[str, dict[str, Any]] = {
    "published": _MARK | {"marker": "o", "markersize": 5.5, "markerfacecolor": "none"},
    "reproduced": _MARK
    | {"marker": "D", "markersize": 3.2, "markerfacecolor": ACCENT, "markeredgecolor": ACCENT},
    "exact": _MARK
    | {"marker": "s", "markersize": 3.4, "markerfacecolor": "#cfcfcf", "markeredgecolor": "#5a5a5a"},
}


def message_figure(text: str) -> Figure:
    """Return a figure with only a sentence, for results that failed."""
    fig = new_figure(DOUBLE_MM, 30)
    fig.text(0.5, 0.5, textwrap.fill(text, 90), ha="center", va="center")
    return fig


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


def legend_outside(fig: Figure, ax: Axes, columns: int, **keywords: Any) -> None:
    """Put the legend of a panel above the figure; `keywords` go to `Figure.legend`."""
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=columns, **keywords)
