"""What `pneumo fit` found: a table for the terminal, figures and one self-contained page."""

import base64
import io
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.table import Table

from pneumo.publish.figures.identification_figure import ends, number
from pneumo.publish.model_looks import MODEL_STYLE
from pneumo.publish.pages.verdict_page import page_environment
from pneumo.publish.style import (
    ACCENT,
    DOUBLE_MM,
    GREY,
    INK,
    PALE,
    axis_label,
    new_figure,
    paper_style,
)

KILO = 1e3
SHOWN_AS = {  # parameter -> heading, unit, factor from SI
    "n": ("n", "", 1.0),
    "k_0": ("k_0", "W/K", 1.0),
    "k_xu": ("k_x k_u", "mm²/V", 1e6),
    "V_d_A": ("V_d of A", "cm³", 1e6),
    "V_d_B": ("V_d of B", "cm³", 1e6),
}
LONGEST = 4000  # samples of a curve that are drawn; more would not show


def headings() -> list[str]:
    """Column headings of both tables."""
    named = [f"{name} ({unit})" if unit else name for name, unit, _ in SHOWN_AS.values()]
    return ["model", "rms held out (kPa)", "rms fitted (kPa)", *named]


def rows(found: xr.Dataset) -> list[list[str]]:
    """Cells of both tables, a row per model, best first; at an open end the data set no limit."""
    result = []
    for model in found["model"].values:
        own = found.sel(model=model)
        row = [str(model)]
        row += [f"{rms(own[name]) / KILO:.3g}" for name in ("rms_held_out", "rms_fitted")]
        for parameter, (_, _, factor) in SHOWN_AS.items():
            best, low, high = (
                factor * own[k].sel(parameter=parameter).item() for k in ("estimate", "low", "high")
            )
            row.append("" if np.isnan(best) else f"{number(best)} ({ends(low, high)})")
        result.append(row)
    return result


def rms(by_chamber: xr.DataArray) -> float:
    """Root mean square of both chambers together."""
    return float(np.sqrt(np.mean(by_chamber.values**2)))


def fit_table(found: xr.Dataset) -> Table:
    """Ranking, estimates and 95 per cent intervals for the terminal."""
    table = Table(*headings(), title="Ranked by error on the part held out; in brackets 95 % intervals")
    for row in rows(found):
        table.add_row(*row)
    return table


@paper_style()
def fit_figure(found: xr.Dataset) -> Figure:
    """Measured and replayed pressures of the best model, residuals, and the ranking.

    Parameters
    ----------
    found : xarray.Dataset
        From `pneumo.engineer.estimate.fit_measurement`.
    """
    best = str(found["model"].values[0])
    fig = new_figure(DOUBLE_MM, 150)
    panels = fig.subplots(4, 1, sharex=True, height_ratios=[2, 1, 2, 1])
    every = max(1, found.sizes["t"] // LONGEST)
    t = found["t"].values[::every]
    for side, chamber in enumerate("AB"):
        measured = found["P"].sel(chamber=chamber).values[::every]
        replayed = found["pressure"].sel(chamber=chamber, model=best).values[::every]
        above, below = panels[2 * side], panels[2 * side + 1]
        above.plot(t, measured / KILO, color=GREY, lw=0.5, label="measured")
        above.plot(t, replayed / KILO, color=ACCENT, lw=0.9, label=best)
        above.set_ylabel(axis_label(f"$P_{chamber}$", "kPa"))
        below.plot(t, (measured - replayed) / KILO, color=INK, lw=0.4)
        below.axhline(0.0, color=GREY, lw=0.5)
        below.set_ylabel(axis_label("residual", "kPa"))
    for ax in panels:
        _held_out(ax, found)
    panels[0].legend(loc="upper left", ncols=2, bbox_to_anchor=(0.0, 1.18))
    panels[-1].set_xlabel(axis_label("$t$", "s"))
    panels[-1].set_xlim(t[0], t[-1])
    return fig


def _held_out(ax: Axes, found: xr.Dataset) -> None:
    """Shade what was not fitted."""
    ax.axvspan(found.attrs["held_out_from"], found["t"].values[-1], color=PALE, lw=0, zorder=0)


@paper_style()
def ranking_figure(found: xr.Dataset) -> Figure:
    """Error of every model on the part fitted and on that held out."""
    models = [str(name) for name in found["model"].values]
    fig = new_figure(DOUBLE_MM, 20 + 5 * len(models))
    ax = fig.subplots()
    for place, model in enumerate(models):
        own, color = found.sel(model=model), MODEL_STYLE[model].color if model in MODEL_STYLE else INK
        fitted, left = rms(own["rms_fitted"]) / KILO, rms(own["rms_held_out"]) / KILO
        ax.plot([fitted, left], [place, place], color=GREY, lw=0.6, zorder=1)
        ax.plot(fitted, place, ls="none", marker="o", markerfacecolor="white", markeredgecolor=color)
        ax.plot(left, place, ls="none", marker="o", color=color)
    ax.set_yticks(range(len(models)), models)
    ax.invert_yaxis()
    ax.set_xscale("log")
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter("{x:g}")
    ax.set_xlabel(axis_label("root mean square error; open: fitted, filled: held out", "kPa"))
    return fig


def _inline(fig: Figure) -> str:
    """A figure as the source of an image."""
    buffer = io.BytesIO()
    with paper_style():
        fig.savefig(buffer, format="png", metadata={"Software": None})
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode()


def fit_page(found: xr.Dataset, name: str) -> str:
    """Write the page: table, figures and notes, with nothing from elsewhere.

    Parameters
    ----------
    found : xarray.Dataset
        From `pneumo.engineer.estimate.fit_measurement`.
    name : str
        Of the measurement.
    """
    return (
        page_environment()
        .get_template("fit.html.j2")
        .render(
            name=name,
            headings=headings(),
            rows=rows(found),
            samples=found.sizes["t"],
            duration=f"{found['t'].values[-1]:.4g}",
            held_out_from=f"{found.attrs['held_out_from']:.4g}",
            notes=[note for note in str(found.attrs["notes"]).split("\n") if note],
            pressures=_inline(fit_figure(found)),
            ranking=_inline(ranking_figure(found)),
        )
    )


def transient_text(found: Any) -> str:
    """What a closed chamber's transient tells, on three lines.

    Parameters
    ----------
    found : pneumo.engineer.closed_chamber.Transient
    """
    return "\n".join(
        [
            f"thermal time constant  {number(found.tau)} s ({ends(found.tau_low, found.tau_high)})",
            f"conductance now        {number(found.k)} W/K, at {found.P_inf / KILO:.4g} kPa",
            f"k_0, eqs (7) and (8)   {number(found.k_0)} W/K ({ends(found.k_0_low, found.k_0_high)});"
            f" {found.rms:.3g} Pa rms are left",
        ]
    )
