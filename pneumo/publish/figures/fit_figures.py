"""Figures of `pneumo fit`: pressures of the best model with their residuals, and every model's error."""

from matplotlib.figure import Figure

from pneumo.fit.fit_result import FitResult, rms_of_chambers
from pneumo.publish.figures.panels import one_two_five
from pneumo.publish.model_looks import MODEL_LOOKS
from pneumo.publish.style import ACCENT, DOUBLE_MM, GREY, INK, PALE, axis_label, new_figure, paper_style
from pneumo.publish.text.formatting import KILO

MOST_SAMPLES = 4000  # of a curve that are drawn; more would not show


@paper_style()
def residual_figure(fit: FitResult) -> Figure:
    """Measured and replayed pressures of the best model, with residuals; shaded: not fitted."""
    data, best = fit.data, fit.models[0]
    fig = new_figure(DOUBLE_MM, 150)
    panels = fig.subplots(4, 1, sharex=True, height_ratios=[2, 1, 2, 1])
    every = max(1, data.sizes["t"] // MOST_SAMPLES)
    t = data["t"].values[::every]
    for side, chamber in enumerate("AB"):
        measured = data["P"].sel(chamber=chamber).values[::every]
        replayed = data["pressure"].sel(chamber=chamber, model=best).values[::every]
        above, below = panels[2 * side], panels[2 * side + 1]
        above.plot(t, measured / KILO, color=GREY, lw=0.5, label="measured")
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


@paper_style()
def held_out_figure(fit: FitResult) -> Figure:
    """Error of every model on the part fitted and on that held out."""
    fig = new_figure(DOUBLE_MM, 20 + 5 * len(fit.models))
    ax = fig.subplots()
    for place, model in enumerate(fit.models):
        part, color = fit.data.sel(model=model), MODEL_LOOKS[model].color if model in MODEL_LOOKS else INK
        errors = part["rms_fitted"], part["rms_held_out"]
        fitted, held_out = (rms_of_chambers(rms.values) / KILO for rms in errors)
        ax.plot([fitted, held_out], [place, place], color=GREY, lw=0.6, zorder=1)
        ax.plot(fitted, place, ls="none", marker="o", markerfacecolor="white", markeredgecolor=color)
        ax.plot(held_out, place, ls="none", marker="o", color=color)
    ax.set_yticks(range(len(fit.models)), fit.models)
    ax.invert_yaxis()
    ax.set_xscale("log")
    one_two_five(ax.xaxis)
    ax.set_xlabel(axis_label("root mean square error; open: fitted, filled: held out", "kPa"))
    return fig
