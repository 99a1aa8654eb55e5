"""Figure and tables of the ensemble: what each refinement does to the error, with the spread over seeds."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, StrMethodFormatter
from rich.table import Table

from pneumo.evidence.ensemble import CRITERIA
from pneumo.publish.figures.paper_figures import symbol
from pneumo.publish.style import DOUBLE_MM, INK, SOURCE_MARKER, new_figure, paper_style
from pneumo.simulation.signals import EXACT, PUBLISHED

SHOWN = ("M6/M5", "M8/M7", "M10/M8")
REFINED = {"M6/M5": "mixing, no wall heat", "M8/M7": "mixing, with wall heat", "M10/M8": "area, pressure"}
LOOKS = {PUBLISHED: "published", EXACT: "reproduced"}
LABELS = {PUBLISHED: "transport as published", EXACT: "exact transport"}
AVERAGED = {"mean": "mean", "geometric": "geom. mean"}


@paper_style()
def ensemble_figure(ensemble: xr.Dataset) -> Figure:
    """Quotients of mean square errors for each experiment and each level.

    Parameters
    ----------
    ensemble : xarray.Dataset
        ``results/ensemble.nc``.

    Returns
    -------
    matplotlib.figure.Figure
        A panel per refinement; marks are geometric means over seed sets, bars where one seed set falls in 95
        per cent of cases.
    """
    experiments, levels = ensemble["experiment"], ensemble["level"].values
    averages = [(level, averaged) for level in levels for averaged in AVERAGED]
    rows = [
        *(
            f"{e['cylinder'].item()} {e['loop'].item()}, {e['k_0'].item():g} W/K ({e.item()})"
            for e in experiments
        ),
        *(f"{level}, {AVERAGED[averaged]}" for level, averaged in averages),
    ]
    y = np.arange(len(rows), dtype=float)
    y[len(experiments) :] += 0.8
    fig = new_figure(DOUBLE_MM, 28 + 4.3 * len(rows))
    axes = fig.subplots(1, len(SHOWN), sharey=True)
    for ax, ratio in zip(axes, SHOWN, strict=True):
        part = ensemble.sel(ratio=ratio)
        for transport, offset in ((PUBLISHED, -0.17), (EXACT, 0.17)):
            here = part.sel(transport=transport)

            def row(name: str, here: xr.Dataset = here) -> np.ndarray:
                over_levels = [
                    here[f"ratio_{name}"].sel(level=level, averaged=averaged).item()
                    for level, averaged in averages
                ]
                return np.array([*here[f"experiment_ratio_{name}"].values, *over_levels])

            ax.hlines(y + offset, row("single_low"), row("single_high"), color=INK, lw=0.7)
            ax.plot(row("value"), y + offset, label=LABELS[transport], **SOURCE_MARKER[LOOKS[transport]])
        ax.axvline(1, color=INK, lw=0.7)
        ax.set_xscale("log")
        low, high = ax.get_xlim()
        ticks = [t for t in (0.03, 0.1, 0.3, 1, 3, 10) if low <= t <= high]
        ax.xaxis.set_major_locator(FixedLocator(ticks))
        ax.xaxis.set_minor_locator(NullLocator())
        ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        a, b = ratio.split("/")
        ax.set_title(f"{symbol(a)} over {symbol(b)}\n({REFINED[ratio]})")
        ax.grid(axis="x")
        ax.tick_params(axis="y", length=0)
        ax.spines["left"].set_visible(False)
    axes[0].set_yticks(y, rows)
    axes[0].set_ylim(y[-1] + 0.7, -0.7)
    fig.supxlabel("Quotient of mean square errors; below 1 the refinement pays", fontsize=8.5)
    fig.set_layout_engine("constrained", w_pad=0.08)  # names of rows stay inside the page
    handles, labels = axes[0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside upper center", ncols=2)
    return fig


def ratio_table(ensemble: xr.Dataset) -> Table:
    """Quotients of mean square errors per level, with the interval of the mean and what one seed resolves."""
    table = Table("refinement", "level", "average", title="Quotient of mean square errors, [95 % interval]")
    for transport in LABELS:
        table.add_column(LABELS[transport], justify="right")
        table.add_column("one seed resolves", justify="right")
    for ratio in ensemble["ratio"].values:
        for level in ensemble["level"].values:
            for averaged in AVERAGED:
                cells = []
                for transport in LABELS:
                    at = ensemble.sel(ratio=ratio, level=level, averaged=averaged, transport=transport)
                    value, low, high, least = (
                        at[f"ratio_{name}"].item() for name in ("value", "low", "high", "resolvable")
                    )
                    cells += [f"{value:.3f} [{low:.3f}, {high:.3f}]", f"{100 * (least - 1):.0f} %"]
                table.add_row(ratio, level, AVERAGED[averaged], *cells)
    return table


def probability_table(ensemble: xr.Dataset, transport: str, level: str) -> Table:
    """How often each of M5 to M10 has the lower score than another, by the three criteria."""
    models = ensemble["model"].values[4:]
    sets = int(ensemble["complete"].sum())
    title = f"Of {sets} seed sets, per cent in which the row beats the column; {LABELS[transport]}, {level}"
    table = Table("criterion", "model", *models, title=title, caption="* not told apart (Holm, 5 %)")
    for criterion in CRITERIA:
        here = ensemble.sel(criterion=criterion, transport=transport, level=level)
        for model in models:
            cells = []
            for other in models:
                at = here.sel(model=model, other=other)
                mark = "" if at["resolved"].item() else " *"
                cells.append("" if model == other else f"{100 * at['probability'].item():.0f}{mark}")
            table.add_row(criterion, model, *cells)
    return table
