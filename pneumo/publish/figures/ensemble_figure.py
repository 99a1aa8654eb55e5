"""Figure of the ensemble: effect of each refinement on the error, with the spread over seeds."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from pneumo.publish.figures import panels
from pneumo.publish.figures.panels import symbol
from pneumo.publish.labels import AVERAGES, STUDY_SAMPLING
from pneumo.publish.style import DOUBLE_MM, INK, SOURCE_MARKER, new_figure, paper_style
from pneumo.statistics.model_pairs import MODEL_PAIRS, REFINEMENT_PAIRS

DRAWN = {"published": ("published", -0.17), "exact": ("reproduced", 0.17)}  # look, offset by sampling


@paper_style()
def ensemble_figure(ensemble: xr.Dataset) -> Figure:
    """Draw ratios of mean square errors by experiment and level, from ``results/ensemble.nc``.

    A panel per refinement; marks are geometric means over seed sets, bars contain 95 per cent of the single
    seed sets.
    """
    experiments, levels = ensemble["experiment"], ensemble["level"].values
    rows = [
        f"{e['cylinder'].item()} {e['loop'].item()}, {e['k_0'].item():.2g} W/K ({e.item()})"
        for e in experiments
    ]
    rows += [f"{level}, {head}" for level in levels for head in AVERAGES.values()]
    y = np.arange(len(rows), dtype=float)
    y[len(experiments) :] += 0.8
    fig = new_figure(DOUBLE_MM, 28 + 4.3 * len(rows))
    axes = fig.subplots(1, len(REFINEMENT_PAIRS), sharey=True)
    for ax, ratio in zip(axes, REFINEMENT_PAIRS, strict=True):
        pair, part = MODEL_PAIRS[ratio], ensemble.sel(ratio=ratio)
        for transport, (source, offset) in DRAWN.items():
            of_transport = part.sel(transport=transport)

            def row(name: str, of_transport: xr.Dataset = of_transport) -> np.ndarray:
                by_level = (
                    of_transport[f"ratio_{name}"].transpose("level", "averaged").sel(averaged=[*AVERAGES])
                )
                return np.concatenate([of_transport[f"experiment_ratio_{name}"], by_level.values.ravel()])

            ax.hlines(y + offset, row("single_low"), row("single_high"), color=INK, lw=0.7)
            ax.plot(row("value"), y + offset, label=STUDY_SAMPLING[transport], **SOURCE_MARKER[source])
        ax.axvline(1, color=INK, lw=0.7)
        ax.set_xscale("log")
        low, high = ax.get_xlim()
        panels.fixed_ticks(ax.xaxis, [t for t in (0.03, 0.1, 0.3, 1, 3, 10) if low <= t <= high])
        ax.xaxis.set_minor_locator(NullLocator())
        panels.row_panel(ax, f"{symbol(pair.model)} over {symbol(pair.other)}\n({pair.refinement})")
    panels.name_rows(fig, axes[0], y, rows, "Ratio of mean square errors; below 1 the refinement pays")
    axes[0].set_ylim(y[-1] + 0.7, -0.7)
    panels.legend_outside(fig, axes[0], columns=2)
    return fig
