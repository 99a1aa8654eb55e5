"""From replays at every step to the traces and errors by interval that the report shows."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np
import xarray as xr

from paper.study.samplings import study_sampling
from pneumo.catalogue import conductance_factor
from pneumo.configuration.experiment import Experiment, Study
from pneumo.configuration.sampling import Sampling
from pneumo.physics.models import MODELS, full_order_lane, lane_array
from pneumo.simulation.full_order import Recording
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import OK, Replayed, replay_in_parts
from pneumo.storage.files import attributes, write
from pneumo.storage.layout import CHAMBERS, described, experiment_labels, replay_dataset, same_at_every_n

INTERVALS = 240  # of a run, for which errors of every step are stored
CLOSE_UP = 2.0  # s, from a third of the run on, in finer samples and intervals
CLOSE_UP_SAMPLE = 0.005  # s, at most
CLOSE_UP_INTERVAL = 0.25  # s
PIECE = 512  # steps whose pressures, of all lanes, fit into a processor's cache
COMMON_N = 1.35  # beside each model's best n
CHOICES = ("best", "common")  # of n
# Full orders with a wrong k_0 -> sign in the exponent of the factor within which an unmeasured one is known.
WRONG_WALLS = {"full, high k_0": 1, "full, low k_0": -1}
TRACED = (*MODELS, *WRONG_WALLS)

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
        # Steps side by side in memory, along which `reduceat` is several times faster.
        error = np.empty((2, len(lanes), len(P)))
        full = self.full[first:end].T[:, None]
        for part in range(0, len(P), PIECE):
            piece = slice(part, part + PIECE)
            np.subtract(full[..., piece], P[piece].transpose(1, 2, 0), out=error[..., piece])
        within = self.begins[(self.begins > first) & (self.begins < end)] - first
        parts = np.array([0, *within])
        interval = np.searchsorted(self.begins, first, "right") - 1
        at = slice(interval, interval + len(parts)), slice(None), lanes
        lowest, highest = (of.reduceat(error, parts, axis=2) for of in (np.minimum, np.maximum))
        self.lowest[at] = np.minimum(self.lowest[at], np.moveaxis(lowest, 2, 0))
        self.highest[at] = np.maximum(self.highest[at], np.moveaxis(highest, 2, 0))
        a, b = np.searchsorted(self.shown, (first, end))
        self.samples[a:b, :, lanes] = np.moveaxis(error[..., self.shown[a:b] - first], 2, 0)
        np.square(error, out=error)
        self.squares[at] += np.moveaxis(np.add.reduceat(error, parts, axis=2), 2, 0)

    def of_lanes(self, index: np.ndarray) -> Self:
        """Keep errors of the lanes with these indices only; a lane may be there more than once."""
        for name in ("samples", "lowest", "highest", "squares"):
            setattr(self, name, getattr(self, name)[..., index])
        return self

    def mean_square(self) -> np.ndarray:
        """Mean square error of every step of each interval; the last includes the run's end."""
        return self.squares / np.diff([*self.begins, len(self.full)])[:, None, None]


