"""From arrays of a full-order or settling run to the datasets that are stored, and back."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment
from pneumo.simulation.full_order import RUN_STATUS, STATE, Recording, failure

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


def states_dataset(states: np.ndarray, t: np.ndarray) -> xr.Dataset:
    """Dataset of the states, shape (step, 6), at the times t, s."""
    x, v, P_A, T_A, P_B, T_B = states.T
    P, T = (np.stack(pair, axis=1) for pair in ((P_A, P_B), (T_A, T_B)))
    variables = {"x": ("t", x), "v": ("t", v), "P": (("t", "chamber"), P), "T": (("t", "chamber"), T)}
    return xr.Dataset(variables, {"t": t, "chamber": CHAMBERS})


def add_outcome(
    dataset: xr.Dataset, states: np.ndarray, status: int, step: int, h: float, meanings: Mapping[int, str]
) -> None:
    """Add to a dataset, in place, a run's status, the time of its failure, and its last state before that."""
    dataset["status"] = ((), np.int8(status), status_attributes(meanings, "what became of the run"))
    dataset["failure_time"] = ((), step * h if status else np.nan)
    if status:
        comment = f"last_state is {', '.join(STATE)} before the failure, in SI units"
        dataset["status"].attrs |= {"last_state": states[max(step - 1, 0)], "comment": comment}


def run_outcome(recording: Recording) -> dict[str, Any]:
    """Variables `run_status` and `run_failure_time`, s, for files that hold several full-order runs."""
    status, step = failure(recording.states)
    about = status_attributes(RUN_STATUS, "what became of the full-order run")
    failure_time = step * recording.h if status else np.nan
    return {
        "run_status": ((), np.int8(status), about),
        "run_failure_time": ((), failure_time, {"units": "s", "long_name": "when it failed"}),
    }


def datum_dataset(experiment: Experiment, recording: Recording) -> xr.Dataset:
    """Dataset with the signals of one full-order run at every step."""
    t = np.arange(len(recording.states)) * experiment.h
    dataset = states_dataset(recording.states, t)
    dataset["u"] = ("t", recording.u)
    unit, name = ("m", "position reference") if experiment.drive.closed_loop else ("V", "open-loop sequence")
    dataset["reference"] = ("t", recording.reference, {"units": unit, "long_name": name})
    about = {"units": "1", "long_name": "how often the step before was halved"}
    dataset["halvings"] = ("t", np.concatenate([[np.int8(0)], recording.halvings]), about)
    status, step = failure(recording.states)
    add_outcome(dataset, recording.states, status, step, experiment.h, RUN_STATUS)
    return dataset.assign_coords(experiment_labels(experiment))


def failure_text(run: xr.Dataset, what: str = "full-order run") -> str:
    """Sentence that says when and in which state a stored run failed; `what` names the kind of run."""
    meaning = run["status"].attrs["flag_meanings"].split()[int(run["status"])].replace("_", " ")
    x, v, P_A, T_A, P_B, T_B = run["status"].attrs["last_state"].tolist()
    return (
        f"{what} failed at t = {run['failure_time'].item():g} s: {meaning}, after x = {x:.4g} m,"
        f" v = {v:.4g} m/s, P = {P_A:.4g} and {P_B:.4g} Pa, T = {T_A:.4g} and {T_B:.4g} K"
    )


def recording_from(dataset: xr.Dataset, experiment: Experiment) -> Recording:
    """Full-order run of an experiment, as `recorded` returned it, from the file of `datum_dataset`."""
    P, T = dataset["P"].values, dataset["T"].values
    columns = [dataset["x"].values, dataset["v"].values, P[:, 0], T[:, 0], P[:, 1], T[:, 1]]
    states, reference, u = np.stack(columns, axis=1), dataset["reference"].values, dataset["u"].values
    halvings, e = dataset["halvings"].values[1:], experiment
    return Recording(
        states=states,
        reference=reference,
        u=u,
        drive=e.drive,
        plant=e.plant,
        h=e.h,
        halvings=halvings,
        most_halvings=e.most_halvings,
    )
