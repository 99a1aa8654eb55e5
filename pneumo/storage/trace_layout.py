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
from pneumo.simulation.replay import OK, replay_in_parts
from pneumo.simulation.signals import study_sampling
from pneumo.storage.files import attributes, write
from pneumo.storage.layout import CHAMBERS, described, experiment_labels

INTERVALS = 240  # of a run, for which errors of every step are stored
CLOSE_UP = 2.0  # s, from a third of the run on, in finer samples and intervals
CLOSE_UP_SAMPLE = 0.005  # s, at most
CLOSE_UP_INTERVAL = 0.25  # s
COMMON_N = 1.35  # beside each model's best n
CHOICES = ("best", "common")  # of n

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


class ErrorsOfRun:
    """Errors of lanes on one run: samples, and by interval the extremes and the mean square of all steps.

    Arrays have the shape (shown step or interval, chamber, lane).
    """

    def __init__(self, full: np.ndarray, lanes: int, shown: np.ndarray, edges: np.ndarray) -> None:
        """`full` are the full order's pressures, Pa, shape (step, chamber)."""
        self.full, self.shown, self.begins = full, shown, edges[:-1]
        self.samples = np.zeros((len(shown), 2, lanes))
        self.lowest, self.highest, self.squares = np.zeros((3, len(self.begins), 2, lanes))

    def take(self, lanes: np.ndarray, first: int, P: np.ndarray) -> None:
        """Add pressures from `pneumo.simulation.replay.replay_in_parts`, of steps from `first` on."""
        if first == 1:  # at the first step of all the error is zero
            for values, initial in ((self.lowest, np.inf), (self.highest, -np.inf), (self.squares, 0.0)):
                values[:, :, lanes] = initial
                values[0][:, lanes] = 0.0
            self.samples[0][:, lanes] = 0.0
        end = first + len(P)
        error = self.full[first:end, :, None] - P
        within = self.begins[(self.begins > first) & (self.begins < end)] - first
        parts = np.array([0, *within])
        interval = np.searchsorted(self.begins, first, "right") - 1
        at = slice(interval, interval + len(parts)), slice(None), lanes
        self.lowest[at] = np.minimum(self.lowest[at], np.minimum.reduceat(error, parts))
        self.highest[at] = np.maximum(self.highest[at], np.maximum.reduceat(error, parts))
        self.squares[at] += np.add.reduceat(error**2, parts)
        a, b = np.searchsorted(self.shown, (first, end))
        self.samples[a:b, :, lanes] = error[self.shown[a:b] - first]

    def mean_square(self) -> np.ndarray:
        """Mean square error of every step of each interval; the last includes the run's end."""
        return self.squares / np.diff([*self.begins, len(self.full)])[:, None, None]


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
    needed = np.unique(lane_of[places >= 0])
    errors = ErrorsOfRun(recording.states[:, [2, 4]], len(needed), shown, edges)
    replayed = replay_in_parts(recording, lanes[needed], study_sampling(transport, experiment), errors.take)
    place = np.searchsorted(needed[:-1], lane_of)
    missing = (places < 0) | (replayed.status != OK).any(axis=1)[place]

    def by_cell(values: np.ndarray, dtype: type = np.float32) -> np.ndarray:
        """Values of lanes, shape (..., chamber, lane), by (choice, model, chamber, ...)."""
        cells = values[..., place].transpose(2, 3, 1, 0).astype(dtype)
        cells[missing] = np.nan
        return cells

    dims = ("choice", "model", "chamber")
    values: dict[str, Any] = {
        "mean_square": ((*dims, "edge"), by_cell(errors.mean_square(), np.float64)),
        "lowest": ((*dims, "edge"), by_cell(errors.lowest)),
        "highest": ((*dims, "edge"), by_cell(errors.highest)),
        "error": ((*dims, "t"), by_cell(errors.samples)),
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
