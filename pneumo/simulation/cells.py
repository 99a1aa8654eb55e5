"""The grid of cells: which lanes it needs, replays of them, and the dataset that holds them all."""

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment
from pneumo.physics.models import MODELS, lane, lane_array
from pneumo.simulation.full_order import RAN, Recording, failure
from pneumo.simulation.reference import PUBLISHED, STATUS, Replayed, no_replay
from pneumo.simulation.vectorised import replay
from pneumo.storage.layout import CHAMBERS, flags, labels


def grid_lanes(n: tuple[float, ...], gamma: float) -> tuple[np.ndarray, np.ndarray]:
    """Lanes of the whole grid and where each cell finds its lane.

    Returns
    -------
    lanes : numpy.ndarray
        Shape (lane, 8): one row per model without n, one per n otherwise.
    index : numpy.ndarray
        Shape (model, n): row of `lanes`. A model without n has the same lane at every n.
    """
    lanes, index = [], np.empty((len(MODELS), len(n)), dtype=int)
    for i, model in enumerate(MODELS.values()):
        if model.has_n:
            index[i] = len(lanes) + np.arange(len(n))
            lanes += [lane(model, value, gamma) for value in n]
        else:
            index[i] = len(lanes)
            lanes.append(lane(model, 1.0, gamma))
    return lane_array(lanes), index


def replayed(
    experiment: Experiment,
    lanes: np.ndarray,
    recording: Recording,
    *,
    transport: str,
    lag: float | np.ndarray = 0.0,
    stride: int = 1,
) -> Replayed:
    """Replay lanes on an experiment's full-order run, or say that there is none where that run failed.

    Parameters are those of `pneumo.simulation.reference.replay`, but that the lag counts for the published
    transport alone.
    """
    status, step = failure(recording.states)
    if status != RAN:
        return no_replay(recording, lanes, step, stride)
    lag = lag if transport == PUBLISHED else 0.0
    e = experiment
    return replay(recording, lanes, e.drive, e.plant, e.h, transport=transport, lag=lag, stride=stride)


def replay_dataset(
    experiment: Experiment, n: tuple[float, ...], index: np.ndarray, cells: Replayed
) -> xr.Dataset:
    """Every grid cell of one experiment."""
    dims = ("model", "n", "chamber")
    failed = cells.status != 0

    def cell(values: np.ndarray) -> np.ndarray:
        return np.where(failed, np.nan, values)[index]

    failure_time = np.where(failed, cells.failure_step * experiment.h, np.nan)[index]
    status = flags(STATUS, "what became of the cell")
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
        coords={"model": list(MODELS), "n": list(n), "chamber": CHAMBERS, "t": t} | labels(experiment),
    )
