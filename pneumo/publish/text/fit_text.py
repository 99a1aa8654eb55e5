"""Sentences on a fit: its answer, where the misfit is, and the next experiment."""

import numpy as np

from pneumo.fitting.fit_result import FitResult, rms_of_chambers
from pneumo.fitting.lights import determined_text
from pneumo.publish.text.formatting import KILO
from pneumo.quantities.table import FULL_ORDER, PARAMETERS, QUANTITIES

WINDOWS = 20  # of a record, among which the one with the largest residual is looked for
FEW = 5  # samples of a window, below which none is named
MUCH = 1.5  # times the RMS residual of its chamber: a window above it is named
MOST_ADVICE = 2  # lines on what to do next
EXPERIMENTS = {  # that determine a group of parameters
    "wall": "fill a chamber fast, shut it off and wait, then fit that (pneumo fit --closed-from)",
    "flow": "record full strokes with the valve fully open",
    "dead volume": "record strokes up to both stops, and rests there",
    "valve": "record small steps of the command on both sides of zero, at 1 kHz or more",
    "configured": "record full strokes with the valve fully open, and the supply pressure with them",
}


def _named(model: str) -> str:
    return "the full order" if model == FULL_ORDER else model


def _error(fit: FitResult, model: str) -> float:
    return rms_of_chambers(fit.data["rms_held_out"].sel(model=model).values)


def answer_text(fit: FitResult) -> str:
    """Best model on the part held out, best reduced one, and how many parameters are determined."""
    first, best = fit.models[0], fit.best_model
    swing = rms_of_chambers(fit.data["P"].std("t").values)
    kpa, percent = _error(fit, first) / KILO, 100 * _error(fit, first) / swing
    name = _named(first)
    text = f"{name[0].upper()}{name[1:]} predicts the part held out best: {kpa:.3g} kPa RMS"
    text += f", {percent:.2g} % of the pressures' swing"
    if best != first:
        other = "law" if fit.closed else "reduced model"
        text += f". Best {other}: {best}, {_error(fit, best) / KILO:.3g} kPa"
    if fit.judgements:
        text += f". {determined_text(fit.judgements)}"
    return f"{text}."


def misfit_text(fit: FitResult) -> str:
    """Where the residual of the best model is largest: chamber, time and position; empty of few samples."""
    data = fit.data.sel(model=fit.models[0])
    t, x = data["t"].values, data["x"].values * KILO
    residual = (data["P"] - data["pressure"]).transpose("chamber", "t").values
    rms = np.sqrt(np.mean(residual**2, axis=1))
    windows = [part for part in np.array_split(np.arange(len(t)), WINDOWS) if len(part)]
    by_window = np.array([np.sqrt(np.mean(residual[:, part] ** 2, axis=1)) for part in windows]) / rms
    if len(t) < FEW * WINDOWS or not np.isfinite(by_window).any():
        return ""
    place, chamber = np.unravel_index(np.nanargmax(by_window), by_window.shape)
    ratio, part = by_window[place, chamber], windows[place]
    if ratio < MUCH:
        return "The residual is spread evenly over the record."
    where = f"t = {t[part[0]]:.4g} to {t[part[-1]]:.4g} s"
    if np.ptp(x) > 0:
        where += f", x = {x[part].min():.3g} to {x[part].max():.3g} mm"
    above = f"{ratio:.2g} times its RMS over the record"
    return f"The residual is largest in {'AB'[chamber]} at {where}: {above}."


def next_experiments(fit: FitResult) -> list[str]:
    """At most `MOST_ADVICE` lines of advice: those that would determine most parameters with wide intervals.

    A parameter that is not green only because of a warning has no line: the warning says what to do. Nor has
    one of which the record adds little to the stated accuracy: it is known that well.
    """
    advised: dict[str, list[str]] = {}
    for name, (_, reason) in fit.judgements.items():
        experiment = EXPERIMENTS.get(PARAMETERS[name].group)
        if experiment and reason.endswith("interval"):
            advised.setdefault(experiment, []).append(QUANTITIES[name].heading)
    most = sorted(advised.items(), key=lambda pair: -len(pair[1]))[:MOST_ADVICE]
    return [f"{', '.join(headings)}: {experiment}." for experiment, headings in most]
