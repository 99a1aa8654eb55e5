"""Figure of the identification: profiles, regions, amplitudes, force and signal sampling."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pneumo.evidence.identification.deviance import REGION_THRESHOLD, THRESHOLD
from pneumo.publish.figures.panels import fixed_ticks
from pneumo.publish.labels import SAMPLING
from pneumo.publish.style import ACCENT, DOUBLE_MM, GREY, INK, SOURCE_BAR, axis_label, new_figure, paper_style
from pneumo.publish.text.formatting import ends_text, significant
from pneumo.publish.text.terminal_tables import IDENTIFIED_UNIT

SYMBOL = {"M": "$M$", "k_f": "$k_f$", "stop": "stop / half-stroke"}
LINE: dict[str, dict[str, Any]] = {
    "D": {"color": ACCENT, "marker": "o", "markersize": 2.4, "lw": 0.9},
    "E": {"color": "#b8480b", "marker": "D", "markersize": 2.4, "lw": 0.9},
}
BAND = "#d9e4f1"
TOP = 12.0  # deviance at the upper edge of a panel


@paper_style()
def identification_figure(identified: xr.Dataset) -> Figure:
    """Draw profiles, regions, amplitudes, force and signal sampling, from ``results/identification.nc``.

    A row per cylinder: profiles of M, k_f and stop, region of M and k_f; below, both cylinders together.
    """
    fig = new_figure(DOUBLE_MM, 158)
    by_cylinder, both = fig.subfigures(2, 1, height_ratios=[2, 1])  # pyright: ignore[reportGeneralTypeIssues]
    panels = by_cylinder.subplots(2, 4)
    for row, cylinder in enumerate(identified["cylinder"].values):
        part = identified.sel(cylinder=cylinder)
        for column, parameter in enumerate(identified["parameter"].values):
            _profile(panels[row, column], part.sel(parameter=parameter))
        panels[row, 0].set_ylabel(f"Cylinder {cylinder}: deviance")
        _region(panels[row, 3], part)
    amplitudes, force, samplings = both.subplots(1, 3, width_ratios=[1, 1, 1.5])
    _deviances(amplitudes, identified, "amplitude_value", "amplitude_deviance", [0.1, 1.0, 10.0])
    amplitudes.set(xlim=(0.05, 10.0), xlabel=axis_label("Amplitude", "V"), ylabel="Both: deviance")
    amplitudes.set_title("open loop", loc="left")
    pushed = identified.assign(force=-identified["push_force"] * identified["force_ratio"])
    _deviances(force, pushed, "force", "force_deviance", [200, 500, 1000, 2000])
    force.set_xlabel(axis_label("Push force", "N"))
    force.set_title("settling runs", loc="left")
    _samplings(samplings, identified)
    for letter, ax in zip("abcdefghijk", [*by_cylinder.axes, *both.axes], strict=True):
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


def _deviances(ax: Axes, identified: xr.Dataset, x: str, deviance: str, ticks: list[float]) -> None:
    """Draw a deviance of both cylinders over x, where it is finite."""
    _threshold(ax)
    for cylinder in identified["cylinder"].values:
        part = identified.sel(cylinder=cylinder)
        y = part[deviance].where(np.isfinite(part[deviance]))
        ax.plot(part[x], y, label=cylinder, **LINE[cylinder])
    ax.set_xscale("log")
    ax.set_ylim(0, TOP)
    fixed_ticks(ax.xaxis, ticks)
    ax.legend(loc="upper right", handlelength=1.6)


def _samplings(ax: Axes, identified: xr.Dataset) -> None:
    """Draw the misfit of Tables 7 and 9 for each way to sample the signals."""
    y = np.arange(identified.sizes["transport"])[::-1]
    near: dict[str, Any] = {"textcoords": "offset points", "va": "center", "fontsize": 7.0}
    for shift, table, used, source in ((0.19, 7, "fitted", "reproduced"), (-0.19, 9, "scored", "published")):
        values = identified["transport_rms"].sel(table=table).values
        ax.barh(y + shift, values, 0.36, label=f"Table {table}, {used}", **SOURCE_BAR[source])
        for value, place in zip(values, y + shift, strict=True):
            ax.annotate(f"{value:.3f}", (value, place), (2, 0), **near)
    ax.set_xlim(0, 1.15 * identified["transport_rms"].max().item())
    ax.set_yticks(y, [SAMPLING[str(name)] for name in identified["transport"].values])
    ax.tick_params(axis="y", length=0)
    ax.set_xlabel("rms of ln(reproduced / published MSE)")
    ax.legend(loc="upper right")
    ax.set_title("signal sampling", loc="left")
