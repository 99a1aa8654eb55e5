"""Page to explore the study: one self-contained HTML file."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from paper.study.figures.parts import FIRST_SHOWN
from paper.study.labels import STUDY_SAMPLING
from paper.study.model_looks import FULL_ORDER_LOOK, MODEL_LOOKS, on_dark
from paper.study.pages import STUDY_TEMPLATES
from paper.study.pages.packing import FRACTION, packed, round_number, rounded, rounding_step
from paper.study.pages.verdict_page import axis_fraction
from paper.study.stored_runs import failure_text
from paper.study.trace_layout import (
    COMMON_N,
    TRACED,
    WRONG_WALLS,
    close_up,
    interval_edges,
    lowest_and_highest,
    n_shown,
    shown_steps,
)
from paper_verdict.page import LOOKS as LOOKS_OF_STATUSES
from pneumo.catalogue import conductance_factor, measured_cylinders
from pneumo.configuration.experiment import Experiment, Study
from pneumo.physics.models import MODELS
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
    "yes": ("✓", "scatter"),
    "in part": ("≈", "explained"),
    "depends": ("±", "explained"),
    "no": ("≠", "contradicted"),
    "not run": ("?", "unjudged"),
}
_DASHES = {"full, high k_0": "-", "full, low k_0": (0, (2.0, 2.0))}
LOOKS = MODEL_LOOKS | {name: FULL_ORDER_LOOK._replace(linestyle=dash) for name, dash in _DASHES.items()}
DIGITS = 5  # of a mean square error


class Part(NamedTuple):
    """Data of one experiment in the report page."""

    facts: dict[str, Any]  # names, mean square errors, samples and intervals, rounding steps
    traces: dict[str, str]  # packed signals, and packed errors by sampling


def stored_parts(study: Study, results: Path) -> list[Part]:
    """Read the data of every experiment for the page from a folder of results."""
    parts = []
    folders = {transport: results / transport for transport in STUDY_SAMPLING}
    for name, e in study.experiments.items():
        datum = read(results / "datum" / f"{name}.nc", "u", "x", "P", "status", "failure_time")
        mse = {
            transport: read(path / "replay" / f"{name}.nc", "mse")["mse"]
            for transport, path in folders.items()
        }
        traces = {transport: read(path / "traces" / f"{name}.nc") for transport, path in folders.items()}
        parts.append(part(e, datum, mse, traces))
    return parts


def part(
    experiment: Experiment,
    datum: xr.Dataset,
    mse: Mapping[str, xr.DataArray],
    traces: Mapping[str, xr.Dataset],
) -> Part:
    """Return the data of one experiment for the page, from its files of results by sampling.

    `datum` is its file in ``results/datum``. By sampling: `mse` is from ``results/TRANSPORT/replay``,
    `traces` from ``results/TRANSPORT/traces``.
    """
    shown, edges = shown_steps(experiment), interval_edges(experiment)
    steps, packs = _signals(datum, shown, edges)
    facts: dict[str, Any] = {
        "name": experiment.name,
        "text": experiment_text(experiment),
        "failed": failure_text(datum) if datum["status"] else None,
        "swing": None if datum["status"] else float(datum["P"].var("t").mean()) ** 0.5,  # Pa
        "h": experiment.h,
        "stride": experiment.pressure_stride,
        "close_up": close_up(experiment),
        "finer": int(np.diff(shown).min(initial=experiment.pressure_stride)),
        "edges": edges.tolist(),
        "steps": steps,
        "cells": {},
    }
    for transport, cells in traces.items():
        counts = xr.DataArray([*np.diff(edges[:-1]), edges[-1] - edges[-2] + 1], dims="edge")
        of_walls = cells["mean_square"].isel(choice=0, drop=True).sel(model=list(WRONG_WALLS))
        of_walls = of_walls.weighted(counts).mean("edge", skipna=False).expand_dims(n=mse[transport]["n"])
        of_models = xr.concat([mse[transport], of_walls], "model", coords="minimal", compat="override")
        of_models = of_models.sel(model=list(TRACED), chamber=CHAMBERS).transpose("model", "n", "chamber")
        best, _ = n_shown(of_models.mean("chamber", skipna=False).values, tuple(of_models["n"].values))
        least = np.sqrt(of_models.min("n").values)  # NaN where every n failed
        steps, errors = _errors(cells, least)
        packs |= {f"{transport}-{name}": text for name, text in errors.items()}
        facts["cells"][transport] = {
            "mse": _shortened(of_models.values),
            "best": [place if place >= 0 else None for place in best.tolist()],
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
    cells = cells.sel(model=list(TRACED), chamber=CHAMBERS)
    n = cells["n_shown"].transpose("model", "choice").values
    dims = ("model", "chamber", "choice", ...)
    error, lowest, highest, square = (
        cells[name].transpose(*dims).values for name in ("error", "lowest", "highest", "mean_square")
    )
    logarithms = np.log2(np.maximum(square, LEAST_SQUARE))
    steps, samples, limits, squares = [], [], [], []
    for m, name in enumerate(TRACED):
        has_n = name in MODELS and MODELS[name].has_n
        rows = slice(None) if has_n and len(set(n[m].tolist())) > 1 else slice(0, 1)
        for c in range(len(CHAMBERS)):
            ends = np.stack([lowest[m, c, rows], highest[m, c, rows]], axis=1)
            largest = np.abs(ends[np.isfinite(ends)]).max(initial=0.0)
            step = rounding_step(least[m, c], float(largest))
            steps.append(step)
            samples.append(rounded(error[m, c, rows], step))
            limits.append(rounded(ends.reshape(-1, ends.shape[-1]), step))
            squares.append(rounded(logarithms[m, c, rows], 1 / PER_OCTAVE))
    return steps, {"errors": packed(samples), "limits": packed(limits), "squares": packed(squares)}


class Overview(NamedTuple):
    """What a reader learns first: headline, sentences, and a figure of every model's error."""

    headline: str = "How far is each reduced model of the air from the full order?"
    text: str = "No model ran through every experiment."
    rows: Sequence[tuple[dict[str, Any], str, float]] = ()  #: model, error in kPa, place on the axis
    ticks: Sequence[tuple[str, float]] = ()  #: error in kPa, place on the axis, from 0 to 1