def replay_and_errors(
    experiment: Experiment, lanes: np.ndarray, recording: Recording, sampling: Sampling
) -> tuple[Replayed, ErrorsOfRun]:
    """Replay lanes on a run as `pneumo.simulation.replay.replay` does, and gather errors of every step."""
    different, index = np.unique(lanes, axis=0, return_inverse=True)  # M1, say, is M2 at n = 1
    stride, full = experiment.pressure_stride, recording.states[:, [2, 4]]
    errors = ErrorsOfRun(full, len(different), shown_steps(experiment), interval_edges(experiment))
    pressure = np.full((len(different), 2, (len(full) - 1) // stride + 1), np.nan)

    def take(of_lanes: np.ndarray, first: int, P: np.ndarray) -> None:
        stored = P[-first % stride :: stride]
        place = -(-first // stride)
        pressure[of_lanes, :, 0] = recording.plant.conditions.P_0
        pressure[of_lanes, :, place : place + len(stored)] = stored.T
        errors.take(of_lanes, first, P)

    result = replay_in_parts(recording, different, sampling, take)._replace(pressure=pressure)
    index = index.ravel()  # NumPy 2.0 gives it another axis
    return Replayed(*(values[index] for values in result)), errors.of_lanes(index)


def traced_lanes(experiment: Experiment, n: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Lanes as of `grid_lanes`, then those of `WRONG_WALLS`, and the lane of each of `TRACED` at each n."""
    plant = experiment.plant
    lanes, index = grid_lanes(n, plant.gas.gamma)
    factor = conductance_factor(plant.cylinder.bore)
    wrong = [full_order_lane(plant.gas.gamma, plant.wall, factor**sign) for sign in WRONG_WALLS.values()]
    rows = np.arange(len(lanes), len(lanes) + len(wrong))
    return np.vstack([lanes, lane_array(wrong)]), np.vstack([index, np.tile(rows[:, np.newaxis], len(n))])


def n_shown(mse: np.ndarray, n: tuple[float, ...]) -> np.ndarray:
    """Index in `n` of each model's best n and of the common n, shape (choice, model).

    `mse` is by (model, n). The best n is -1 if it is NaN at any n: that of a failed replay.
    """
    failed = np.isnan(mse).any(axis=1, keepdims=True)
    best = np.where(failed, [-1], np.where(failed, np.inf, mse).argmin(axis=1, keepdims=True))[:, 0]
    return np.stack([best, np.full(len(best), np.abs(np.array(n) - COMMON_N).argmin())])


def traced(
    experiment: Experiment, n: tuple[float, ...], index: np.ndarray, cells: Replayed, errors: ErrorsOfRun
) -> xr.Dataset:
    """Errors of each of `TRACED` over time, at its best n and at a common n, for the report.

    They are given as samples and, by interval, as mean square, lowest and highest error over all steps.
    `index`, shape (model, n), is from `traced_lanes`; `cells` and `errors` are those of all its lanes, from
    `replay_and_errors`.
    """
    failed = (cells.status != OK).any(axis=1)
    mse = np.where(failed, np.nan, cells.mse.mean(axis=1))[index]
    places = n_shown(mse, n)
    place = index[np.arange(len(TRACED)), places]  # by (choice, model); -1 takes any and is blanked
    missing = (places < 0) | failed[place]

    def by_cell(values: np.ndarray, dtype: type = np.float32) -> np.ndarray:
        """Values of lanes, shape (..., chamber, lane), by (choice, model, chamber, ...)."""
        shown = values[..., place].transpose(2, 3, 1, 0).astype(dtype)
        shown[missing] = np.nan
        return shown

    dims = ("choice", "model", "chamber")
    values: dict[str, Any] = {
        "mean_square": ((*dims, "edge"), by_cell(errors.mean_square(), np.float64)),
        "lowest": ((*dims, "edge"), by_cell(errors.lowest)),
        "highest": ((*dims, "edge"), by_cell(errors.highest)),
        "error": ((*dims, "t"), by_cell(errors.samples)),
        "n_shown": (dims[:2], np.where(places >= 0, np.array(n)[places], np.nan)),
    }
    coords = {
        "choice": list(CHOICES),
        "model": list(TRACED),
        "chamber": CHAMBERS,
        "edge": (
            "edge",
            errors.begins * experiment.h,
            {"units": "s", "long_name": "beginning of an interval"},
        ),
        "t": errors.shown * experiment.h,
    }
    return described(xr.Dataset(values, coords | experiment_labels(experiment)), ABOUT)


def write_replays(study: Study, name: str, recording: Recording, outputs: Mapping[str, Path]) -> None:
    """Replay every model at every n on one experiment, with each signal sampling in `outputs`.

    `outputs` has the file of each sampling's cells. Their errors over time are written into the folder
    `traces` beside its folder.
    """
    e = study.experiments[name]
    lanes, index = traced_lanes(e, study.n)
    for transport, output in outputs.items():
        sampling = study_sampling(transport, e)
        cells, errors = replay_and_errors(e, lanes, recording, sampling)
        about = attributes(
            f"Reduced models replayed on {name}, {transport} signals",
            "Error of every model at every n against the full-order run, and the pressures",
            study.config_sha256,
            e,
            comment=same_at_every_n(),
            transport=transport,
            samples="none: every stage"
            if sampling.rule == "exact"
            else f"{sampling.rule} {sampling.delay[0] * e.h}",
        )
        # Compression would take a fifth of the replays' time and save a third of the space.
        write(replay_dataset(e, study.n, index[: len(MODELS)], cells), output, about, compressed=False)
        about = attributes(
            f"Errors of reduced models on {name}, {transport} signals",
            "Samples; mean square, lowest and highest error of every step by interval; two choices of n",
            study.config_sha256,
            e,
            transport=transport,
        )
        traces = output.parents[1] / "traces" / output.name
        write(traced(e, study.n, index, cells, errors), traces, about, compressed=False)
