"""Figure of a run: command, position, velocity, pressures and temperatures."""

import xarray as xr
from matplotlib.figure import Figure

from pneumo.publish.style import ACCENT, DOUBLE_MM, GREY, INK, axis_label, new_figure, paper_style
from pneumo.publish.text.formatting import KILO


@paper_style()
def run_figure(run: xr.Dataset) -> Figure:
    """Signals of a run over time; `run` has u, x, v, P and T as `pneumo.runs.Run.to_xarray` gives them."""
    fig = new_figure(DOUBLE_MM, 150)
    panels = fig.subplots(5, 1, sharex=True, height_ratios=[1, 2, 2, 3, 2])
    t, chambers = run["t"], tuple(zip("AB", (ACCENT, INK), strict=True))
    panels[0].axhline(0, color=GREY, lw=0.4)
    panels[0].plot(t, run["u"], color=INK, lw=0.8, drawstyle="steps-post")
    if "u_B" in run:
        panels[0].plot(t, run["u_B"], color=GREY, lw=0.8, drawstyle="steps-post")
    panels[1].plot(t, run["x"] * KILO, color=INK, lw=0.8)
    panels[2].plot(t, run["v"], color=INK, lw=0.8)
    for chamber, color in chambers:
        of = run.sel(chamber=chamber)
        panels[3].plot(t, of["P"] / KILO, color=color, lw=0.8, label=f"chamber {chamber}")
        panels[4].plot(t, of["T"], color=color, lw=0.8)
    labels = (("$u$", "V"), ("$x$", "mm"), (r"$\dot{x}$", "m/s"), ("$P$", "kPa"), ("$T$", "K"))
    for ax, (quantity, unit) in zip(panels, labels, strict=True):
        ax.set_ylabel(axis_label(quantity, unit))
    panels[3].legend(loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0, ncols=2)
    panels[-1].set_xlabel(axis_label("$t$", "s"))
    panels[-1].set_xlim(float(t[0]), float(t[-1]))
    return fig
