"""Figure of measured records: predicted minus measured pressures on the part held out, by thermal law."""

from typing import Any

import xarray as xr
from matplotlib.figure import Figure

from paper.study.figures.parts import legend_outside
from pneumo.publish.style import ACCENT, DOUBLE_MM, GREY, INK, axis_label, new_figure, paper_style

LOOKS: dict[str, dict[str, Any]] = {
    "isothermal": {"color": GREY, "linewidth": 0.7},
    "free n": {"color": "#c2701f", "linewidth": 0.9},
    "wall heat, constant": {"color": ACCENT, "linewidth": 1.1},
}


@paper_style()
def measurements_figure(measurements: xr.Dataset) -> Figure:
    """Draw predicted minus measured pressures of ``results/measurements.nc``.

    A column for each record, a row for each chamber.
    """
    records, chambers = measurements["record"].values, measurements["chamber"].values
    fig = new_figure(DOUBLE_MM, 90)
    axes = fig.subplots(len(chambers), len(records), sharex=True, sharey=True, squeeze=False)
    for row, chamber in zip(axes, chambers, strict=True):
        for ax, record in zip(row, records, strict=True):
            for law, look in LOOKS.items():
                error = measurements["error"].sel(record=record, chamber=chamber, law=law)
                ax.plot(error["t"], error / 1e3, label=law, **look)
            ax.axhline(0.0, color=INK, linewidth=0.4)
            ax.grid(axis="y")
        row[0].set_ylabel(axis_label(f"error of $P_{chamber}$", "kPa"))
    for ax, record in zip(axes[0], records, strict=True):
        ax.set_title(f"record {record}")
    for ax in axes[-1]:
        ax.set_xlabel(axis_label("time from the end of the part fitted", "s"))
    legend_outside(fig, axes[0, 0], len(LOOKS))
    return fig