def overview(study: Study, parts: Sequence[Part]) -> Overview:
    """Compare the models, at their best n in each run, with full orders that assume a wrong k_0.

    Signals are exact. Failed runs do not count, nor do models that fail in another.
    """
    facts = [part.facts for part in parts if not part.facts["failed"]]
    runs = [of_run["cells"]["exact"] for of_run in facts]
    square: dict[str, list[float]] = {}
    for m, name in enumerate(TRACED):
        at_best = [(run["mse"][m], run["best"][m]) for run in runs]
        if runs and all(place is not None for _, place in at_best):
            square[name] = [float(np.mean(mse[place])) for mse, place in at_best]
    means = sorted((float(np.mean(values)) ** 0.5 / KILO, name) for name, values in square.items())
    rms = {name: value for value, name in means if value > 0}
    kpa = {name: f"{value:#.2g}".rstrip(".") for name, value in rms.items()}
    reduced, walls = ([name for name in rms if (name in MODELS) == of] for of in (True, False))
    if not reduced:
        return Overview()
    swing = float(np.mean([of_run["swing"] ** 2 for of_run in facts])) ** 0.5 / KILO
    over = "in the only run" if len(runs) == 1 else f"in {len(runs)} runs"
    at_one_n = {name: _at_one_n(runs, name) for name in reduced}
    ranked = sorted(reduced, key=lambda name: at_one_n[name])
    best = ranked[0]
    lead = "For a machine, take the full order. " if walls else ""
    truth = "it" if walls else "the full order"
    drifts = MODELS[best].temperature == "polytropic" and MODELS[best].wall != "none"
    aside = ", which drifts in a closed chamber," if drifts else ""
    headline = (
        f"{lead}Of the reduced models, {best}{aside} comes nearest to {truth}: off by"
        f" {at_one_n[best]:#.2g} kPa RMS with one n for all runs, {kpa[best]} kPa with the best n for each"
    )
    advice: list[str] = []
    if walls:
        factors = {conductance_factor(e.plant.cylinder.bore) for e in study.experiments.values()}
        known = " to ".join(dict.fromkeys(f"{factor:.2g}" for factor in sorted(factors)))
        errors = " to ".join(dict.fromkeys(kpa[name] for name in walls))
        worst = walls[-1]  # lowest error first
        better = [name for name in reduced if rms[name] < rms[worst]]
        tuned = ""
        if better:
            tuned = (
                f" {_subject(better)} off by less than {kpa[worst]} kPa, but only with the right k_0 and the"
                " best n for each run, which nobody knows beforehand."
            )
        advice.append(
            f"The full order is off by only {errors} kPa even if k_0, the wall's conductance, is wrong by a"
            f" factor of {known}, which is how well {measured_cylinders()} show it.{tuned} M7 to M10"
            " drift in a closed chamber: never take them where a machine starts vented or rests with the"
            " valve shut."
        )
    free = [name for name in ranked if MODELS[name].wall == "none"]
    if free and MODELS[best].wall != "none":
        advice.append(
            f"{free[0]}, which needs no k_0, is off by {at_one_n[free[0]]:#.2g} kPa with one n for all runs,"
            f" {kpa[free[0]]} kPa with the best n for each."
        )
    advice.append("For a cylinder of your own, run pneumo init and pneumo study.")
    text = [
        "The full order computes pressure and temperature of each chamber, the reduced models M1 to M10 the"
        f" pressure alone, with a polytropic index n. They were compared {over} with the right k_0 and the"
        " same command and motion. These are exact here; in the paper they were sampled every millisecond."
        f" {best}'s {at_one_n[best]:#.2g} kPa are {100 * at_one_n[best] / swing:.2g} % of the pressures'"
        " swing."
    ]
    wins = Counter(min(reduced, key=lambda name: square[name][run]) for run in range(len(runs)))
    if len(runs) > 1:
        (first, most), *others = wins.most_common()
        listed = ", ".join([f"{first} in {most} runs", *(f"{name} in {count}" for name, count in others)])
        text.append(f"Runs with large errors dominate these averages. The nearest model is {listed}.")
    low, high = round_number(min(rms.values()), up=False), round_number(1.01 * max(rms.values()), up=True)
    numbers = (factor * 10.0**power for power in range(-9, 9) for factor in (1, 2, 5))
    ticks = [(f"{tick:g}", axis_fraction(tick, low, high)) for tick in numbers if low <= tick <= high]
    rows = [(_model(name), kpa[name], axis_fraction(value, low, high)) for name, value in rms.items()]
    paragraphs = [" ".join(sentences) for sentences in (advice, text) if sentences]
    return Overview(headline, "\n".join(paragraphs), rows, ticks)


