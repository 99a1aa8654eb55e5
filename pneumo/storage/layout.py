"""From arrays of a full-order or settling run to the datasets that are stored, and back."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment
from pneumo.simulation.full_order import RUN_STATUS, STATE, Recording, failure
from pneumo.simulation.settling import QUANTITIES, SETTLING_STATUS, Settling

CHAMBERS = ["A", "B"]
LONGEST_TRACE = 20_000  # samples of a settling trace; the settling times come from every step


def experiment_labels(experiment: Experiment) -> dict[str, object]:
    """Scalar coordinates of every file about one experiment: its name, cylinder, loop and k_0."""
    return {
        "experiment": experiment.name,
        "cylinder": experiment.cylinder,
        "loop": "closed" if experiment.drive.closed_loop else "open",
        "k_0": experiment.plant.k_0,
    }


def status_attributes(meanings: Mapping[int, str], what: str) -> dict[str, object]:
    """CF attributes of a status."""
    return {
        "long_name": what,
        "flag_values": np.array(list(meanings), dtype=np.int8),
        "flag_meanings": " ".join(text.replace(" ", "_") for text in meanings.values()),
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


def _add_outcome(
    dataset: xr.Dataset, states: np.ndarray, status: int, step: int, h: float, meanings: Mapping[int, str]
) -> None:
    """Add the status of a run, the time of its failure and its last state before that."""
    dataset["status"] = ((), np.int8(status), status_attributes(meanings, "what became of the run"))
    dataset["failure_time"] = ((), step * h if status else np.nan)
    if status:
        dataset["status"].attrs["last_state"] = states[max(step - 1, 0)]
        dataset["status"].attrs["comment"] = (
            f"last_state is {', '.join(STATE)} before the failure, in SI units"
        )


def settling_dataset(experiment: Experiment, settling: Settling) -> xr.Dataset:
    """Traces and settling times of one settling run: piston pushed onto a stop, held, released."""
    every = -(-len(settling.states) // LONGEST_TRACE)
    t = np.arange(len(settling.states))[::every] * experiment.h
    dataset = _states_dataset(settling.states[::every], t)
    dataset["settling_time"] = ("quantity", settling.times)
    dataset["release_time"] = ((), settling.release_step * experiment.h, {"units": "s"})
    dataset["release_time"].attrs["long_name"] = "time at which the force is released"
    outcome = settling.status, settling.failure_step, experiment.h, SETTLING_STATUS
    _add_outcome(dataset, settling.states, *outcome)
    return dataset.assign_coords(quantity=list(QUANTITIES)).assign_coords(experiment_labels(experiment))


def datum_dataset(experiment: Experiment, recording: Recording) -> xr.Dataset:
    """Every step of one full-order run."""
    t = np.arange(len(recording.states)) * experiment.h
    dataset = _states_dataset(recording.states, t)
    dataset["u"] = ("t", recording.u)
    unit, what = ("m", "position reference") if experiment.drive.closed_loop else ("V", "open-loop sequence")
    dataset["reference"] = ("t", recording.reference, {"units": unit, "long_name": what})
    status, step = failure(recording.states)
    _add_outcome(dataset, recording.states, status, step, experiment.h, RUN_STATUS)
    return dataset.assign_coords(experiment_labels(experiment))


def failure_text(run: xr.Dataset, what: str = "full-order run") -> str:
    """Sentence on when and in which state a full-order or settling run failed."""
    meaning = run["status"].attrs["flag_meanings"].split()[int(run["status"])].replace("_", " ")
    x, v, P_A, T_A, P_B, T_B = run["status"].attrs["last_state"].tolist()
    return (
        f"{what} failed at t = {run['failure_time'].item():g} s: {meaning}, after x = {x:.4g} m,"
        f" v = {v:.4g} m/s, P = {P_A:.4g} and {P_B:.4g} Pa, T = {T_A:.4g} and {T_B:.4g} K"
    )


def recording_from(dataset: xr.Dataset, experiment: Experiment) -> Recording:
    """Full-order run of an experiment as the replays see it, from its stored datum."""
    P, T = dataset["P"].values, dataset["T"].values
    columns = [dataset["x"].values, dataset["v"].values, P[:, 0], T[:, 0], P[:, 1], T[:, 1]]
    states, reference, u = np.stack(columns, axis=1), dataset["reference"].values, dataset["u"].values
    return Recording(states, reference, u, experiment.drive, experiment.plant, experiment.h)
