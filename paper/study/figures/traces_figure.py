"""A figure that the paper lacks: pressures over time with their errors."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from paper.study.figures.parts import TRACED_MODELS, legend_outside, message_figure
from paper.study.labels import STUDY_SAMPLING
from paper.study.model_looks import MODEL_LOOKS
from pneumo.physics.models import MODELS
from pneumo.publish.style import DOUBLE_MM, GREY, axis_label, new_figure, paper_style, symbol
from pneumo.publish.text.formatting import KILO

START, LENGTH = 20.0, 2.0  # s, of the window shown
WITHOUT_N = [name for name, model in MODELS.items() if not model.has_n]


@paper_style()
def time_traces(
    datum: xr.Dataset,
    replays: Mapping[str, xr.Dataset],
    statistics: Mapping[str, xr.Dataset],
) -> Figure:
    """Pressure of chamber A against time: datum and four models, residuals below; a column per sampling.

    `datum` is the experiment's file in ``results/datum``. By sampling: `replays` are its files in
    ``results/TRANSPORT/replay``; `statistics`, from ``results/TRANSPORT/statistics.nc``, have the best n. A
    run that ends before the window shows its last seconds.
    """
    name = datum["experiment"].item()
    if datum["status"]:
        return message_figure(f"{name}: the full-order run failed at t = {datum['failure_time'].item():g} s")
    stop = min(START + LENGTH, datum["t"].values[-1])
    window = slice(max(0.0, stop - LENGTH), stop)
    full = (datum["P"].sel(chamber="A", t=window) / KILO).load()

    fig = new_figure(DOUBLE_MM, 120)
    axes = fig.subplots(3, len(replays), sharex=True, sharey="row", squeeze=False, height_ratios=[1.4, 1, 1])
    for column, (transport, replay) in zip(axes.T, replays.items(), strict=True):
        pressure = replay["pressure"].sel(chamber="A", t=window) / KILO
        column[0].plot(full["t"], full, color="#b5b5b5", lw=2.4, label="full order")
        best = statistics[transport]["best_n"].sel(experiment=name)
        for ax, models in zip(column[1:], TRACED_MODELS, strict=True):
            ax.axhline(0, color=GREY, lw=0.5, zorder=0)
            ax.set_title("    ".join(_with_n(model, best) for model in models), loc="left", fontsize=8.0)
            for model in models:
                if best.sel(model=model).isnull():
                    continue  # failed at every n
                trace = pressure.sel(model=model, n=best.sel(model=model))
                residual = full.sel(t=trace["t"], method="nearest").values - trace
                look = MODEL_LOOKS[model]._asdict() | {"lw": 1.0}
                column[0].plot(trace["t"], trace, label=symbol(model), **look)
                ax.plot(trace["t"], residual, **look)
        column[0].set_title(STUDY_SAMPLING[transport])
        column[-1].set_xlabel(axis_label("$t$", "s"))
        column[-1].set_xlim(window.start, window.stop)
        column[-1].xaxis.set_major_locator(MaxNLocator(5))
    axes[0, 0].set_ylabel(axis_label("$P_A$", "kPa"))
    for ax in axes[1:, 0]:
        ax.set_ylabel("Residual\n(kPa)")
    fig.align_ylabels()
    legend_outside(fig, axes[0, 0], columns=5, columnspacing=1.5)
    fig.set_layout_engine("constrained", w_pad=0.06)  # tick labels of neighbouring columns stay apart
    return fig


def _with_n(model: str, best: xr.DataArray) -> str:
    n = best.sel(model=model).item()
    return symbol(model) if model in WITHOUT_N or np.isnan(n) else f"{symbol(model)}, $n$ = {n:.2f}"
