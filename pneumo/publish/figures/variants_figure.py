"""What a refinement gains under every alternative: a table and a figure."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullFormatter, StrMethodFormatter

from pneumo.publish.figures.paper_figures import symbol
from pneumo.publish.figures.toggles_figure import words
from pneumo.publish.style import ACCENT, DOUBLE_MM, INK, new_figure, paper_style
from pneumo.verdict.assumptions import AS_TAKEN

EXACT, MEAN = "exact", "mean"
LEVELS = {
    "adiabatic": {"marker": "o", "markerfacecolor": ACCENT},
    "typical": {"marker": "s", "markerfacecolor": "#cfcfcf"},
    "isothermal": {"marker": "^", "markerfacecolor": "white"},
}
CLEARER = {  # than `words` makes of them
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


def name_of(alternative: str) -> str:
    """Name of an alternative as it is read, with what it is about where that is not clear."""
    about = f"{alternative.partition('.')[0]} " if alternative.startswith(("supply.", "inlet.")) else ""
    return CLEARER.get(alternative, about + words(alternative))


def table(found: xr.Dataset) -> str:
    """Markdown: share of the alternatives under which each refinement pays, then every ratio.

    Parameters
    ----------
    found : xarray.Dataset
        ``results/variants.nc``.
    """
    levels = list(found["level"].values)
    pairs = list(found["pair"].values)
    lines = [
        "Ratio of mean square errors with and without a refinement, each model at its best constant n of the"
        " level; overall, at its best n in each experiment.",
        "",
        "Alternatives under which the refinement pays (ratio below 1), of those that have a ratio:",
        "",
        _row(["transport", "over experiments", "ratio", *levels]),
        _row(["---"] * (3 + len(levels))),
    ]
    for transport in found["transport"].values:
        for criterion in found["criterion"].values:
            for pair in pairs:
                one = found.sel(transport=transport, criterion=criterion, pair=pair)
                counted = [int(one["counted"].sel(level=level)) for level in levels]
                share = np.nan_to_num(one["share"].sel(level=levels))
                shares = [
                    f"{round(part * all_)} of {all_}" for part, all_ in zip(share, counted, strict=True)
                ]
                lines.append(_row([transport, criterion, pair, *shares]))
    lines += ["", "Every ratio, exact transport, mean over experiments:", ""]
    lines += [
        _row(["alternative", *(f"{pair} {level}" for pair in pairs for level in levels)]),
        _row(["---"] * (1 + len(pairs) * len(levels))),
    ]
    ratio = found["ratio"].sel(transport=EXACT, criterion=MEAN)
    for alternative in found["alternative"].values:
        one = ratio.sel(alternative=alternative)
        values = [one.sel(pair=pair, level=level).item() for pair in pairs for level in levels]
        lines.append(
            _row([alternative, *(f"{value:.2f}" if np.isfinite(value) else "-" for value in values)])
        )
    return "\n".join(lines) + "\n"


def _row(cells: list[str]) -> str:
    return f"| {' | '.join(map(str, cells))} |"


@paper_style()
def dots(found: xr.Dataset) -> Figure:
    """Draw the ratio of each refinement under each alternative, exact transport, mean over experiments.

    Parameters
    ----------
    found : xarray.Dataset
        ``results/variants.nc``.

    Returns
    -------
    matplotlib.figure.Figure
        A panel per refinement, a row per alternative, a mark per level; left of the line it pays.
    """
    ratio = found["ratio"].sel(transport=EXACT, criterion=MEAN)
    names = [str(name) for name in found["alternative"].values]
    y = np.arange(len(names))[::-1]
    fig = new_figure(DOUBLE_MM, 28 + 4.0 * len(names))
    axes = fig.subplots(1, found.sizes["pair"], sharey=True, squeeze=False)[0]
    for ax, pair in zip(axes, found["pair"].values, strict=True):
        one = ratio.sel(pair=pair)
        ax.axvline(1.0, color=INK, linewidth=0.7)
        for level, look in LEVELS.items():
            if level in one["level"]:
                values = one.sel(level=level).values
                ax.plot(values, y, linestyle="none", markeredgecolor=INK, markersize=3.6, label=level, **look)
        ax.set_xscale("log")
        ax.xaxis.set_major_locator(FixedLocator(TICKS))
        ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.grid(axis="both")
        ax.set_title(" / ".join(f"MSE of {symbol(model)}" for model in str(pair).split("/")))
        ax.tick_params(axis="y", length=0)
    axes[0].set_yticks(y, [name_of(name) for name in names])
    axes[0].set_ylim(-0.7, len(names) - 0.3)
    fig.supxlabel("Ratio of mean square errors, exact transport; below 1 the refinement pays", fontsize=8.5)
    fig.set_layout_engine("constrained", w_pad=0.08)
    fig.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=len(LEVELS))
    return fig
