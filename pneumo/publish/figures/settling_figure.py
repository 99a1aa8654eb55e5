"""Fig. 7: how a settling time is read off."""

import json

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pneumo.publish.figures.panels import message_figure
from pneumo.publish.style import DOUBLE_MM, GREY, INK, axis_label, new_figure, paper_style
from pneumo.publish.text.formatting import KILO
from pneumo.simulation.settling import CRITERION
from pneumo.storage.layout import failure_text


@paper_style()
def fig07(settling: xr.Dataset) -> Figure:
    """Fig. 7: how a settling time is read off, for one file of ``results/settling``; the paper shows E14.

    Force, position, and pressure and temperature of both chambers against time.
    """
    release = settling["release_time"].item()
    if settling["status"]:
        return message_figure(f"{settling['experiment'].item()}: {failure_text(settling, 'settling run')}")
    end = release + 1.5 * settling["settling_time"].max().item()
    shown = settling.sel(t=slice(0, end))
    push = json.loads(settling.attrs["experiment_parameters"])["push"]

    fig = new_figure(DOUBLE_MM, 132)
    axes = fig.subplots(3, 2, sharex=True)
    force, position = axes[0]
    force.plot([0, release, release, end], [push["force"], push["force"], 0, 0], color=INK)
    force.set_ylabel(axis_label("Force", "N"))
    force.annotate("release", (release, 0.5), (4, 0), ("data", "axes fraction"), "offset points", va="center")
    position.plot(shown["t"], shown["x"] * KILO, color=INK, lw=0.8)
    position.set_ylabel(axis_label("$x$", "mm"))
    for row, chamber in enumerate(settling["chamber"].values, start=1):
        for ax, quantity, unit, scale in zip(axes[row], "PT", ("kPa", "K"), (KILO, 1.0), strict=True):
            name = f"{quantity}_{chamber}"
            ax.set_ylabel(axis_label(f"${name}$", unit))
            series = settling[quantity].sel(chamber=chamber) / scale
            _settling_panel(ax, series, quantity, release, end, settling["settling_time"].sel(quantity=name))
    for letter, ax in zip("abcdef", axes.flat, strict=True):
        ax.axvline(release, color=GREY, lw=0.6, ls=(0, (4, 2)), zorder=0)
        ax.set_title(f"({letter})", loc="left")
        ax.set_xlim(0, end)
    for ax in axes[-1]:
        ax.set_xlabel(axis_label("$t$", "s"))
    fig.align_ylabels()
    return fig


def _settling_panel(
    ax: Axes, series: xr.DataArray, quantity: str, release: float, end: float, settling_time: xr.DataArray
) -> None:
    """Draw one trace with its change, its 1 per cent band and its settling time."""
    free = series.sel(t=slice(release, None))
    final = free[-1].item()
    # As in `pneumo.simulation.settling`: delta P from the release, delta T from the largest excursion.
    extreme = free[0] if quantity == "P" else free[np.abs(free.values - final).argmax()]
    start, t_start, t_s = extreme.item(), extreme["t"].item(), settling_time.item()
    band = CRITERION * abs(start - final)

    shown = series.sel(t=slice(0, end))
    low, high = shown.min().item(), shown.max().item()
    room = (high - low) or 1.0
    ax.set_ylim(low - 0.08 * room, high + 0.34 * room)  # the strip above the data carries the settling time
    ax.axhspan(final - band, final + band, color="#b5b5b5", lw=0, zorder=0.5)
    ax.plot(shown["t"], shown, color=INK, lw=0.8)

    both = {"arrowstyle": "<|-|>", "color": INK, "lw": 0.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 6}
    x = t_start - 0.03 * end if quantity == "P" else t_start
    ax.annotate("", (x, start), (x, final), arrowprops=both)
    ax.plot([x - 0.02 * end, release], [final, final], color=GREY, lw=0.5)
    ax.text(
        min(x, release) - 0.015 * end, (start + final) / 2, rf"$\Delta {quantity}$", ha="right", va="center"
    )
    top = high + 0.1 * room
    ax.plot([release + t_s] * 2, [final, top], color=GREY, lw=0.6, ls=(0, (1.2, 1.2)))
    ax.annotate("", (release, top), (release + t_s, top), arrowprops=both)
    ax.text(release + t_s / 2, top + 0.03 * room, f"$t_s$ = {t_s:.3f} s", ha="center", va="bottom")
    ax.text(end, final + band, r"$\pm$1 %", ha="right", va="bottom", fontsize=7.5)
