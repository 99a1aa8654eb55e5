"""Figures of measured conductances: a closed chamber's response with its fit; coefficients over V / A_q."""

from typing import Any

import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from pneumo.publish.style import ACCENT, GREY, INK, PALE, SINGLE_MM, axis_label, new_figure, paper_style

MARKS = {"1": "o", "2": "s"}  # experiments of a cylinder
MM = 1e3


@paper_style()
def simulated_example(example: xr.Dataset) -> Figure:
    """Draw the simulated pressure, its exponential fit and the residual, from ``2007/example.nc``."""
    fig = new_figure(SINGLE_MM, 82)
    top, bottom = fig.subplots(2, 1, sharex=True, height_ratios=[3, 1])
    t = example["t"]
    top.plot(t, example["P"] / 1e5, color=INK, label="simulated")
    top.plot(t, example["fitted"] / 1e5, color=ACCENT, linestyle=(0, (2.4, 1.2)), label="exponential fit")
    top.set_ylabel(axis_label("$P$", "$10^5$ Pa"))
    top.legend(loc="upper right")
    bottom.axhline(0.0, color=GREY, linewidth=0.6)
    bottom.plot(t, example["P"] - example["fitted"], color=INK)
    bottom.set_ylabel(axis_label("residual", "Pa"))
    bottom.set_xlabel(axis_label("time from the peak", "s"))
    fig.align_ylabels()
    return fig


@paper_style()
def coefficients(trend: xr.Dataset) -> Figure:
    """Draw lambda_0 over V / A_q from ``2007/coefficients.nc``.

    Error bars: rounding of the printed inputs. Band: the catalogue's prediction. Also the range studied in
    2006 and the coefficient quoted for a 160 mm cylinder.
    """
    fig = new_figure(SINGLE_MM, 84)
    ax = fig.subplots()
    length = trend["length"] * MM
    ax.fill_between(
        length, trend["predicted_low"], trend["predicted_high"], color=PALE, label="95 % of cylinders"
    )
    ax.plot(length, trend["predicted"], color=GREY, label="catalogue")
    for x, (low, high), name in zip(
        trend["length_studied"].values * MM, trend["studied"].values, trend["cylinder"].values, strict=True
    ):
        ax.plot([x, x], [low, high], color=GREY, linewidth=3.0, alpha=0.5, solid_capstyle="butt")
        ax.annotate(f"2006, {name}", (x, high), ha="center", va="bottom")
    for experiment, mark in MARKS.items():
        of_experiment = trend.sel(column=[c for c in trend["column"].values if c.endswith(experiment)])
        # Printed values are rounded to a tenth and may lie outside the range that the inputs allow.
        bars = [
            (of_experiment["lambda_0"] - of_experiment["low"]).clip(0),
            (of_experiment["high"] - of_experiment["lambda_0"]).clip(0),
        ]
        look: dict[str, Any] = {"fmt": mark, "color": ACCENT, "markerfacecolor": "white", "capsize": 2.0}
        ax.errorbar(
            of_experiment["V_f_over_A_q"] * MM,
            of_experiment["lambda_0"],
            bars,
            label=f"experiment {experiment}",
            **look,
        )
    ax.plot(trend["length_quoted"] * MM, trend["quoted"], "^", color=INK, label="quoted (Det)")
    ax.set(xscale="log", yscale="log", xlabel=axis_label("$V/A_q$", "mm"))
    ax.set_ylabel(axis_label(r"$\lambda_0$", "W m$^{-2}$ K$^{-1}$"))
    ax.set_xticks([3, 5, 10, 20, 30])
    ax.xaxis.set_minor_formatter(NullFormatter())
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    fig.legend(loc="outside upper center", ncols=2)
    return fig
