"""Figure of a rig's fit: a run as measured and as models replay it, their errors, and all models' errors."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from pneumo.publish.figures.panels import one_two_five
from pneumo.publish.model_looks import FULL_ORDER_LOOK, MODEL_LOOKS
from pneumo.publish.style import ACCENT, DOUBLE_MM, GREY, INK, PALE, axis_label, new_figure, paper_style
from pneumo.publish.text.formatting import KILO

MOST_DRAWN = 3  # models whose curves are drawn


def ranked(result: xr.Dataset) -> list[str]:
    """Names of the models, lowest error on the part held out first."""
    return [str(name) for name in result["model"].values[np.argsort(result["held_out"].values)]]


def _look(model: str) -> dict[str, Any]:
    """Keywords for `Axes.plot`: colour, style and width of a model's line."""
    if model in MODEL_LOOKS:
        return MODEL_LOOKS[model].line() | {"lw": 0.9}
    line = {"adiabatic": ":", "eq (7)": "--"}.get(model.partition(", ")[2], "-")
    return {"color": FULL_ORDER_LOOK.color, "linestyle": line, "lw": 0.9}


@paper_style()
def rig_figure(result: xr.Dataset) -> Figure:
    """Draw a result with replays: pressures and errors of its best models, temperature, errors of all.

    Curves: the two best models and, for comparison, the worst. Shaded: the part held out.
    """
    models = ranked(result)
    drawn = list(dict.fromkeys([*models[: MOST_DRAWN - 1], models[-1]]))
    chambers, has_T = result["chamber"].values, "measured_T" in result
    rows = 2 * len(chambers) + has_T
    fig = new_figure(DOUBLE_MM, max(38 * rows, 25 + 5 * len(models)))
    axes = fig.subplot_mosaic([[f"{row}", "errors"] for row in range(rows)], width_ratios=[1.6, 1])
    t = result["t"].values
    for place, chamber in enumerate(chambers):
        above, below = axes[f"{2 * place}"], axes[f"{2 * place + 1}"]
        measured = result["measured_P"].sel(chamber=chamber).values
        few: dict[str, Any] = {"marker": "o", "markersize": 2.0, "lw": 0} if len(t) < 200 else {"lw": 0.6}
        above.plot(t, measured / KILO, color=GREY, label="measured", zorder=3, **few)
        for model in drawn:
            P = result["replayed_P"].sel(chamber=chamber, model=model).values
            above.plot(t, P / KILO, label=model, **_look(model))
            below.plot(t, (P - measured) / KILO, **_look(model))
        below.axhline(0.0, color=INK, lw=0.4)
        above.set_ylabel(axis_label(f"$P_{chamber}$", "kPa"))
        below.set_ylabel(axis_label("error", "kPa"))
    if has_T:
        ax, t_T = axes[f"{rows - 1}"], result["t_T"].values
        ax.plot(t_T, result["measured_T"].values, color=GREY, marker="o", markersize=2.5, lw=0)
        for model in drawn:
            ax.plot(t_T, result["replayed_T"].sel(model=model).values, **_look(model))
        ax.set_ylabel(axis_label("$T$", "K"))
    for row in range(rows):
        ax = axes[f"{row}"]
        ax.set_xlim(min(0.0, t[0]), t[-1])
        if result.attrs["fitted_until"] < t[-1]:
            ax.axvspan(result.attrs["fitted_until"], t[-1], color=PALE, lw=0, zorder=0)
    axes["0"].legend(loc="lower left", ncols=2, bbox_to_anchor=(0.0, 1.0))
    axes[f"{rows - 1}"].set_xlabel(axis_label("$t$", "s"))
    _errors(axes["errors"], result, models)
    return fig


def _errors(ax: Any, result: xr.Dataset, models: list[str]) -> None:
    """Draw the errors of all models on the part fitted and on the part held out."""
    for place, model in enumerate(models):
        fitted, held_out = (result[name].sel(model=model).item() / KILO for name in ("fitted", "held_out"))
        color = ACCENT if place == 0 else INK
        ax.plot([fitted, held_out], [place, place], color=GREY, lw=0.6, zorder=1)
        ax.plot(fitted, place, ls="none", marker="o", markerfacecolor="white", markeredgecolor=color)
        ax.plot(held_out, place, ls="none", marker="o", color=color)
    ax.set_yticks(range(len(models)), models)
    ax.invert_yaxis()
    ax.set_xscale("log")
    one_two_five(ax.xaxis)
    ax.set_xlabel(axis_label("rms error; filled: held out", "kPa"))
