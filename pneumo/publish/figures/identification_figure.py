"""What `pneumo identify` found, as a figure and as tables for the terminal."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullFormatter
from rich.table import Table

from pneumo.evidence.misfit import THRESHOLD, THRESHOLD_2
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

SYMBOL = {"M": "$M$", "k_f": "$k_f$", "stop": "stop / half-stroke"}
UNIT = {"M": "kg", "k_f": "N s/m", "stop": ""}
LINE: dict[str, dict[str, Any]] = {
    "D": {"color": ACCENT, "marker": "o", "markersize": 2.4, "lw": 0.9},
    "E": {"color": "#b8480b", "marker": "D", "markersize": 2.4, "lw": 0.9},
}
BAND = "#d9e4f1"
TOP = 12.0  # deviance at the upper edge of a panel


@paper_style()
def identification(found: xr.Dataset) -> Figure:
    """Profiles, regions, amplitudes, force and transports.

    Parameters
    ----------
    found : xarray.Dataset
        ``results/identification.nc``, of both cylinders.

    Returns
    -------
    matplotlib.figure.Figure
        A row per cylinder: profiles of M, k_f and stop, region of M and k_f; below, what concerns both.
    """
    fig = new_figure(DOUBLE_MM, 158)
    own_rows, both = fig.subfigures(2, 1, height_ratios=[2, 1])  # pyright: ignore[reportGeneralTypeIssues]
    panels = own_rows.subplots(2, 4)
    for row, cylinder in enumerate(found["cylinder"].values):
        own = found.sel(cylinder=cylinder)
        for column, parameter in enumerate(found["parameter"].values):
            ax = panels[row, column]
            _profile(ax, own.sel(parameter=parameter))
            if column == 0:
                ax.set_ylabel(f"Cylinder {cylinder}: deviance")
        _region(panels[row, 3], own)
    amplitudes, force, transports = both.subplots(1, 3, width_ratios=[1, 1, 1.5])
    _amplitudes(amplitudes, found)
    _force(force, found)
    _transports(transports, found)
    for letter, ax in zip("abcdefghijk", [*own_rows.axes, *both.axes], strict=True):
        ax.set_title(f"({letter}) {ax.get_title(loc='left')}", loc="left", fontsize=8.0)
    return fig


def number(value: float) -> str:
    """Three or, from 1 to 2, four digits.

    Examples
    --------
    >>> number(1.4987), number(99.76), number(0.30057), number(5.312)
    ('1.499', '99.8', '0.301', '5.31')
    """
    leading = f"{value:e}"[0]
    digits = 4 if leading == "1" else 3
    return f"{value:#.{digits}g}".rstrip(".")


def ends(low: float, high: float) -> str:
    """An interval; an end beyond what was searched is open.

    Examples
    --------
    >>> ends(1.4662, 1.511), ends(0.0, 1.1514)
    ('1.466 to 1.511', 'open to 1.151')
    """
    return " to ".join(number(end) if 0 < end < np.inf else "open" for end in (low, high))


def _threshold(ax: Axes, value: float = THRESHOLD) -> None:
    ax.axhline(value, color=GREY, lw=0.6, ls=(0, (4, 2)), zorder=0.5)


def _profile(ax: Axes, own: xr.Dataset) -> None:
    """Draw the profile of one parameter with its interval."""
    name = own["parameter"].item()
    low, high, estimate = (own[key].item() for key in ("low", "high", "estimate"))
    ax.axvspan(low, high, color=BAND, lw=0, zorder=0)
    _threshold(ax)
    ax.plot(own["profile_value"], own["profile_deviance"], color=INK, marker=".", markersize=3.0, lw=0.9)
    ax.set_ylim(0, TOP)
    room = 0.6 * (high - low)
    if np.isfinite(room):
        ax.set_xlim(low - room, high + room)
    ax.xaxis.set_major_locator(MaxNLocator(3))
    ax.set_xlabel(axis_label(SYMBOL[name], UNIT[name]))
    ax.set_title(f"{number(estimate)}, {ends(low, high)}", loc="left")


def _region(ax: Axes, own: xr.Dataset) -> None:
    """Draw the region of M and k_f / M, the direction in which the settling times tell most."""
    x, y = own["region_M"].values, own["region_ratio"].values
    deviance = own["region_deviance"].values.T
    ax.contourf(x, y, deviance, levels=[-1.0, THRESHOLD_2], colors=[BAND])
    ax.contour(x, y, deviance, levels=[THRESHOLD_2], colors=[ACCENT], linewidths=0.9)
    M, k_f = own["estimate"].sel(parameter=["M", "k_f"]).values
    ax.plot(M, k_f / M, ls="none", marker="+", color=INK, markersize=6)
    ax.xaxis.set_major_locator(MaxNLocator(3))
    ax.yaxis.set_major_locator(MaxNLocator(5))
    ax.set_xlabel(axis_label("$M$", "kg"))
    ax.set_ylabel(axis_label("$k_f / M$", "1/s"))
    ax.set_title(f"95 %, $r(M, k_f)$ = {own['correlation'].item():.3f}", loc="left")


def _amplitudes(ax: Axes, found: xr.Dataset) -> None:
    """Draw the profile of both amplitudes over the whole of their bounds."""
    _threshold(ax)
    for cylinder in found["cylinder"].values:
        own = found.sel(cylinder=cylinder)
        deviance = own["amplitude_deviance"].where(np.isfinite(own["amplitude_deviance"]))
        ax.plot(own["amplitude_value"], deviance, label=cylinder, **LINE[cylinder])
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


def _force(ax: Axes, found: xr.Dataset) -> None:
    """Draw the deviance over the push force."""
    _threshold(ax)
    for cylinder in found["cylinder"].values:
        own = found.sel(cylinder=cylinder)
        force = -own["push_force"] * own["force_ratio"]
        ax.plot(force, own["force_deviance"], label=cylinder, **LINE[cylinder])
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(FixedLocator([200, 500, 1000, 2000]))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_ylim(0, TOP)
    ax.set_xlabel(axis_label("Push force", "N"))
    ax.legend(loc="upper right", handlelength=1.6)
    ax.set_title("settling runs", loc="left")


def _transports(ax: Axes, found: xr.Dataset) -> None:
    """Draw the misfit of Tables 7 and 9 for each transport."""
    y = np.arange(found.sizes["transport"])[::-1]
    looks = {7: SOURCE_BAR["reproduced"], 9: SOURCE_BAR["published"]}
    words = {7: "Table 7, fitted", 9: "Table 9, scored"}
    for shift, table in ((0.19, 7), (-0.19, 9)):
        values = found["transport_rms"].sel(table=table).values
        ax.barh(y + shift, values, 0.36, label=words[table], **looks[table])
        for value, place in zip(values, y + shift, strict=True):
            ax.annotate(
                f"{value:.3f}", (value, place), (2, 0), textcoords="offset points", va="center", fontsize=7.0
            )
    ax.set_xlim(0, 1.15 * found["transport_rms"].max().item())
    ax.set_yticks(y, found["transport"].values)
    ax.tick_params(axis="y", length=0)
    ax.set_xlabel("rms of ln(reproduced / published MSE)")
    ax.legend(loc="upper right")
    ax.set_title("transport of the signals", loc="left")


def identification_tables(found: xr.Dataset) -> Iterator[Table]:
    """Tables for a terminal: parameters by cylinder, then, if there, amplitudes and transports."""
    table = Table("cylinder", "parameter", "estimate", "95 % interval", "searched", title="Table 5")
    for cylinder in found["cylinder"].values:
        for parameter in found["parameter"].values:
            own = found.sel(cylinder=cylinder, parameter=parameter)
            unit = UNIT[parameter] or "of the half-stroke"
            table.add_row(
                cylinder,
                f"{parameter} ({unit})",
                number(own["estimate"].item()),
                ends(own["low"].item(), own["high"].item()),
                f"{own['bound_low'].item():g} to {own['bound_high'].item():g}",
            )
    yield table
    table = Table("cylinder", "rms fitted", "rms scored", "r(M, k_f)", "widening", "evaluations")
    for cylinder in found["cylinder"].values:
        own = found.sel(cylinder=cylinder)
        rms = (f"{own[key].item():.2%}" for key in ("fitted_rms", "scored_rms"))
        r, widening = own["correlation"].item(), own["widening"].item()
        table.add_row(cylinder, *rms, f"{r:.2f}", f"{widening:.2f}", str(own["evaluations"].item()))
    yield table
    if "amplitude" not in found:
        return
    table = Table("cylinder", "amplitude (V)", "95 % interval", title="Table 7, linear transport")
    for cylinder in found["cylinder"].values:
        own = found.sel(cylinder=cylinder)
        both = ends(own["amplitude_low"].item(), own["amplitude_high"].item())
        table.add_row(cylinder, number(own["amplitude"].item()), both)
    yield table
    table = Table("transport", "rms Table 7", "rms Table 9", "amplitudes D, E (V)")
    for transport in found["transport"].values:
        own = found.sel(transport=transport)
        amplitudes = ", ".join(number(value) for value in own["transport_amplitude"].values)
        table.add_row(transport, *(f"{value:.4f}" for value in own["transport_rms"].values), amplitudes)
    yield table
