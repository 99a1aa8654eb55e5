# pyright: basic
"""How recorded signals reach a replay: what each Runge-Kutta stage reads of u, x and v."""

from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable

from pneumo.configuration.experiment import Experiment
from pneumo.physics.valve import limited
from pneumo.simulation.compiled import inlined
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


@inlined
def replay_tolerance(reading: Reading) -> float:
    """Error estimate over P_0 above which a replay's step is halved where it may be.

    Where a stage at the step's end reads the next sample, a shorter step would read it for a shorter time: it
    would change the signals, not only follow them more closely. Such a step is halved only where it fails.
    """
    return LARGEST_FLOAT if reading.ahead else STEP_TOLERANCE


@inlined
def line_between(series: np.ndarray, position: float, every: int, last: int) -> float:
    """Linear interpolation between samples `every` steps apart; `position` and `last` count samples."""
    if position <= 0:
        return series[0]
    k = min(int(position), last - 1)
    return series[k * every] + (position - k) * (series[(k + 1) * every] - series[k * every])


@register_jitable(inline="always")  # by Numba, as `vectorised.advance`
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
        u, x, v, late = recording.u, recording.states[:, 0], recording.states[:, 1], reading.late
        every, last = reading.every, (len(u) - 1) // reading.every
        for i in range(STAGES + 1):
            share = (part + (C[i] if i < STAGES else 1.0)) / parts
            if reading.held:
                sample = (k + 1 if reading.ahead and share == 1.0 else k) // every
                u_i = u[min(max(sample - int(late[0]), 0), last) * every]
                inputs[i, 1] = x[min(max(sample - int(late[1]), 0), last) * every]
                inputs[i, 2] = v[min(max(sample - int(late[2]), 0), last) * every]
            else:
                position = (k + share) / every
                u_i = line_between(u, position - late[0], every, last)
                inputs[i, 1] = line_between(x, position - late[1], every, last)
                inputs[i, 2] = line_between(v, position - late[2], every, last)
            inputs[i, 0] = limited(u_i, u_max)
