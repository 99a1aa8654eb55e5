"""Figures of a record and of its fit: signals, and pressures with residuals."""

from matplotlib.figure import Figure

from pneumo.fitting.fit_result import FitResult
from pneumo.fitting.record.measurement import Measurement
from pneumo.publish.style import (
    ACCENT,
    DOUBLE_MM,
    GREY,
    INK,
    PALE,
    SCREEN_MM,
    axis_label,
    new_figure,
    paper_style,
)
from pneumo.publish.text.formatting import KILO

MOST_SAMPLES = 4000  # of a curve that are drawn; more would not show


@paper_style()
def record_figure(record: Measurement) -> Figure:
    """Signals of a record as the fit reads them: command or flows, position and pressures."""
    fig = new_figure(DOUBLE_MM, 110)
    panels = fig.subplots(3, 1, sharex=True, height_ratios=[1, 1, 2])
    every = max(1, len(record.t) // MOST_SAMPLES)
    t = record.t[::every]
    if record.m is None:
        panels[0].plot(t, record.u[::every], color=INK, lw=0.6)
        panels[0].set_ylabel(axis_label("$u$", "V"))
    else:
        for flow, chamber, color in zip(record.m, "AB", (ACCENT, INK), strict=True):
            panels[0].plot(t, flow[::every] * KILO, color=color, lw=0.6, label=f"into {chamber}")
        panels[0].set_ylabel(axis_label("flow", "g/s"))
    panels[1].plot(t, record.x[::every] * KILO, color=INK, lw=0.6)
    panels[1].set_ylabel(axis_label("$x$", "mm"))
    curves = [("P_A", record.P[0], ACCENT), ("P_B", record.P[1], INK)]
    curves += [] if record.P_s is None else [("P_s", record.P_s, GREY)]
    for name, pressure, color in curves:
        panels[2].plot(t, pressure[::every] / KILO, color=color, lw=0.6, label=f"${name}$")
    panels[2].set_ylabel(axis_label("pressure", "kPa"))
    if record.m is not None:
        panels[0].legend(loc="upper right", ncols=4)
    panels[2].legend(loc="upper right", ncols=4)
    panels[2].set_xlabel(axis_label("$t$", "s"))
    panels[2].set_xlim(t[0], t[-1])
    return fig


@paper_style()
def residual_figure(fit: FitResult) -> Figure:
    """Measured and replayed pressures of the best model, with residuals; shaded: not fitted."""
    data, best = fit.data, fit.models[0]
    fig = new_figure(SCREEN_MM, 120)
    panels = fig.subplots(4, 1, sharex=True, height_ratios=[2, 1, 2, 1])
    every = max(1, data.sizes["t"] // MOST_SAMPLES)
    t = data["t"].values[::every]
    for side, chamber in enumerate("AB"):
        measured = data["P"].sel(chamber=chamber).values[::every]
        replayed = data["pressure"].sel(chamber=chamber, model=best).values[::every]
        above, below = panels[2 * side], panels[2 * side + 1]
        above.plot(t, measured / KILO, color="#c8c8c8", lw=2.4, label="measured")
        above.plot(t, replayed / KILO, color=ACCENT, lw=0.9, label=best)
        above.set_ylabel(axis_label(f"$P_{chamber}$", "kPa"))
        below.plot(t, (measured - replayed) / KILO, color=INK, lw=0.4)
        below.axhline(0.0, color=GREY, lw=0.5)
        below.set_ylabel(axis_label("residual", "kPa"))
    for ax in panels:
        ax.axvspan(fit.held_out_from, data["t"].values[-1], color=PALE, lw=0, zorder=0)
    panels[0].legend(loc="upper left", ncols=2, bbox_to_anchor=(0.0, 1.18))
    panels[-1].set_xlabel(axis_label("$t$", "s"))
    panels[-1].set_xlim(t[0], t[-1])
    return fig
