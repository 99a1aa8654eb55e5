"""Figure of the refinements: what each gains under every alternative assumption."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from pneumo.publish.figures.panels import fixed_ticks, legend_outside, name_rows, symbol
from pneumo.publish.figures.toggles_figure import alternative_name
from pneumo.publish.style import ACCENT, DOUBLE_MM, INK, new_figure, paper_style
from pneumo.verdict.assumptions import AS_TAKEN

LEVEL_MARKS = {
    "adiabatic": {"marker": "o", "markerfacecolor": ACCENT},
    "typical": {"marker": "s", "markerfacecolor": "#cfcfcf"},
    "isothermal": {"marker": "^", "markerfacecolor": "white"},
}
CLEARER = {  # than what `alternative_name` returns
    AS_TAKEN: "as taken",
    "end_stop_law.no_rest_rule": "stops without rest",
    "equilibrium_ratio.exact_root": "start at exact P_0",
    "friction_law.coulomb": "Coulomb friction",
    "sign_reversal.toggle": "changed sign kept",
    "sonic_constant.exact_coefficient": "exact sonic constant",
    "valve.leak": "leaking valve",
    "valve.elliptic": "elliptic flow law",
}
TICKS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0)


def clear_name(alternative: str) -> str:
    """Return the name of an alternative in plain words, with its assumption where that is not clear."""
    about = f"{alternative.partition('.')[0]} " if alternative.startswith(("supply.", "inlet.")) else ""
    return CLEARER.get(alternative, about + alternative_name(alternative))


@paper_style()
def variants_figure(variants: xr.Dataset) -> Figure:
    """Draw the ratio of each refinement under each alternative of ``results/variants.nc``.

    Exact transport, mean over experiments. A panel per refinement, a row per alternative, a mark per level;
    left of the line the refinement pays.
    """
    ratio = variants["ratio"].sel(transport="exact", criterion="mean")
    names = [str(name) for name in variants["alternative"].values]
    y = np.arange(len(names))[::-1]
    fig = new_figure(DOUBLE_MM, 28 + 4.0 * len(names))
    axes = fig.subplots(1, variants.sizes["pair"], sharey=True, squeeze=False)[0]
    for ax, pair in zip(axes, variants["pair"].values, strict=True):
        one = ratio.sel(pair=pair)
        ax.axvline(1.0, color=INK, linewidth=0.7)
        for level, look in LEVEL_MARKS.items():
            if level in one["level"]:
                values = one.sel(level=level).values
                ax.plot(values, y, linestyle="none", markeredgecolor=INK, markersize=3.6, label=level, **look)
        ax.set_xscale("log")
        fixed_ticks(ax.xaxis, TICKS)
        ax.grid(axis="both")
        ax.set_title(" / ".join(f"MSE of {symbol(model)}" for model in str(pair).split("/")))
        ax.tick_params(axis="y", length=0)
    xlabel = "Ratio of mean square errors, exact transport; below 1 the refinement pays"
    name_rows(fig, axes[0], y, [clear_name(name) for name in names], xlabel)
    axes[0].set_ylim(-0.7, len(names) - 0.3)
    legend_outside(fig, axes[0], columns=len(LEVEL_MARKS))
    return fig
