# pyright: basic
"""How recorded signals reach a replay: what each Runge-Kutta stage reads of u, x and v."""

from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable

from pneumo.configuration.experiment import Experiment
from pneumo.physics.valve import limited
from pneumo.simulation.excitation import command
from pneumo.simulation.full_order import Recording, copy_state, full_order_step
from pneumo.simulation.runge_kutta import STAGES, STEP_TOLERANCE, C

LARGEST_FLOAT = np.finfo(np.float64).max
STUDY_TRANSPORTS = PUBLISHED, EXACT = "published", "exact"  # also names of folders of results


class Reading(NamedTuple):
    """What the stages of a step read of a recorded run."""

    exact: bool  # signals as the full-order run had them at each stage; what follows plays no role then
    held: bool  # samples are held (zero-order hold), not interpolated linearly
    ahead: bool  # held: a stage at the step's end reads the sample there, no longer that of its start
    late: np.ndarray  # delay of u, x and v, in samples, shape (3,); whole numbers where held
    every: int  # steps between samples


class Transport(NamedTuple):
    """How recorded signals reach a replay, Fig. 6."""

    name: str  # ``published`` and ``exact`` are those of the study
    reading: Reading


def _transport(
    name: str, late: float | np.ndarray, every: int, *, held: bool = False, ahead: bool = False
) -> Transport:
    delays = np.array(np.broadcast_to(np.asarray(late, dtype=float), 3))
    return Transport(name, Reading(False, held, ahead, delays, every))


def interpolated(late: float | np.ndarray = 0.0, *, every: int = 1, name: str = "linear") -> Transport:
    """Linear interpolation between samples, `late` samples behind (one number, or one for each signal)."""
    return _transport(name, late, every)


def held(late: float | np.ndarray = 0.0, *, every: int = 1, name: str = "hold") -> Transport:
    """Zero-order hold: every stage reads the sample of its step's start, or one `late` samples before it."""
    return _transport(name, late, every, held=True)


def held_to_next(*, name: str = "hold_next") -> Transport:
    """Zero-order hold, but a stage at the step's end reads the next sample."""
    return _transport(name, 0.0, 1, held=True, ahead=True)


EXACT_TRANSPORT = Transport(EXACT, Reading(True, False, False, np.zeros(3), 1))


def study_transport(name: str, experiment: Experiment) -> Transport:
    """Return one of the study's transports; the published one is what the experiment's sampling says.

    Raises
    ------
    KeyError
        If there is no transport of that name.
    """
    rule, lag = experiment.sampling
    by_rule = {
        "linear": interpolated(lag / experiment.h, name=PUBLISHED),
        "hold": held(name=PUBLISHED),
        "hold_next": held_to_next(name=PUBLISHED),
    }
    return {EXACT: EXACT_TRANSPORT, PUBLISHED: by_rule[rule]}[name]


@register_jitable
def replay_tolerance(reading: Reading) -> float:
    """Error estimate over P_0 above which a replay's step is halved where it may be.

    Where a stage at the step's end reads the next sample, a shorter step would read it for a shorter time: it
    would change the signals, not only follow them more closely. Such a step is halved only where it fails.
    """
    return LARGEST_FLOAT if reading.ahead else STEP_TOLERANCE


@register_jitable
def line_between(series: np.ndarray, position: float, every: int) -> float:
    """Linear interpolation between samples `every` steps apart; `position` counts samples."""
    if position <= 0:
        return series[0]
    k = min(int(position), (len(series) - 1) // every - 1)
    return series[k * every] + (position - k) * (series[(k + 1) * every] - series[k * every])


@register_jitable
def signal_at(series: np.ndarray, k: int, share: float, s: int, reading: Reading) -> float:
    """Value of a signal read when a `share` of step k has passed; s is its place in `Reading.late`."""
    every = reading.every
    if reading.held:
        passed = k + 1 if reading.ahead and share == 1.0 else k
        sample = passed // every - int(reading.late[s])
        return series[min(max(sample, 0), (len(series) - 1) // every) * every]
    return line_between(series, (k + share) / every - reading.late[s], every)


@register_jitable
def stage_inputs(
    recording: Recording,
    reading: Reading,
    k: int,
    part: int,
    parts: int,
    y: np.ndarray,
    Y: np.ndarray,
    K: np.ndarray,
    inputs: np.ndarray,
) -> None:
    """Write (limited u, x, v) at the six stages of a part of step k, and at its end, into `inputs`.

    `inputs` is of shape (7, 3). The step is made in `parts` equal parts, one after another; the limiter acts
    on what was read. For the exact transport the full-order states are computed again: y, shape (6,), holds
    them from one part to the next, Y and K, shape (7, 6), are work space.
    """
    u_max = recording.plant.valve.u_max
    if reading.exact:
        if part == 0:
            copy_state(recording.states[k], y)
        reference = recording.reference[k]
        full_order_step(y, (reference, 0.0, recording.drive, recording.plant), recording.h / parts, Y, K)
        for i in range(STAGES + 1):
            inputs[i, 0] = limited(command(reference, Y[i, 0], recording.drive), u_max)
            inputs[i, 1] = Y[i, 0]
            inputs[i, 2] = Y[i, 1]
    else:
        for i in range(STAGES + 1):
            share = (part + (C[i] if i < STAGES else 1.0)) / parts
            inputs[i, 0] = limited(signal_at(recording.u, k, share, 0, reading), u_max)
            inputs[i, 1] = signal_at(recording.states[:, 0], k, share, 1, reading)
            inputs[i, 2] = signal_at(recording.states[:, 1], k, share, 2, reading)
