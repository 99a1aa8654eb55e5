"""Figures of measured air with flow: pressure, its errors, and the gas temperature, by model."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from paper.study.figures.parts import legend_outside
from pneumo.publish.style import ACCENT, DOUBLE_MM, GREY, INK, axis_label, new_figure, paper_style

LOOKS: dict[str, dict[str, Any]] = {
    "M1": {"color": GREY, "linewidth": 0.8},
    "M5": {"color": "#c2701f", "linewidth": 0.9, "linestyle": "--"},
    "M6": {"color": "#c2701f", "linewidth": 0.9},
    "M8": {"color": "#5a7d2a", "linewidth": 1.0},
    "full order": {"color": ACCENT, "linewidth": 1.2},
}
VESSELS = ("discharge", "filling", "nitrogen")
POINTS = {"color": INK, "linestyle": "none", "marker": "o", "markersize": 2.5, "label": "measured"}


def _times(air: xr.Dataset, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Times of the replays and of the measured pressures, s."""
    return air[f"t_{name}"].values, air[f"tp_{name}"].values


@paper_style()
def pulses_figure(air: xr.Dataset) -> Figure:
    """Draw a pulse of ``measured_air.nc`` that no fit used, and the errors of the models on it."""
    fig = new_figure(DOUBLE_MM, 70)
    left, right = fig.subplots(1, 2)
    t, t_measured = _times(air, "pulses")
    measured = air["measured_P_pulses"].values
    left.plot(1e3 * t_measured, measured / 1e3, **POINTS | {"markersize": 1.2})
    for name, look in LOOKS.items():
        P = air["P_pulses"].sel(shown=name).values
        left.plot(1e3 * t, P / 1e3, label=name, **look)
        right.plot(1e3 * t_measured, (np.interp(t_measured, t, P) - measured) / 1e3, **look)
    right.axhline(0.0, color=INK, linewidth=0.4)
    left.set_ylabel(axis_label("$P$", "kPa"))
    right.set_ylabel(axis_label("error of $P$", "kPa"))
    for ax in (left, right):
        ax.set_xlabel(axis_label("time", "ms"))
        ax.grid(axis="y")
    legend_outside(fig, left, len(LOOKS) + 1)
    return fig


@paper_style()
def vessel_figure(air: xr.Dataset) -> Figure:
    """Draw pressure errors and gas temperature of each vessel run in ``measured_air.nc``, a column each."""
    fig = new_figure(DOUBLE_MM, 100)
    names = [name for name in VESSELS if f"P_{name}" in air]
    axes = fig.subplots(2, len(names), sharex="col")
    for (above, below), name in zip(axes.T, names, strict=True):
        t, t_measured = _times(air, name)
        measured, T = air[f"measured_P_{name}"].values, air[f"measured_T_{name}"]
        below.plot(air[f"tt_{name}"], T, **POINTS)
        for model, look in LOOKS.items():
            P = np.interp(t_measured, t, air[f"P_{name}"].sel(shown=model).values)
            above.plot(t_measured, (P - measured) / 1e3, label=model, marker=".", markersize=3, **look)
            below.plot(t, air[f"T_{name}"].sel(shown=model), **look)
        above.axhline(0.0, color=INK, linewidth=0.4)
        above.set_title(name)
        middle, half = (T.max().item() + T.min().item()) / 2, 2.2 * float(np.ptp(T.values))
        below.set_ylim(middle - half, middle + half)
        below.set_xlabel(axis_label("time", "s"))
        for ax in (above, below):
            ax.grid(axis="y")
    axes[0, 0].set_ylabel(axis_label("error of $P$", "kPa"))
    axes[1, 0].set_ylabel(axis_label("$T$", "K"))
    legend_outside(fig, axes[0, 0], len(LOOKS))
    return fig
