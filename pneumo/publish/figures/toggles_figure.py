"""Tornado plot: what each open choice of the paper does to the agreement with its tables."""

import itertools
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from pneumo.publish.figures.panels import fixed_ticks, name_rows, row_panel
from pneumo.publish.style import ACCENT, DOUBLE_MM, INK, new_figure, paper_style
from pneumo.verdict.assumptions import AS_TAKEN

TOGGLE_PANELS = {7: "Table 7, MSE", 9: "Table 9, MSE", 5: "Table 5, settling times"}
LEAST = 1e-3  # an effect that is smaller in all panels gets no row
LINEAR = 0.01  # changes up to this are drawn to scale, larger ones by their logarithm
NEARER: dict[str, Any] = {"facecolor": ACCENT, "edgecolor": INK, "linewidth": 0.5}
FARTHER: dict[str, Any] = {"facecolor": "#cfcfcf", "edgecolor": INK, "linewidth": 0.5}


def alternative_name(name: str) -> str:
    """Return the name of an alternative in plain words.

    Examples
    --------
    >>> [alternative_name(name) for name in ("step.step_0_5_ms", "gas_constant.R_286_9")]
    ['step 0.5 ms', 'R 286.9']
    """
    parts = name.partition(".")[2].split("_")
    text = parts[0]
    for before, part in itertools.pairwise(parts):
        text += ("." if before.isdigit() and part.isdigit() else " ") + part
    return text


@paper_style()
def tornado(effects: pd.DataFrame) -> Figure:
    """Draw the change of the misfit of Tables 7, 9 and 5 under each alternative, the largest on top.

    A bar to the left: the numbers come nearer to the print. `effects` is the table of
    `pneumo.evidence.toggle_effects.toggle_effects`.
    """
    changes = effects.drop(index=AS_TAKEN)[[f"worse_{table}" for table in TOGGLE_PANELS]].fillna(0.0)
    size = changes.abs().max(axis=1).to_numpy()
    order = np.argsort(size, kind="stable")
    shown = changes.iloc[order[size[order] >= LEAST]]
    y = np.arange(len(shown))

    fig = new_figure(DOUBLE_MM, 30 + 4.2 * len(shown))
    axes = fig.subplots(1, len(TOGGLE_PANELS), sharex=True, sharey=True)
    for ax, (table, title) in zip(axes, TOGGLE_PANELS.items(), strict=True):
        width = shown[f"worse_{table}"].to_numpy()
        for look, chosen in ((NEARER, width < 0), (FARTHER, width > 0)):
            ax.barh(y[chosen], width[chosen], 0.62, **look)
        ax.axvline(0, color=INK, lw=0.7)
        row_panel(ax, f"{title}\n(as taken: {effects.loc[AS_TAKEN, f'misfit_{table}']:.3f})")
    axes[0].set_xscale("symlog", linthresh=LINEAR, linscale=0.6)
    fixed_ticks(axes[0].xaxis, [-0.1, -0.01, 0, 0.01, 0.1, 1])
    unsettled = effects.loc[shown.index, "no_number"] > effects.loc[AS_TAKEN, "no_number"]
    names = [alternative_name(str(name)) + " *" * bool(unsettled[name]) for name in shown.index]
    note = "; * some settling runs do not come to rest" * bool(unsettled.any())
    name_rows(fig, axes[0], y, names, "Change of the root mean square of ln(reproduced / printed)" + note)
    axes[0].set_ylim(-0.7, max(len(shown), 1) - 0.3)
    patches = [Patch(label="nearer to the print", **NEARER), Patch(label="farther from it", **FARTHER)]
    fig.legend(handles=patches, loc="outside upper center", ncols=2)
    return fig
