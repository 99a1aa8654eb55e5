"""From arrays of replays to the dataset of grid cells that is stored; common parts of such datasets."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment
from pneumo.configuration.sampling import Sampling
from pneumo.physics.models import MODELS
from pneumo.simulation.full_order import RUN_STATUS, Recording, failure
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import STATUS, Replayed, replay

CHAMBERS = ["A", "B"]


def experiment_labels(experiment: Experiment) -> dict[str, object]:
    """Scalar coordinates of every file about one experiment: its name, cylinder, loop and k_0."""
    return {
        "experiment": experiment.name,
        "cylinder": experiment.cylinder,
        "loop": experiment.loop,
        "k_0": experiment.plant.k_0,
    }


def status_attributes(meanings: Mapping[int, str], long_name: str) -> dict[str, object]:
    """CF attributes (flag_values, flag_meanings) of a status variable, from the meaning of each value."""
    return {
        "long_name": long_name,
        "flag_values": np.array(list(meanings), dtype=np.int8),
        "flag_meanings": " ".join(text.replace(" ", "_") for text in meanings.values()),
    }


def described(dataset: xr.Dataset, about: Mapping[str, tuple[str, str]]) -> xr.Dataset:
    """Copy of a dataset whose variables get the (unit, long name) that `about` has for them, by name."""
    dataset = dataset.copy()
    for name, (unit, long_name) in about.items():
        dataset[name].attrs = {"units": unit, "long_name": long_name}
    return dataset


def run_outcome(recording: Recording) -> dict[str, Any]:
    """Variables `run_status` and `run_failure_time`, s, for files that hold several full-order runs."""
    status, step = failure(recording.states)
    about = status_attributes(RUN_STATUS, "what became of the full-order run")
    failure_time = step * recording.h if status else np.nan
    return {
        "run_status": ((), np.int8(status), about),
        "run_failure_time": ((), failure_time, {"units": "s", "long_name": "when it failed"}),
    }


def same_at_every_n() -> str:
    """Sentence that names the models without n, for the comment of a results file."""
    *others, last = [name for name, model in MODELS.items() if not model.has_n]
    return f"{', '.join(others)} and {last} have no n: they hold the same cell at every n"


def replayed_grid(
    experiment: Experiment, n: tuple[float, ...], recording: Recording, sampling: Sampling, stride: int
) -> xr.Dataset:
    """Replay every model at every n on one experiment; pressures are kept every `stride` steps."""
    lanes, index = grid_lanes(n, experiment.plant.gas.gamma)
    return replay_dataset(experiment, n, index, replay(recording, lanes, sampling, stride))


def replay_dataset(
    experiment: Experiment, n: tuple[float, ...], index: np.ndarray, cells: Replayed
) -> xr.Dataset:
    """Dataset of one experiment's replays: errors, status and pressures by (model, n, chamber).

    `index`, shape (model, n), is the row of `cells` that each model has at each n, from `grid_lanes`.
    """
    dims = ("model", "n", "chamber")
    failed = cells.status != 0

    def cell(values: np.ndarray) -> np.ndarray:
        return np.where(failed, np.nan, values)[index]

    failure_time = np.where(failed, cells.failure_step * experiment.h, np.nan)[index]
    status = status_attributes(STATUS, "what became of the cell")
    t = np.arange(cells.pressure.shape[-1]) * experiment.pressure_stride * experiment.h
    return xr.Dataset(
        {
            "mean_error": (dims, cell(cells.mean_error)),
            "variance": (dims, cell(cells.variance)),
            "mse": (dims, cell(cells.mse)),
            "status": (dims, cells.status[index], status),
            "failure_time": (dims, failure_time),
            "pressure": ((*dims, "t"), cells.pressure.astype(np.float32)[index]),
        },
        coords={"model": list(MODELS), "n": list(n), "chamber": CHAMBERS, "t": t}
        | experiment_labels(experiment),
    )
