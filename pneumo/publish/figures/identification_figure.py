"""Figure of the identification: profiles and regions of the mechanics, and the push force."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pneumo.evidence.identification.deviance import REGION_THRESHOLD, THRESHOLD
from pneumo.publish.figures.panels import fixed_ticks
from pneumo.publish.style import ACCENT, DOUBLE_MM, GREY, INK, axis_label, new_figure, paper_style
from pneumo.publish.text.formatting import ends_text, significant
from pneumo.publish.text.terminal_tables import IDENTIFIED_UNIT

SYMBOL = {"M": "$M$", "k_f": "$k_f$", "stop": "stop / half-stroke"}
BAND = "#d9e4f1"
TOP = 12.0  # deviance at the upper edge of a panel


@paper_style()
def identification_figure(identified: xr.Dataset) -> Figure:
    """Draw a row per cylinder from ``results/identification.nc``.

    Profiles of M, k_f and stop, region of M and k_f, and how well other push forces fit.
    """
    fig = new_figure(DOUBLE_MM, 105)
    panels = fig.subplots(2, 5)
    pushed = identified.assign(force=-identified["push_force"] * identified["force_ratio"])
    for row, cylinder in zip(panels, identified["cylinder"].values, strict=True):
        part = pushed.sel(cylinder=cylinder)
        for ax, parameter in zip(row, identified["parameter"].values, strict=False):
            _profile(ax, part.sel(parameter=parameter))
        row[0].set_ylabel(f"Cylinder {cylinder}: deviance")
        _region(row[3], part)
        _push_force(row[4], part)
    for letter, ax in zip("abcdefghij", panels.flat, strict=True):
        ax.set_title(f"({letter}) {ax.get_title(loc='left')}", loc="left", fontsize=8.0)
    return fig


def _threshold(ax: Axes, value: float = THRESHOLD) -> None:
    ax.axhline(value, color=GREY, lw=0.6, ls=(0, (4, 2)), zorder=0.5)


def _profile(ax: Axes, part: xr.Dataset) -> None:
    """Draw the profile of one parameter with its interval."""
    name = part["parameter"].item()
    low, high, estimate = (part[key].item() for key in ("low", "high", "estimate"))
    ax.axvspan(low, high, color=BAND, lw=0, zorder=0)
    _threshold(ax)
    ax.plot(part["profile_value"], part["profile_deviance"], color=INK, marker=".", markersize=3.0, lw=0.9)
    ax.set_ylim(0, TOP)
    room = 0.6 * (high - low)
    if np.isfinite(room):
        ax.set_xlim(low - room, high + room)
    ax.xaxis.set_major_locator(MaxNLocator(3))
    ax.set_xlabel(axis_label(SYMBOL[name], IDENTIFIED_UNIT[name]))
    ax.set_title(f"{significant(estimate)}, {ends_text(low, high)}", loc="left")


def _region(ax: Axes, part: xr.Dataset) -> None:
    """Draw the region of M and k_f / M, the combination that the settling times determine best."""
    x, y = part["region_M"].values, part["region_ratio"].values
    deviance = part["region_deviance"].values.T
    ax.contourf(x, y, deviance, levels=[-1.0, REGION_THRESHOLD], colors=[BAND])
    ax.contour(x, y, deviance, levels=[REGION_THRESHOLD], colors=[ACCENT], linewidths=0.9)
    M, k_f = part["estimate"].sel(parameter=["M", "k_f"]).values
    ax.plot(M, k_f / M, ls="none", marker="+", color=INK, markersize=6)
    ax.xaxis.set_major_locator(MaxNLocator(3))
    ax.yaxis.set_major_locator(MaxNLocator(5))
    ax.set(xlabel=axis_label("$M$", "kg"), ylabel=axis_label("$k_f / M$", "1/s"))
    ax.set_title(f"95 %, $r(M, k_f)$ = {part['correlation'].item():.3f}", loc="left")


def _push_force(ax: Axes, part: xr.Dataset) -> None:
    """Draw the lowest deviance over the push force of the settling runs, where it is finite."""
    _threshold(ax)
    deviance = part["force_deviance"].where(np.isfinite(part["force_deviance"]))
    ax.plot(part["force"], deviance, color=INK, marker=".", markersize=3.0, lw=0.9)
    ax.set_xscale("log")
    ax.set_ylim(0, TOP)
    fixed_ticks(ax.xaxis, [200, 500, 1000, 2000])
    ax.set_xlabel(axis_label("Push force", "N"))
