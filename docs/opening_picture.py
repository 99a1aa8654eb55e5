"""The picture at the head of README and docs: errors of four models over two seconds of a run.

`make numbers` draws it from results/ into paper/readme/errors.png.
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from paper.study.stored_runs import read_study, recording_from
from pneumo.physics.models import MODELS, Model
from pneumo.publish.model_looks import MODEL_LOOKS
from pneumo.publish.style import GREY, axis_label, new_figure, paper_style
from pneumo.publish.text.formatting import KILO
from pneumo.runs import Run, replay
from pneumo.storage.files import read

PICTURE = Path(__file__).parents[1] / "paper/readme/errors.png"
EXPERIMENT = "E12"  # a typical conductance, in closed loop
START, STOP = 20.0, 22.0  # s
SHOWN = ("M1", "M6", "M7", "M8")  # a constant temperature, and the models that README's answer names
MM = 1e-3  # m


def refinements(model: Model) -> str:
    """Return what a model has beyond a constant temperature."""
    if model.temperature == "constant":
        return "constant temperature"
    mixing, wall = ["mixing"] * model.mixing, ["wall heat"] * (model.wall != "none")
    return " and ".join([*mixing, *wall]) or "temperature by pressure"


def errors_of_chamber_a(results: Path) -> tuple[Run, dict[str, np.ndarray]]:
    """Return a run until STOP, and at each step the error of each model with its best n, Pa."""
    datum = read(results / f"datum/{EXPERIMENT}.nc").sel(t=slice(0.0, STOP))
    experiment = read_study(results / "parameters.json").experiments[EXPERIMENT]
    run = Run(recording_from(datum, experiment), simulated=True)
    best_n = read(results / "exact/statistics.nc")["best_n"].sel(experiment=EXPERIMENT)
    n = {name: best_n.sel(model=name).item() if MODELS[name].has_n else None for name in SHOWN}
    return run, {name: run.P_A - replay(name, n[name], run).P_A for name in SHOWN}


@paper_style()
def errors_figure(results: Path) -> Figure:
    """Draw command, position and pressure, and beside them each model's error of the pressure."""
    run, errors = errors_of_chamber_a(results)
    shown = run.t >= START
    t = run.t[shown]
    fig = new_figure(150, 95)
    left, right = fig.subfigures(1, 2)
    signals = {"$u$ (V)": run.u, "$x$ (mm)": run.x / MM, "$P_A$ (kPa)": run.P_A / KILO}
    axes = left.subplots(len(signals), sharex=True)
    for ax, (label, signal) in zip(axes, signals.items(), strict=True):
        ax.plot(t, signal[shown], color=GREY, lw=1.1)
        ax.set_ylabel(label)
    left.suptitle("The run, simulated in full order", fontsize=8.5)
    right.suptitle("Errors of $P_A$: full order minus model", fontsize=8.5)
    panels = right.subplots(len(SHOWN), sharex=True)
    fine = max(np.abs(errors[name][shown]).max() for name in SHOWN[1:]) / KILO
    for ax, name in zip(panels, SHOWN, strict=True):
        error = errors[name][shown]
        rms = (error**2).mean() ** 0.5
        ax.axhline(0, color=GREY, lw=0.5, zorder=0)
        ax.plot(t, error / KILO, color=MODEL_LOOKS[name].color, lw=1.1)
        said = f"{name}: {refinements(MODELS[name])}, {rms / KILO:.1f} kPa RMS"
        ax.set_title(said, loc="left")
        if name in SHOWN[1:]:
            ax.set_ylim(-1.1 * fine, 1.1 * fine)
        ax.set_ylabel("kPa")
    for ax in (axes[-1], panels[-1]):
        ax.set_xlabel(axis_label("$t$", "s"))
        ax.set_xlim(START, STOP)
    left.align_ylabels()
    right.align_ylabels()
    return fig
