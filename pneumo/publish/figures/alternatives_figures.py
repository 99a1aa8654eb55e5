"""Figures of alternative assumptions: effects on the agreement with tables and on gains of refinements."""

import re
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from pneumo.publish.figures.panels import ABOVE, fixed_ticks, legend_outside, name_rows, row_panel, symbol
from pneumo.publish.labels import SAMPLING
from pneumo.publish.style import ACCENT, DOUBLE_MM, INK, new_figure, paper_style
from pneumo.verdict.assumptions import AS_TAKEN

TOGGLE_PANELS = {7: "Table 7, MSE", 9: "Table 9, MSE", 5: "Table 5, settling times"}
LEAST = 1e-3  # an effect that is smaller in all panels gets no row
LINEAR = 0.01  # changes up to this are drawn to scale, larger ones by their logarithm
NEARER: dict[str, Any] = {"facecolor": ACCENT, "edgecolor": INK, "linewidth": 0.5}
FARTHER: dict[str, Any] = {"facecolor": "#cfcfcf", "edgecolor": INK, "linewidth": 0.5}


CLEARER = {  # than the words of the name alone
    AS_TAKEN: "as taken",
    "end_stop_law.no_rest_rule": "stops without rest",
    "equilibrium_ratio.exact_root": "start at exact $P_0$",
    "friction_law.coulomb": "Coulomb friction",
    "reversal_late.half_late": "reversals half late",
    "reversal_late.on_time": "reversals on time",
    "sonic_constant.exact_coefficient": "exact sonic constant",
    "transport.exact_transport": SAMPLING["exact"],
    "valve.leak": "leaking valve",
    "valve.elliptic": "elliptic flow law",
}
SAMPLED = {"linear": SAMPLING["linear"], "hold": SAMPLING["hold"], "next": "next value"}


def alternative_name(alternative: str) -> str:
    """Return the name of an alternative in plain words, after its assumption where it is not clear alone.

    Examples
    --------
    >>> [alternative_name(name) for name in ("step.step_0_5_ms", "supply.4_bar", "transport.all_hold")]
    ['step 0.5 ms', 'supply 4 bar', 'all held']
    """
    assumption, _, name = alternative.partition(".")
    words = re.sub(r"(?<=\d)_(?=\d)", ".", name).split("_")
    if assumption.startswith("transport"):
        words = [SAMPLED.get(word, word) for word in words]
    elif assumption in ("supply", "inlet"):
        words = [assumption, *words]
    return CLEARER.get(alternative, " ".join(words))


@paper_style()
def tornado(effects: pd.DataFrame) -> Figure:
    """Draw the change of the misfit of Tables 7, 9 and 5 under each alternative, the largest on top.

    A bar to the left: closer to the printed numbers. `effects` is the table of
    `pneumo.evidence.sensitivity.toggle_effects.toggle_effects`.
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
    note = "; * some settling runs never come to rest" * bool(unsettled.any())
    name_rows(fig, axes[0], y, names, "Change of the root mean square of ln(reproduced / printed)" + note)
    axes[0].set_ylim(-0.7, max(len(shown), 1) - 0.3)
    looks = {"closer to the printed values": NEARER, "farther from them": FARTHER}
    patches = [Patch(label=label, **look) for label, look in looks.items()]
    fig.legend(handles=patches, loc=ABOVE, ncols=2)
    return fig


LEVEL_MARKS = {
    "adiabatic": {"marker": "o", "markerfacecolor": ACCENT},
    "typical": {"marker": "s", "markerfacecolor": "#cfcfcf"},
    "isothermal": {"marker": "^", "markerfacecolor": "white"},
}
TICKS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0)


@paper_style()
def variants_figure(variants: xr.Dataset) -> Figure:
    """Draw mean square errors with a refinement over those without, from ``results/variants.nc``.

    Exact signals, mean over experiments. A panel per refinement, a row per alternative, a mark per level;
    left of the line the refinement pays.
    """
    ratio = variants["ratio"].sel(transport="exact", criterion="mean")
    names = [str(name) for name in variants["alternative"].values]
    y = np.arange(len(names))[::-1]
    fig = new_figure(DOUBLE_MM, 28 + 4.0 * len(names))
    axes = fig.subplots(1, variants.sizes["pair"], sharey=True, squeeze=False)[0]
    for ax, pair in zip(axes, variants["pair"].values, strict=True):
        by_level = ratio.sel(pair=pair)
        ax.axvline(1.0, color=INK, linewidth=0.7)
        for level, look in LEVEL_MARKS.items():
            if level in by_level["level"]:
                values = by_level.sel(level=level).values
                ax.plot(values, y, linestyle="none", markeredgecolor=INK, markersize=3.6, label=level, **look)
        ax.set_xscale("log")
        fixed_ticks(ax.xaxis, TICKS)
        ax.grid(axis="both")
        ax.set_title(" / ".join(f"MSE of {symbol(model)}" for model in str(pair).split("/")))
        ax.tick_params(axis="y", length=0)
    xlabel = "Ratio of mean square errors, exact signals; below 1 the refinement pays"
    name_rows(fig, axes[0], y, [alternative_name(name) for name in names], xlabel)
    axes[0].set_ylim(-0.7, len(names) - 0.3)
    legend_outside(fig, axes[0], columns=len(LEVEL_MARKS))
    return fig
