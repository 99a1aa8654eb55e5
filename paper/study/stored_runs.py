"""Files of a study: its parameters, and full-order runs at every step."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from pydantic import TypeAdapter

from pneumo.configuration.experiment import Experiment, Study, plain
from pneumo.errors import ResultError
from pneumo.regular_file import regular_file
from pneumo.simulation.full_order import RUN_STATUS, STATE, Recording, failure
from pneumo.storage.files import absent
from pneumo.storage.layout import CHAMBERS, experiment_labels, status_attributes

LARGEST_JSON = 100_000_000  # bytes


def to_json(study: Study) -> str:
    """Return a study as JSON text, the file that every job of the workflow reads."""
    return json.dumps(plain(study), indent=1, allow_nan=False) + "\n"


def from_json(text: str | bytes) -> Study:
    """Return the study that `to_json` wrote; every float comes back exactly. ValueError if it is none."""
    return TypeAdapter(Study).validate_python(json.loads(text))


def read_study(parameters: Path | str) -> Study:
    """Read a study from its ``parameters.json``; `ResultError` if the file does not hold a study."""
    text = _text(parameters)
    try:
        return from_json(text)
    except (ValueError, RecursionError):
        raise ResultError(f"{parameters}: does not hold a study; delete it and rerun") from None


def read_json(path: Path | str) -> Any:
    """Content of a JSON file; `ResultError` if the file is missing, truncated or no JSON."""
    text = _text(path)
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        raise ResultError(f"{path}: not a whole JSON file; delete it and rerun") from None


def _text(path: Path | str) -> bytes:
    try:
        with regular_file(Path(path), LARGEST_JSON) as file:
            return file.read()
    except FileNotFoundError:
        raise absent(path) from None
    except OSError as error:
        raise ResultError(f"{path}: not readable ({error.strerror})") from None


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


def failure_text(run: xr.Dataset, what: str = "full-order run") -> str:
    """Sentence that says when and in which state a stored run failed; `what` names the kind of run."""
    meaning = run["status"].attrs["flag_meanings"].split()[int(run["status"])].replace("_", " ")
    x, v, P_A, T_A, P_B, T_B = run["status"].attrs["last_state"].tolist()
    return (
        f"{what} failed at t = {run['failure_time'].item():g} s: {meaning}, after x = {x:.4g} m,"
        f" v = {v:.4g} m/s, P = {P_A:.4g} and {P_B:.4g} Pa, T = {T_A:.4g} and {T_B:.4g} K"
    )
