"""From arrays of a run to the datasets that are stored, and back."""

import numpy as np
import xarray as xr

from pneumo.physics.experiment import Experiment
from pneumo.simulate.datum import STATE, Recording
from pneumo.simulate.settling import QUANTITIES, Settling

CHAMBERS = ["A", "B"]
LONGEST_TRACE = 20_000  # samples of a settling trace; the settling times come from every step


def labels(experiment: Experiment) -> dict[str, object]:
    """Scalar coordinates that say which experiment a file is about."""
    return {
        "experiment": experiment.name,
        "cylinder": experiment.cylinder,
        "loop": "closed" if experiment.drive.closed_loop else "open",
        "k_0": experiment.plant.k_0,
    }


def _states_dataset(states: np.ndarray, t: np.ndarray) -> xr.Dataset:
    columns = dict(zip(STATE, states.T, strict=True))
    return xr.Dataset(
        {
            "x": ("t", columns["x"]),
            "v": ("t", columns["v"]),
            "P": (("t", "chamber"), np.stack([columns["P_A"], columns["P_B"]], axis=1)),
            "T": (("t", "chamber"), np.stack([columns["T_A"], columns["T_B"]], axis=1)),
        },
        coords={"t": t, "chamber": CHAMBERS},
    )


def settling_dataset(experiment: Experiment, settling: Settling) -> xr.Dataset:
    """Traces and settling times of one settling run."""
    every = -(-len(settling.states) // LONGEST_TRACE)
    t = np.arange(len(settling.states))[::every] * experiment.h
    dataset = _states_dataset(settling.states[::every], t)
    dataset["settling_time"] = ("quantity", settling.times)
    dataset["release_time"] = ((), settling.release_step * experiment.h, {"units": "s"})
    dataset["release_time"].attrs["long_name"] = "time at which the force is released"
    return dataset.assign_coords(quantity=list(QUANTITIES)).assign_coords(labels(experiment))


def datum_dataset(experiment: Experiment, recording: Recording) -> xr.Dataset:
    """Every step of one full-order run."""
    t = np.arange(len(recording.states)) * experiment.h
    dataset = _states_dataset(recording.states, t)
    dataset["u"] = ("t", recording.u)
    unit, what = ("m", "position reference") if experiment.drive.closed_loop else ("V", "open-loop sequence")
    dataset["reference"] = ("t", recording.reference, {"units": unit, "long_name": what})
    return dataset.assign_coords(labels(experiment))


def recording_from(dataset: xr.Dataset) -> Recording:
    """Full-order run as the replays see it, from a stored datum."""
    P, T = dataset["P"].values, dataset["T"].values
    columns = [dataset["x"].values, dataset["v"].values, P[:, 0], T[:, 0], P[:, 1], T[:, 1]]
    return Recording(np.stack(columns, axis=1), dataset["reference"].values, dataset["u"].values)
