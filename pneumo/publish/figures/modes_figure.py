"""Natural frequency and damping of an actuator over stroke and pressure."""

import xarray as xr
from matplotlib.figure import Figure

from pneumo.publish.style import DOUBLE_MM, INK, axis_label, new_figure, paper_style


@paper_style()
def modes_figure(modes: xr.Dataset) -> Figure:
    """Draw the results of `pneumo.linear.linear_analysis.natural_modes` as contours."""
    fig = new_figure(DOUBLE_MM, 70)
    axes = fig.subplots(1, 2, sharex=True, sharey=True)
    for ax, values in zip(axes, modes.data_vars.values(), strict=True):
        x, P = modes["x"] * 1e3, modes["P"] / 1e5
        filled = ax.contourf(x, P, values.T, levels=12, cmap="Blues")
        lines = ax.contour(x, P, values.T, levels=filled.levels[::3], colors=INK, linewidths=0.5)
        ax.clabel(lines, fontsize=7)
        unit = values.attrs["units"].replace("1", "")
        label = axis_label(str(values.attrs["long_name"]), unit)
        ax.set(title=label, xlabel=axis_label("$x$", "mm"))
        fig.colorbar(filled, ax=ax)
    axes[0].set_ylabel(axis_label("$P_A$", "bar"))
    return fig
