"""Page to explore the study: one self-contained HTML file."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment, Study
from pneumo.physics.models import MODELS
from pneumo.publish.labels import STUDY_SAMPLING
from pneumo.publish.model_looks import FIRST_SHOWN, MODEL_LOOKS
from pneumo.publish.pages.packing import FRACTION, packed, rounded, rounding_step
from pneumo.publish.pages.page import STATUS_LOOKS, page_text
from pneumo.storage.files import read
from pneumo.storage.layout import CHAMBERS, failure_text

MOST_VALUES = 6_800_000  # of all traces together: some 4 MB, so that the page stays below 5 MB
CLOSE_UP = (3, 8)  # from a third of the run on, an eighth of it, every stored sample is on the page
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

    facts: dict[str, Any]  # names, mean square errors, the steps to which traces are rounded
    traces: dict[str, str]  # packed full-order pressures, and packed errors by sampling


def page_stride(study: Study) -> int:
    """Return k: outside of close-ups every k-th stored sample is on the page, so that the page fits."""
    rows = sum(len(study.n) if model.has_n else 1 for model in MODELS.values())
    stored = [e.steps // e.pressure_stride + 1 for e in study.experiments.values()]
    room = MOST_VALUES / (rows * len(STUDY_SAMPLING) * len(CHAMBERS))
    every = 1
    while sum(len(shown_samples(count, every)) for count in stored) > room and every < max(stored):
        every += 1
    return every


def close_up(stored: int) -> tuple[int, int]:
    """Return the first and the last sample of a run's close-up."""
    first = stored // CLOSE_UP[0]
    return first, first + stored // CLOSE_UP[1]


def shown_samples(stored: int, every: int) -> np.ndarray:
    """Indices of the samples that the page shows: all in the close-up, one in `every` elsewhere."""
    first, last = close_up(stored)
    return np.union1d(np.arange(0, stored, every), np.arange(first, last + 1))


def stored_parts(study: Study, results: Path) -> list[Part]:
    """Read the data of every experiment for the page from a folder of results."""
    every, parts = page_stride(study), []
    folders = {transport: results / transport for transport in STUDY_SAMPLING}
    best_n = {name: read(path / "statistics.nc", "best_n")["best_n"] for name, path in folders.items()}
    for name, e in study.experiments.items():
        datum = read(results / "datum" / f"{name}.nc", "P", "status", "failure_time")
        replays = {
            transport: read(path / "replay" / f"{name}.nc", "mse", "status", "pressure")
            for transport, path in folders.items()
        }
        best = {transport: of_all.sel(experiment=name) for transport, of_all in best_n.items()}
        parts.append(part(e, datum, replays, best, every))
    return parts


def part(
    experiment: Experiment,
    datum: xr.Dataset,
    replays: Mapping[str, xr.Dataset],
    best_n: Mapping[str, xr.DataArray],
    every: int,
) -> Part:
    """Return the data of one experiment for the page, from its files of results by sampling.

    `datum` is of ``results/datum``, `replays` of ``results/TRANSPORT/replay``; `best_n` has the best n of
    each model; `every` is from `page_stride`.
    """
    full = datum["P"].sel(chamber=CHAMBERS).values.T[:, :: experiment.pressure_stride]
    stored = full.shape[-1]
    chosen = shown_samples(stored, every)
    full = full[:, chosen]
    step = rounding_step(0.0, float(np.nanmax(np.abs(full))))
    facts: dict[str, Any] = {
        "name": experiment.name,
        "text": experiment_text(experiment),
        "failed": failure_text(datum) if datum["status"] else None,
        "dt": experiment.h * experiment.pressure_stride,
        "stored": stored,
        "close_up": close_up(stored),
        "step": step,
        "cells": {},
    }
    traces = {"full": packed([rounded(chamber[None], step) for chamber in full])}
    for transport, replay in replays.items():
        best = best_n[transport].sel(model=list(MODELS)).values
        cells = replay.sel(model=list(MODELS), chamber=CHAMBERS).transpose("model", "chamber", "n", ...)
        steps, traces[transport] = _errors(cells, full, chosen)
        n = cells["n"].values
        facts["cells"][transport] = {
            "mse": _shortened(cells["mse"].transpose("model", "n", "chamber").values),
            "best": [int(np.abs(n - value).argmin()) if np.isfinite(value) else None for value in best],
            "steps": steps,
        }
    return Part(facts, traces)


def _errors(cells: xr.Dataset, full: np.ndarray, chosen: np.ndarray) -> tuple[list[float], str]:
    """Return rounding steps and packed errors: a group per model and chamber, a row per n if it has one."""
    pressure, failed = cells["pressure"].values, cells["status"].values != 0
    least = np.sqrt(cells["mse"].min("n").values)  # NaN where every n failed
    steps, groups = [], []
    for m, model in enumerate(MODELS.values()):
        rows = slice(None) if model.has_n else slice(0, 1)
        for c, chamber in enumerate(full):
            error = chamber - pressure[m, c, rows][:, chosen]
            error[failed[m, c, rows]] = np.nan
            largest = np.abs(error[np.isfinite(error)]).max(initial=0.0)
            steps.append(rounding_step(least[m, c], float(largest)))
            groups.append(rounded(error, steps[-1]))
    return steps, packed(groups)


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
        "every": page_stride(study),
        "experiments": [part.facts for part in parts],
    }
    return page_text(
        "report.html.j2",
        study=study,
        data=data,
        sampling=STUDY_SAMPLING,
        parts=parts,
        verdict=verdict,
        statuses=STATUS_LOOKS,
        findings=findings,
        stands=STANDS,
        manuscript=manuscript,
    )
