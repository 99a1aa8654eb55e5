"""From arrays of replays to the dataset of grid cells that is stored."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment, Study
from pneumo.configuration.sampling import Sampling
from pneumo.physics.models import MODELS
from pneumo.simulation.full_order import Recording
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import STATUS, Replayed, replay
from pneumo.simulation.signals import study_sampling
from pneumo.storage.files import attributes, write
from pneumo.storage.layout import CHAMBERS, experiment_labels, status_attributes
from pneumo.storage.trace_layout import replay_and_errors, traced


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


def write_replays(study: Study, name: str, recording: Recording, outputs: Mapping[str, Path]) -> None:
    """Replay every model at every n on one experiment, with each signal sampling in `outputs`.

    `outputs` has the file of each sampling's cells. Their errors over time are written into the folder
    `traces` beside its folder.
    """
    e = study.experiments[name]
    lanes, index = grid_lanes(study.n, e.plant.gas.gamma)
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
            samples="none: every stage" if sampling.exact else f"{sampling.rule} {sampling.delay[0] * e.h}",
        )
        write(replay_dataset(e, study.n, index, cells), output, about)
        about = attributes(
            f"Errors of reduced models on {name}, {transport} signals",
            "Samples; mean square, lowest and highest error of every step by interval; two choices of n",
            study.config_sha256,
            e,
            transport=transport,
        )
        write(traced(e, study.n, index, cells, errors), output.parents[1] / "traces" / output.name, about)
