"""Settling times, Fig. 7 and Table 5: push the piston onto a stop, hold, release, watch.

The excitation is zero throughout: in open loop the valve stays shut, in closed loop the
controller pulls the piston back to the centre.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr

from paper.study.stored_runs import add_outcome, states_dataset
from pneumo.configuration.experiment import Experiment
from pneumo.errors import RunError
from pneumo.simulation.full_order import (
    RAN,
    RUN_STATUS,
    STATE,
    equilibrium,
    failure,
    run,
    thermal_time_constant,
)
from pneumo.storage.layout import experiment_labels

LONGEST_TRACE = 20_000  # samples of a stored trace; the settling times come from every step
QUANTITIES = ("P_A", "P_B", "T_A", "T_B")  # rows of Table 5, in printed order
CRITERION = 0.01  # section 4: 1 per cent
LEAST_HOLD = 1.267  # s; the release of the run in section 4's text
# s; ASSUME. Any time from 2.6 to 4.4 gives the same settling times: E09, E13 and E15 need the first, and
# E06's run ends by itself after the second.
LEAST_FREE_RUN = 3.0
SHORTEST_WINDOW = (
    0.5  # s; a run is made in pieces of a thermal time constant, or of this where wall heat is faster
)
LONGEST_RUN = 1e5  # s
LONGEST_IN_WINDOWS = 1000  # thermal time constants; a loop that never stops swinging is given up then
TOO_SLOW, NOT_AT_REST, NOT_SETTLED = 3, 4, 5
SETTLING_STATUS = RUN_STATUS | {
    TOO_SLOW: "thermal time constant too long for a run",
    NOT_AT_REST: "air of the held piston not back near T_amb within the longest run",
    NOT_SETTLED: "not settled when the run ended",
}


class Settling(NamedTuple):
    """A run for Table 5: the piston is pushed onto its stop, held, released, and settles."""

    times: np.ndarray  # of P_A, P_B, T_A, T_B from the release, s, shape (4,); NaN where there are none
    states: np.ndarray  # (x, v, P_A, T_A, P_B, T_B) by step from the start of the push, shape (steps + 1, 6)
    release_step: int  # at which the force is released
    status: int = RAN  # key of `SETTLING_STATUS`; anything but 0 leaves the run without settling times
    failure_step: int = -1  # step at which the run failed or was given up, or -1


def settling_time(series: np.ndarray, final: float, change: float, h: float) -> float:
    """Time, s, after which a series differs from `final` by at most 1 per cent of `change`; NaN if never.

    h is the time between samples, s.
    """
    outside = np.nonzero(np.abs(series - final) > CRITERION * abs(change))[0]
    if not len(outside):
        return 0.0
    return (outside[-1] + 1) * h if outside[-1] + 1 < len(series) else np.nan


def settling_times(free: np.ndarray, T_amb: float, h: float) -> np.ndarray:
    """Settling times of P_A, P_B, T_A, T_B after the release, s; NaN where one has not settled.

    `free` holds the six states at every step from the release on, h s apart. ASSUME (decision 35):
    a pressure settles to its last value, within 1 per cent of its change since the release; a temperature
    settles to T_amb, within 1 per cent of its largest deviation from it.
    """
    times = []
    for quantity in QUANTITIES:
        series = free[:, STATE.index(quantity)]
        final = series[-1] if quantity.startswith("P") else T_amb
        change = series[0] - final if quantity.startswith("P") else np.abs(series - final).max()
        times.append(settling_time(series, final, change, h))
    return np.array(times)


def _back_near(states: np.ndarray, T_amb: float, near: float, least: int) -> int:
    """First step, `least` or later, at which both temperatures have come back to within `near` K of T_amb.

    -1 if there is none.
    """
    inside = (np.abs(states[:, [STATE.index("T_A"), STATE.index("T_B")]] - T_amb) <= near).all(axis=1)
    back = inside & np.logical_or.accumulate(~inside)
    back[:least] = False
    return int(back.argmax()) if back.any() else -1


def _without_times(states: np.ndarray, release_step: int, given_up: int) -> Settling:
    """Result of a run without settling times: its failure or, if it did not fail, the status `given_up`."""
    status, step = failure(states)
    if status == RAN:
        status, step = given_up, len(states) - 1
    states[step + 1 :] = np.nan
    return Settling(np.full(len(QUANTITIES), np.nan), states, release_step, status, step)


def settle(experiment: Experiment) -> Settling:
    """Push the piston onto a stop, hold it, release it, and measure the settling times of Table 5.

    The piston is held until both temperatures have come back to within `Push.near` of T_amb. After the
    release the run ends when they have done so again, or after `Push.stop` s where that is given. A run that
    fails, takes longer than `LONGEST_IN_WINDOWS` thermal time constants (each counted as at least 0.5 s) or
    than `LONGEST_RUN` in either part, or ends before all quantities have settled has no settling times, and a
    status that says why.

    Raises
    ------
    RunError
        If there is no force: the cylinder has no section `settling`.
    """
    h, drive, push = experiment.h, experiment.drive, experiment.push
    if not push.force:
        raise RunError(f"{experiment.name}: a settling run needs its cylinder's section settling")
    plant, valve = experiment.plant, experiment.plant.valve
    valve = valve._replace(leak=valve.leak + push.leak, net_leak=push.leak > 0)
    plant = plant._replace(valve=valve, cylinder=plant.cylinder._replace(x_min=push.x_stop))
    T_amb = plant.conditions.T_amb
    window = max(thermal_time_constant(plant), SHORTEST_WINDOW)
    longest = min(LONGEST_RUN, LONGEST_IN_WINDOWS * window)
    if not window < longest / 10:
        return _without_times(equilibrium(plant)[np.newaxis], 0, TOO_SLOW)

    def until_near(start: np.ndarray, force: float, least: float) -> tuple[np.ndarray, bool]:
        """States from `start` until the air is near T_amb, after at least `least` s; whether it came near."""
        states, zeros = start[np.newaxis], np.zeros(round(window / h) + 1)
        while True:
            piece = run(states[-1], zeros, force, drive, plant, h, 0).states
            states = np.concatenate([states, piece[1:]])
            end = _back_near(states, T_amb, push.near, round(least / h))
            if end >= 0:
                return states[: end + 1], True
            if failure(piece)[0] != RAN or len(states) * h > longest:
                return states, False

    hold, near = until_near(equilibrium(plant), push.force, LEAST_HOLD)
    if not near:
        return _without_times(hold, len(hold) - 1, NOT_AT_REST)
    if push.stop:
        free = run(hold[-1], np.zeros(round(push.stop / h) + 1), 0.0, drive, plant, h, 0).states
    else:
        free, near = until_near(hold[-1], 0.0, LEAST_FREE_RUN)
    states, times = np.concatenate([hold, free[1:]]), settling_times(free, T_amb, h)
    if not near or failure(free)[0] != RAN or np.isnan(times).any():
        return _without_times(states, len(hold) - 1, NOT_SETTLED)
    return Settling(times, states, len(hold) - 1)


def settling_dataset(experiment: Experiment, settling: Settling) -> xr.Dataset:
    """Traces and settling times of one settling run: piston pushed onto a stop, held, released.

    A long trace is thinned, but keeps the steps from which the settling times follow: the release, the
    largest deviation of each temperature, the last step outside each quantity's band and the next, the end.
    """
    states, release = settling.states, settling.release_step
    every = -(-len(states) // LONGEST_TRACE)
    settled = release + np.round(settling.times[np.isfinite(settling.times)] / experiment.h).astype(int)
    T_amb = experiment.plant.conditions.T_amb
    off = np.abs(states[release:, [STATE.index("T_A"), STATE.index("T_B")]] - T_amb)
    peaks = release + np.nan_to_num(off).argmax(axis=0)
    kept = np.concatenate(
        [np.arange(0, len(states), every), [release, len(states) - 1], peaks, settled - 1, settled]
    )
    steps = np.unique(kept)
    dataset = states_dataset(states[steps], steps * experiment.h)
    dataset["t"].attrs = {
        "comment": f"every {every} steps of {experiment.h:g} s, and those from which settling_time follows"
    }
    dataset["T_amb"] = ((), T_amb)
    dataset["settling_time"] = ("quantity", settling.times)
    about = {"units": "s", "long_name": "time at which the force is released"}
    dataset["release_time"] = ((), settling.release_step * experiment.h, about)
    outcome = settling.status, settling.failure_step, experiment.h, SETTLING_STATUS
    add_outcome(dataset, settling.states, *outcome)
    return dataset.assign_coords(quantity=list(QUANTITIES)).assign_coords(experiment_labels(experiment))
