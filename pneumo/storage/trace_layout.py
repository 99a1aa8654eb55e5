"""From replays at every step to the traces and errors by interval that the report shows."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment, Study
from pneumo.physics.models import MODELS
from pneumo.simulation.full_order import Recording
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.simulation.signals import study_sampling
from pneumo.storage.files import attributes, write
from pneumo.storage.layout import CHAMBERS, described, experiment_labels

INTERVALS = 240  # of a run, for which errors of every step are stored
CLOSE_UP = 2.0  # s, from a third of the run on, in finer samples and intervals
CLOSE_UP_SAMPLE = 0.005  # s, at most
CLOSE_UP_INTERVAL = 0.25  # s
COMMON_N = 1.35  # beside each model's best n
CHOICES = ("best", "common")  # of n
MOST_VALUES = 30_000_000  # pressures in memory at once: 240 MB
LANES = 8  # replayed together at least; fewer would take as long

ABOUT = {
    "mean_square": ("Pa2", "mean square error of all steps from this edge to the next"),
    "lowest": ("Pa", "lowest error of these steps, full order minus reduced"),
    "highest": ("Pa", "highest error of these steps"),
    "error": ("Pa", "full order minus reduced pressure"),
    "n_shown": ("1", "n of each model"),
}


def close_up(experiment: Experiment) -> tuple[int, int]:
    """First and last step of the short part of a run that the report shows enlarged."""
    length = min(round(CLOSE_UP / experiment.h), experiment.steps)
    first = min(experiment.steps // 3, experiment.steps - length)
    first -= first % experiment.pressure_stride
    return first, first + length


def shown_steps(experiment: Experiment) -> np.ndarray:
    """Steps whose samples the report shows: as configured, and more in the enlarged part."""
    first, last = close_up(experiment)
    finer = min(experiment.pressure_stride, max(1, round(CLOSE_UP_SAMPLE / experiment.h)))
    return np.union1d(
        np.arange(0, experiment.steps + 1, experiment.pressure_stride), np.arange(first, last + 1, finer)
    )


def interval_edges(experiment: Experiment) -> np.ndarray:
    """First step of each interval, then the run's last step.

    An interval ends before the next begins; the last one includes the run's last step.
    """
    samples = experiment.steps // experiment.pressure_stride
    long = max(1, -(-samples // INTERVALS)) * experiment.pressure_stride
    first, last = close_up(experiment)
    short = max(1, round(CLOSE_UP_INTERVAL / experiment.h))
    inside = [*range(first, last, short), last]
    return np.unique([*range(0, experiment.steps, long), *inside, experiment.steps])


def lowest_and_highest(values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Lowest and highest value within each interval, over all of its steps: shape (2, interval)."""
    return np.stack([np.minimum.reduceat(values, edges[:-1]), np.maximum.reduceat(values, edges[:-1])])


def mean_by_interval(values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Mean over every step of each interval; the last includes the run's end."""
    return np.add.reduceat(values, edges[:-1]) / np.diff([*edges[:-1], len(values)])


def n_shown(n: tuple[float, ...], best_n: np.ndarray) -> np.ndarray:
    """Index in `n` of each model's best n and of the common n, shape (choice, model).

    The best n is -1 where `best_n` is NaN.
    """
    grid = np.array(n)
    best = [int(np.abs(grid - value).argmin()) if np.isfinite(value) else -1 for value in best_n]
    return np.array([best, np.full(len(best), np.abs(grid - COMMON_N).argmin())])


def traced(
    experiment: Experiment, study: Study, recording: Recording, transport: str, best_n: np.ndarray
) -> xr.Dataset:
    """Errors of each model over time, at its best n and at a common n, for the report.

    They are given as samples and, by interval, as mean square, lowest and highest error over all steps.
    `transport` names the signal sampling, "published" or "exact"; `best_n` is NaN where a model failed at
    some n.
    """
    lanes, index = grid_lanes(study.n, experiment.plant.gas.gamma)
    places = n_shown(study.n, best_n)
    lane_of = index[np.arange(len(MODELS)), places]  # by (choice, model); -1 takes any and is blanked
    edges, shown = interval_edges(experiment), shown_steps(experiment)
    shape = (len(CHOICES), len(MODELS), len(CHAMBERS))
    samples = np.full((*shape, len(shown)), np.nan, dtype=np.float32)
    limits = np.full((2, *shape, len(edges) - 1), np.nan, dtype=np.float32)
    mean_square = np.full((*shape, len(edges) - 1), np.nan)
    full = recording.states[:, [2, 4]].T
    needed = np.unique(lane_of[places >= 0])
    at_once = max(LANES, MOST_VALUES // full.size // LANES * LANES)
    for first in range(0, len(needed), at_once):
        some = needed[first : first + at_once]
        replayed = replay(recording, lanes[some], study_sampling(transport, experiment))
        for lane, status, pressure in zip(some, replayed.status, replayed.pressure, strict=True):
            cells = np.argwhere((lane_of == lane) & (places >= 0))
            for c in range(len(CHAMBERS)) if not status.any() else ():
                error = full[c] - pressure[c]
                of_lane = lowest_and_highest(error, edges), mean_by_interval(error**2, edges), error[shown]
                for choice, model in cells:
                    at = (choice, model, c)
                    limits[:, *at], mean_square[at], samples[at] = of_lane
    dims = ("choice", "model", "chamber")
    values: dict[str, Any] = {
        "mean_square": ((*dims, "edge"), mean_square),
        "lowest": ((*dims, "edge"), limits[0]),
        "highest": ((*dims, "edge"), limits[1]),
        "error": ((*dims, "t"), samples),
        "n_shown": (dims[:2], np.where(places >= 0, np.array(study.n)[places], np.nan)),
    }
    coords = {
        "choice": list(CHOICES),
        "model": list(MODELS),
        "chamber": CHAMBERS,
        "edge": edges[:-1] * experiment.h,
        "t": shown * experiment.h,
    }
    return described(xr.Dataset(values, coords | experiment_labels(experiment)), ABOUT)


def write_traces(
    study: Study,
    name: str,
    recording: Recording,
    best_n: Mapping[str, xr.DataArray],
    outputs: Mapping[str, Path],
    code_sha256: str,
) -> None:
    """Write the errors over time (`traced`) of one experiment, a file for each sampling in `outputs`."""
    e = study.experiments[name]
    for transport, output in outputs.items():
        best = best_n[transport].sel(experiment=name, model=list(MODELS)).values
        about = attributes(
            f"Errors of reduced models on {name}, {transport} signals",
            "Samples; mean square, lowest and highest error of every step by interval; two choices of n",
            study.config_sha256,
            code_sha256,
            e,
            transport=transport,
        )
        write(traced(e, study, recording, transport, best), output, about)
