"""Figure of the identification: profiles, regions, amplitudes, force and transports."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullFormatter

from pneumo.evidence.misfit import REGION_THRESHOLD, THRESHOLD
from pneumo.publish.style import (
    ACCENT,
    DOUBLE_MM,
    GREY,
    INK,
    SOURCE_BAR,
    axis_label,
    new_figure,
    paper_style,
)
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
    """Profiles, regions, amplitudes, force and transports.

    Parameters
    ----------
    identified : xarray.Dataset
        ``results/identification.nc``, of both cylinders.

    Returns
    -------
    matplotlib.figure.Figure
        A row per cylinder: profiles of M, k_f and stop, region of M and k_f; below, what concerns both.
    """
    fig = new_figure(DOUBLE_MM, 158)
    own_rows, both = fig.subfigures(2, 1, height_ratios=[2, 1])  # pyright: ignore[reportGeneralTypeIssues]
    panels = own_rows.subplots(2, 4)
    for row, cylinder in enumerate(identified["cylinder"].values):
        part = identified.sel(cylinder=cylinder)
        for column, parameter in enumerate(identified["parameter"].values):
            ax = panels[row, column]
            _profile(ax, part.sel(parameter=parameter))
            if column == 0:
                ax.set_ylabel(f"Cylinder {cylinder}: deviance")
        _region(panels[row, 3], part)
    amplitudes, force, transports = both.subplots(1, 3, width_ratios=[1, 1, 1.5])
    _amplitudes(amplitudes, identified)
    _force(force, identified)
    _transports(transports, identified)
    for letter, ax in zip("abcdefghijk", [*own_rows.axes, *both.axes], strict=True):
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
    """Draw the region of M and k_f / M, on the axes along which the settling times determine most."""
    x, y = part["region_M"].values, part["region_ratio"].values
    deviance = part["region_deviance"].values.T
    ax.contourf(x, y, deviance, levels=[-1.0, REGION_THRESHOLD], colors=[BAND])
    ax.contour(x, y, deviance, levels=[REGION_THRESHOLD], colors=[ACCENT], linewidths=0.9)
    M, k_f = part["estimate"].sel(parameter=["M", "k_f"]).values
    ax.plot(M, k_f / M, ls="none", marker="+", color=INK, markersize=6)
    ax.xaxis.set_major_locator(MaxNLocator(3))
    ax.yaxis.set_major_locator(MaxNLocator(5))
    ax.set_xlabel(axis_label("$M$", "kg"))
    ax.set_ylabel(axis_label("$k_f / M$", "1/s"))
    ax.set_title(f"95 %, $r(M, k_f)$ = {part['correlation'].item():.3f}", loc="left")


def _amplitudes(ax: Axes, identified: xr.Dataset) -> None:
    """Draw the profile of both amplitudes over the whole of their bounds."""
    _threshold(ax)
    for cylinder in identified["cylinder"].values:
        part = identified.sel(cylinder=cylinder)
        deviance = part["amplitude_deviance"].where(np.isfinite(part["amplitude_deviance"]))
        ax.plot(part["amplitude_value"], deviance, label=cylinder, **LINE[cylinder])
    ax.set_xscale("log")
    ax.set_xlim(0.05, 10.0)
    ax.set_ylim(0, TOP)
    ax.xaxis.set_major_locator(FixedLocator([0.1, 1.0, 10.0]))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_xlabel(axis_label("Amplitude", "V"))
    ax.set_ylabel("Both: deviance")
    ax.legend(loc="upper right", handlelength=1.6)
    ax.set_title("open loop", loc="left")


def _force(ax: Axes, identified: xr.Dataset) -> None:
    """Draw the deviance over the push force."""
    _threshold(ax)
    for cylinder in identified["cylinder"].values:
        part = identified.sel(cylinder=cylinder)
        force = -part["push_force"] * part["force_ratio"]
        ax.plot(force, part["force_deviance"], label=cylinder, **LINE[cylinder])
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(FixedLocator([200, 500, 1000, 2000]))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_ylim(0, TOP)
    ax.set_xlabel(axis_label("Push force", "N"))
    ax.legend(loc="upper right", handlelength=1.6)
    ax.set_title("settling runs", loc="left")


def _transports(ax: Axes, identified: xr.Dataset) -> None:
    """Draw the misfit of Tables 7 and 9 for each transport."""
    y = np.arange(identified.sizes["transport"])[::-1]
    style = {7: SOURCE_BAR["reproduced"], 9: SOURCE_BAR["published"]}
    words = {7: "Table 7, fitted", 9: "Table 9, scored"}
    for shift, table in ((0.19, 7), (-0.19, 9)):
        values = identified["transport_rms"].sel(table=table).values
        ax.barh(y + shift, values, 0.36, label=words[table], **style[table])
        for value, place in zip(values, y + shift, strict=True):
            ax.annotate(
                f"{value:.3f}", (value, place), (2, 0), textcoords="offset points", va="center", fontsize=7.0
            )
    ax.set_xlim(0, 1.15 * identified["transport_rms"].max().item())
    ax.set_yticks(y, identified["transport"].values)
    ax.tick_params(axis="y", length=0)
    ax.set_xlabel("rms of ln(reproduced / published MSE)")
    ax.legend(loc="upper right")
    ax.set_title("transport of the signals", loc="left")
