"""Settling times, Fig. 7 and Table 5: push the piston onto a stop, hold, release, watch.

The excitation is zero throughout: in open loop the valve stays shut, in closed loop the
controller pulls the piston back to the centre.
"""

from typing import NamedTuple

import numpy as np

from pneumo.configuration.experiment import Experiment, Plant
from pneumo.errors import RunError
from pneumo.physics.cylinder import Side, chamber_of, volume
from pneumo.simulation.full_order import RAN, RUN_STATUS, STATE, equilibrium, failure, run

QUANTITIES = ("P_A", "P_B", "T_A", "T_B")  # rows of Table 5, in printed order
CRITERION = 0.01  # section 4: 1 per cent
SHORTEST_WINDOW = 0.5  # s; filling a chamber takes this long where wall heat is faster
FREE_RUN_PER_SETTLING = 4.0  # the final value must be that of a run well beyond the settling time
LONGEST_RUN = 1e5  # s
LONGEST_IN_WINDOWS = 1000  # thermal time constants; a loop that never stops swinging is given up then
TOO_SLOW, NOT_AT_REST, NOT_SETTLED = 3, 4, 5
SETTLING_STATUS = RUN_STATUS | {
    TOO_SLOW: "thermal time constant too long for a run",
    NOT_AT_REST: "air of the held piston not at rest within the longest run",
    NOT_SETTLED: "not settled within the longest run",
}


class Settling(NamedTuple):
    """A run pushed from equilibrium and released, until it is at rest or its stated stop: Table 5."""

    times: np.ndarray  # of P_A, P_B, T_A, T_B from the release, s, shape (4,); NaN where there are none
    states: np.ndarray  # (x, v, P_A, T_A, P_B, T_B) by step from the start of the push, shape (steps + 1, 6)
    release_step: int  # at which the force is released
    status: int = RAN  # key of `SETTLING_STATUS`; anything but 0 leaves the run without settling times
    failure_step: int = -1  # step at which the run failed or was given up, or -1


def thermal_time_constant(plant: Plant) -> float:
    """Time constant of air at equilibrium against the wall, m c_v / k_0, s (infinite for k_0 = 0)."""
    conditions, gas = plant.conditions, plant.gas
    V = volume(0.0, chamber_of(plant.cylinder, Side.A), plant.cylinder)
    c = conditions.P_0 * V / (conditions.T_0 * (gas.gamma - 1))
    return c / plant.k_0 if plant.k_0 else np.inf


def settling_time(series: np.ndarray, reference_change: float, h: float) -> float:
    """Time after which a series stays within 1 per cent of `reference_change` of its last value, s."""
    outside = np.nonzero(np.abs(series - series[-1]) > CRITERION * abs(reference_change))[0]
    return (outside[-1] + 1) * h if len(outside) else 0.0


def settling_times(free: np.ndarray, h: float) -> np.ndarray:
    """Settling times of P_A, P_B, T_A, T_B after the release, s.

    ASSUME: delta P is the change from release to end. The temperatures start and end near T_amb, so
    delta T is their largest excursion from the end value.
    """
    times = []
    for quantity in QUANTITIES:
        series = free[:, STATE.index(quantity)]
        deviation = series - series[-1]
        change = deviation[0] if quantity.startswith("P") else np.abs(deviation).max()
        times.append(settling_time(series, change, h))
    return np.array(times)


def _without_times(states: np.ndarray, release_step: int, given_up: int) -> Settling:
    """Settling run without settling times: it failed, else it became too long, with the status `given_up`."""
    status, step = failure(states)
    if status == RAN:
        status, step = given_up, len(states) - 1
    states[step + 1 :] = np.nan
    return Settling(np.full(len(QUANTITIES), np.nan), states, release_step, status, step)


def settle(experiment: Experiment, *, longest: float | None = None) -> Settling:
    """Run one settling-time estimation of at most `longest` s (`LONGEST_RUN`, `LONGEST_IN_WINDOWS`).

    After the release it runs for `Push.stop` s where that is given, else until well after it has settled.
    Without settling times, and with a status that says why, if the run fails, the held piston's air does not
    come to rest or the free run does not settle.

    Raises
    ------
    RunError
        If there is no force: the cylinder has no section `settling`.
    """
    h, drive, push = experiment.h, experiment.drive, experiment.push
    if not push.force:
        raise RunError(f"{experiment.name}: a settling run needs its cylinder's section settling")
    plant, valve = experiment.plant, experiment.plant.valve
    plant = plant._replace(valve=valve._replace(leak=valve.leak + push.leak, net_leak=push.leak > 0))
    stopped = plant._replace(cylinder=plant.cylinder._replace(x_min=push.x_stop))
    window = max(thermal_time_constant(plant), SHORTEST_WINDOW)
    longest = min(LONGEST_RUN, LONGEST_IN_WINDOWS * window) if longest is None else longest
    if not window < longest / 10:
        return _without_times(equilibrium(plant)[np.newaxis], 0, TOO_SLOW)
    zeros = np.zeros(round(window / h) + 1)

    pieces = [equilibrium(plant)[np.newaxis]]
    while True:
        piece = run(pieces[-1][-1], zeros, push.force, drive, stopped, h, 0).states
        pieces.append(piece[1:])
        change = np.abs(piece[-1, 2:] - piece[0, 2:]) / equilibrium(plant)[2:]
        if change.max() < push.tolerance:
            break
        if failure(piece)[0] != RAN or len(pieces) * window > longest:
            return _without_times(np.concatenate(pieces), sum(map(len, pieces)) - 1, NOT_AT_REST)
    hold = np.concatenate(pieces)

    length = push.stop or 20 * window
    free = hold[-1:]
    while True:
        zeros = np.zeros(round(length / h) + 2 - len(free))
        free = np.concatenate([free, run(free[-1], zeros, 0.0, drive, plant, h, 0).states[1:]])
        times, failed = settling_times(free, h), failure(free)[0] != RAN
        if not failed and (push.stop or times.max() * FREE_RUN_PER_SETTLING <= length):
            return Settling(times, np.concatenate([hold, free[1:]]), len(hold) - 1)
        length *= 2
        if failed or length > longest:
            return _without_times(np.concatenate([hold, free[1:]]), len(hold) - 1, NOT_SETTLED)
