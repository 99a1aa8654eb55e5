"""Page to explore the study: one self-contained HTML file."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from paper.study.figures.parts import FIRST_SHOWN
from paper.study.labels import STUDY_SAMPLING
from paper.study.pages import STATUS_LOOKS, STUDY_TEMPLATES
from paper.study.pages.packing import FRACTION, packed, rounded, rounding_step
from paper.study.stored_runs import failure_text
from paper.study.trace_layout import (
    COMMON_N,
    close_up,
    interval_edges,
    lowest_and_highest,
    shown_steps,
)
from pneumo.configuration.experiment import Experiment, Study
from pneumo.physics.models import MODELS
from pneumo.publish.model_looks import MODEL_LOOKS, on_dark
from pneumo.publish.pages.page import page_text
from pneumo.publish.text.formatting import KILO
from pneumo.storage.files import read
from pneumo.storage.layout import CHAMBERS

OPENING = (
    "E12"  # run on which the paper's report opens, at its close-up: a typical conductance, in closed loop
)
PER_OCTAVE = 512  # steps in which a mean square error is stored: 0.07 %
LEAST_SQUARE = 2.0**-20  # Pa^2; errors of zero count as this
SIGNALS = {"u": 1e3, "x": 1e6}  # signals of a run -> steps per unit before rounding, mV and um
STANDS = {  # whether a claim of 2006 stands -> symbol, class of its badge
    "yes": ("✓", "close"),
    "in part": ("≈", "explained"),
    "depends": ("±", "explained"),
    "no": ("≠", "contradicted"),
    "not run": ("?", "unknown"),
}
DIGITS = 5  # of a mean square error


class Part(NamedTuple):
    """Data of one experiment in the report page."""

    facts: dict[str, Any]  # names, mean square errors, samples and intervals, rounding steps
    traces: dict[str, str]  # packed signals, and packed errors by sampling


def stored_parts(study: Study, results: Path) -> list[Part]:
    """Read the data of every experiment for the page from a folder of results."""
    parts = []
    folders = {transport: results / transport for transport in STUDY_SAMPLING}
    best_n = {name: read(path / "statistics.nc", "best_n")["best_n"] for name, path in folders.items()}
    for name, e in study.experiments.items():
        datum = read(results / "datum" / f"{name}.nc", "u", "x", "P", "status", "failure_time")
        mse = {
            transport: read(path / "replay" / f"{name}.nc", "mse")["mse"]
            for transport, path in folders.items()
        }
        traces = {transport: read(path / "traces" / f"{name}.nc") for transport, path in folders.items()}
        best = {transport: of_all.sel(experiment=name) for transport, of_all in best_n.items()}
        parts.append(part(e, datum, mse, traces, best))
    return parts


def part(
    experiment: Experiment,
    datum: xr.Dataset,
    mse: Mapping[str, xr.DataArray],
    traces: Mapping[str, xr.Dataset],
    best_n: Mapping[str, xr.DataArray],
) -> Part:
    """Return the data of one experiment for the page, from its files of results by sampling.

    `datum` is its file in ``results/datum``. By sampling: `mse` is from ``results/TRANSPORT/replay``,
    `traces` from ``results/TRANSPORT/traces``; `best_n` is the best n of each model.
    """
    shown, edges = shown_steps(experiment), interval_edges(experiment)
    steps, packs = _signals(datum, shown, edges)
    facts: dict[str, Any] = {
        "name": experiment.name,
        "text": experiment_text(experiment),
        "failed": failure_text(datum) if datum["status"] else None,
        "h": experiment.h,
        "stride": experiment.pressure_stride,
        "close_up": close_up(experiment),
        "finer": int(np.diff(shown).min(initial=experiment.pressure_stride)),
        "edges": edges.tolist(),
        "steps": steps,
        "cells": {},
    }
    for transport, cells in traces.items():
        of_models = (
            mse[transport].sel(model=list(MODELS), chamber=CHAMBERS).transpose("model", "n", "chamber")
        )
        best = best_n[transport].sel(model=list(MODELS)).values
        n = of_models["n"].values
        least = np.sqrt(of_models.min("n").values)  # NaN where every n failed
        steps, errors = _errors(cells, least)
        packs |= {f"{transport}-{name}": text for name, text in errors.items()}
        facts["cells"][transport] = {
            "mse": _shortened(of_models.values),
            "best": [int(np.abs(n - value).argmin()) if np.isfinite(value) else None for value in best],
            "steps": steps,
        }
    return Part(facts, packs)


def _signals(datum: xr.Dataset, shown: np.ndarray, edges: np.ndarray) -> tuple[list[float], dict[str, str]]:
    """Return rounding steps of u, x and both pressures, and two packs: samples, and limits by interval."""
    pressures = datum["P"].sel(chamber=CHAMBERS).values.T
    signals = [(datum[name].values, per_unit) for name, per_unit in SIGNALS.items()]
    signals += [(chamber, 1.0) for chamber in pressures]
    steps, samples, limits = [], [], []
    for values, per_unit in signals:
        largest = np.abs(values[np.isfinite(values)]).max(initial=0.0)
        step = rounding_step(np.nan, float(largest * per_unit)) / per_unit
        steps.append(step)
        samples.append(rounded(values[None, shown], step))
        limits.append(rounded(lowest_and_highest(values, edges), step))
    return steps, {"signals": packed(samples), "signal-limits": packed(limits)}


def _errors(cells: xr.Dataset, least: np.ndarray) -> tuple[list[float], dict[str, str]]:
    """Return rounding steps and packs of errors: samples, limits and mean squares by interval.

    Packs have a group per model and chamber, with a row per choice of n, or one row if all choices are the
    same. Limits have two rows per choice: the lowest and the highest error.
    """
    cells = cells.sel(model=list(MODELS), chamber=CHAMBERS)
    n = cells["n_shown"].transpose("model", "choice").values
    dims = ("model", "chamber", "choice", ...)
    error, lowest, highest, square = (
        cells[name].transpose(*dims).values for name in ("error", "lowest", "highest", "mean_square")
    )
    logarithms = np.log2(np.maximum(square, LEAST_SQUARE))
    steps, samples, limits, squares = [], [], [], []
    for m, model in enumerate(MODELS.values()):
        rows = slice(None) if model.has_n and len(set(n[m].tolist())) > 1 else slice(0, 1)
        for c in range(len(CHAMBERS)):
            ends = np.stack([lowest[m, c, rows], highest[m, c, rows]], axis=1)
            largest = np.abs(ends[np.isfinite(ends)]).max(initial=0.0)
            step = rounding_step(least[m, c], float(largest))
            steps.append(step)
            samples.append(rounded(error[m, c, rows], step))
            limits.append(rounded(ends.reshape(-1, ends.shape[-1]), step))
            squares.append(rounded(logarithms[m, c, rows], 1 / PER_OCTAVE))
    return steps, {"errors": packed(samples), "limits": packed(limits), "squares": packed(squares)}


def answer(parts: Sequence[Part]) -> str:
    """Two sentences: the models nearest to the full order, overall and by run; failed runs do not count."""
    cells = [part.facts["cells"]["exact"] for part in parts if not part.facts["failed"]]
    square: dict[str, list[float]] = {}
    for m, name in enumerate(MODELS):
        at_best = [(run["mse"][m], run["best"][m]) for run in cells]
        if all(place is not None for _, place in at_best):
            square[name] = [float(np.mean(mse[place])) for mse, place in at_best]
    if not cells or not square:
        return "No model ran through every experiment."
    means = {name: float(np.mean(values)) for name, values in square.items()}
    first, *others = sorted(means, key=means.__getitem__)
    kpa = {name: f"{np.sqrt(mean) / KILO:#.2g}".rstrip(".") for name, mean in means.items()}
    next_ones = ", then " + ", ".join(f"{name} ({kpa[name]})" for name in others[:3]) if others else ""
    wins = Counter(min(square, key=lambda name: square[name][run]) for run in range(len(cells)))
    runs = "in the only run" if len(cells) == 1 else f"over all {len(cells)} runs"
    constant = [kpa[name] for name in means if MODELS[name].temperature == "constant"]
    last = f"; a constant temperature leaves {min(constant, key=float)} or more" if constant else ""
    text = (
        f"With its best n in each run, {first} is nearest to the full order: {kpa[first]} kPa RMS {runs}"
        f"{next_ones}{last}."
    )
    if len(wins) == 1:
        return f"{text} It is so in every run." if len(cells) > 1 else text
    counts = ", ".join(f"{name} in {count}" for name, count in wins.most_common())
    return f"{text} No model is nearest in every run: {counts}."


def experiment_text(experiment: Experiment) -> str:
    """Return an experiment's cylinder, loop, conductance and length as text.

    Examples
    --------
    >>> from pneumo.configuration.parameters import load, study
    >>> experiment_text(study(load("config/paper.yaml")).experiments["E07"])
    'cylinder E (32 × 275 mm, 5 kg), open loop, k₀ = 0.1 W/K, 360 s'
    """
    plant = experiment.plant
    size = f"{1e3 * plant.cylinder.bore:g} × {1e3 * plant.cylinder.stroke:g} mm, {plant.cylinder.M:g} kg"
    run = f"{experiment.loop} loop, k₀ = {plant.k_0:.4g} W/K, {experiment.duration:.6g} s"
    return f"cylinder {experiment.cylinder} ({size}), {run}"


def _model(name: str) -> dict[str, Any]:
    model, look = MODELS[name], MODEL_LOOKS[name]
    mixing = "mixing" if model.mixing else "no mixing"
    return {
        "name": name,
        "text": f"{model.temperature} temperature, {mixing}, wall heat {model.wall}",
        "colour": look.color,
        "on_dark": on_dark(look.color),
        "dash": [] if isinstance(look.linestyle, str) else look.linestyle[1],
        "has_n": model.has_n,
        "first": name in FIRST_SHOWN,
    }


def _shortened(values: np.ndarray) -> Any:
    """Nested lists of numbers with few digits; None where there is none."""
    if values.ndim:
        return [_shortened(value) for value in values]
    return float(f"{values:.{DIGITS}g}") if np.isfinite(values) else None


def report_page(
    study: Study,
    parts: Sequence[Part],
    verdict: Mapping[str, Any] | None,
    findings: Mapping[str, Any] | None,
    manuscript: bool,
) -> str:
    """Write the page, with style, script, library and data inside; the same text for the same results.

    `verdict` is from ``verdict.json``, None for a study of own cylinders; `findings` from ``findings.json``,
    None if that was not run; with `manuscript`, the page links ``paper.pdf``.
    """
    data = {
        "models": [_model(name) for name in MODELS],
        "n": list(study.n),
        "chambers": CHAMBERS,
        "transports": list(STUDY_SAMPLING),
        "fraction": FRACTION,
        "per_octave": PER_OCTAVE,
        "common": int(np.abs(np.array(study.n) - COMMON_N).argmin()),
        "opening": max((i for i, name in enumerate(study.experiments) if name == OPENING), default=0),
        "experiments": [part.facts for part in parts],
    }
    return page_text(
        "report.html.j2",
        STUDY_TEMPLATES,
        study=study,
        data=data,
        answer=answer(parts),
        sampling=STUDY_SAMPLING,
        parts=parts,
        verdict=verdict,
        statuses=STATUS_LOOKS,
        findings=findings,
        stands=STANDS,
        manuscript=manuscript,
    )
