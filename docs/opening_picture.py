"""The picture at the head of README and docs: Table 7 and Fig. 7 of the paper, printed and reproduced.

`make numbers` draws it from results/ into paper/readme/verdict.png.
"""

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper.study.averages import OVERALL
from paper.study.figures.parts import SOURCE_MARKER
from paper.study.labels import SHOWN
from paper.study.paper_2006.printed_tables import table7, traces_of_fig_7
from pneumo.publish.style import ACCENT, INK, axis_label, new_figure, paper_style
from pneumo.publish.text.formatting import KILO
from pneumo.storage.files import read

PICTURE = Path(__file__).parents[1] / "paper/readme/verdict.png"
AFTER_RELEASE = 0.5  # s, of Fig. 7
PANELS = {"x": ("$x$", "mm", 1 / KILO), "P_A": ("$P_A$", "kPa", KILO)}  # label, unit, its size in SI


def _table_7(ax: Axes, reproduced: xr.DataArray) -> None:
    """Draw the mean square errors of Table 7, with the deviation of each in per cent."""
    printed = table7()["mse"]
    rows = np.arange(printed.sizes["model"])
    ax.plot(printed, rows, label="printed", **SOURCE_MARKER["published"])
    ax.plot(reproduced, rows, label="reproduced", **SOURCE_MARKER["reproduced"])
    for row, deviation in zip(rows, (reproduced / printed - 1).values, strict=True):
        ax.text(
            1.02,
            row,
            f"{100 * deviation:+.1f} %".replace("-", "−"),
            transform=ax.get_yaxis_transform(),
            va="center",
        )
    ax.set_yticks(rows, printed["model"].values)
    ax.invert_yaxis()
    ax.set_xscale("log")
    ax.set_xlabel(axis_label("mean square error", "Pa$^2$"))
    ax.grid(axis="y")
    ax.legend(loc="lower right")
    ax.set_title("Table 7: errors of the ten models", loc="left")


def _figure_7(axes: np.ndarray, settling: xr.Dataset) -> None:
    """Draw position and pressure after the release, over the curves read off the printed figure."""
    release = settling["release_time"].item()
    run = settling.sel(t=slice(release - 0.05, release + AFTER_RELEASE))
    series = {"x": run["x"], "P_A": run["P"].sel(chamber="A")}
    for ax, (name, (label, unit, size)) in zip(axes, PANELS.items(), strict=True):
        t, low, high = traces_of_fig_7()[name]
        drawn = (t >= -0.05) & (t <= AFTER_RELEASE)
        look = {"color": ACCENT, "lw": 3.0, "alpha": 0.45, "capstyle": "round"}
        ax.vlines(t[drawn], low[drawn] / size, high[drawn] / size, label="printed", **look)
        ax.plot(run["t"] - release, series[name] / size, color=INK, lw=0.8, label="reproduced")
        ax.set_ylabel(axis_label(label, unit))
    axes[0].legend(loc="upper right")
    axes[0].set_title("Fig. 7: the piston is released", loc="left")
    axes[-1].set_xlabel(axis_label("$t$ after the release", "s"))


@paper_style()
def verdict_figure(results: Path) -> Figure:
    """Draw Table 7 and Fig. 7, printed and as `results` have them."""
    fig = new_figure(170, 80)
    left, right = fig.subfigures(1, 2)
    statistics = read(results / "published/statistics.nc")
    _table_7(left.subplots(), statistics["mse"].sel(level=OVERALL))
    _figure_7(right.subplots(2, sharex=True), read(results / f"settling/{SHOWN['fig07']}.nc"))
    return fig