def _subject(names: Sequence[str]) -> str:
    """Names as the subject of a sentence, with its verb."""
    *first, last = names
    return f"{', '.join(first)} and {last} are" if first else f"{last} is"


def _at_one_n(runs: Sequence[Mapping[str, Any]], model: str) -> float:
    """RMS error of a model over all runs, kPa, at the one n where it is least."""
    m = TRACED.index(model)
    square = np.array([run["mse"][m] for run in runs], float).mean(axis=(0, 2))  # failed: NaN
    return float(np.nanmin(square)) ** 0.5 / KILO


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
    run = f"{experiment.loop} loop, k₀ = {plant.k_0:.2g} W/K, {experiment.duration:.6g} s"
    return f"cylinder {experiment.cylinder} ({size}), {run}"


def _model(name: str) -> dict[str, Any]:
    look, model = LOOKS[name], MODELS.get(name)
    text = f"{name} by the factor within which it is known without a measurement"
    if model is not None:
        mixing = "mixing" if model.mixing else "no mixing"
        indices = " / ".join(dict.fromkeys(map(str, (model.n_V, model.n_in, model.n_out))))
        text = f"index {indices}, {model.temperature} temperature, {mixing}, wall heat {model.wall}"
    return {
        "name": name.replace("k_0", "k₀").replace(
            " ", "\u00a0"
        ),  # the page's address has spaces between names
        "text": _with_symbols(text),
        "colour": look.color,
        "on_dark": on_dark(look.color),
        "dash": [] if isinstance(look.linestyle, str) else look.linestyle[1],
        "has_n": model is not None and model.has_n,
        "kind": "wrong" if model is None else "none" if model.wall == "none" else "right",  # its k_0
        "first": name in (*FIRST_SHOWN, "full, high k_0"),
    }


def _with_symbols(text: str) -> str:
    for name, symbol in (("k_0", "k₀"), ("gamma", "γ"), ("lambda_0", "λ₀"), ("lambda", "λ")):
        text = text.replace(name, symbol)
    return text


def reason_text(why: str) -> str:
    """Reason of the findings on why the answer to a statement depends, as a sentence.

    Examples
    --------
    >>> reason_text("yes, but not with a limit of 1.41, E14 left out")
    'yes, but no with a limit of 1.41, or if E14 is left out'
    """
    answer, _, reasons = why.partition(", but not ")
    if not reasons:
        return why.replace(
            "with either signal sampling", "with the paper's signals as well as with exact ones"
        )
    listed = reasons.replace("with like for like", "if like is compared with like").split(", ")
    cases = [reason for reason in listed if not reason.endswith(" left out")]
    experiments = re.findall(r"(E\d+) left out", reasons)
    if experiments:
        *first, last = experiments
        cases.append(f"if {', '.join(first)} or {last} is left out" if first else f"if {last} is left out")
    return f"{answer}, but {'no' if answer == 'yes' else 'yes'} {', or '.join(cases)}"


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
        "models": [_model(name) for name in TRACED],
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
        overview=overview(study, parts),
        sampling=STUDY_SAMPLING,
        parts=parts,
        verdict=verdict,
        statuses=LOOKS_OF_STATUSES,
        findings=findings,
        stands=STANDS,
        reason_text=reason_text,
        manuscript=manuscript,
    )
