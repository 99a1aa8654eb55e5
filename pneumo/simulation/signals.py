# pyright: basic
"""How recorded signals reach a replay: what each Runge-Kutta stage reads of u, x and v."""

from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable

from pneumo.physics.valve import limited
from pneumo.simulation.excitation import command
from pneumo.simulation.full_order import Recording, full_order_step
from pneumo.simulation.runge_kutta import STAGES, C

PUBLISHED, EXACT = "published", "exact"  # the study's two transports, and folders of results


class Reading(NamedTuple):
    """What the stages of a step read of a recorded run."""

    exact: bool  # signals as the full-order run had them at each stage; what follows plays no role then
    held: bool  # samples are held (zero-order hold), not interpolated linearly
    late: np.ndarray  # delay of u, x and v at each stage, in samples, shape (6, 3); whole numbers where held
    every: int  # steps between samples


class Transport(NamedTuple):
    """How recorded signals reach a replay, Fig. 6."""

    name: str  # ``published`` and ``exact`` are those of the study
    reading: Reading


def _transport(name: str, held: bool, late: float | np.ndarray, every: int) -> Transport:
    delays = np.array(np.broadcast_to(np.asarray(late, dtype=float), (STAGES, 3)))
    return Transport(name, Reading(False, held, delays, every))


def interpolated(late: float | np.ndarray = 0.0, *, every: int = 1, name: str = "linear") -> Transport:
    """Linear interpolation between samples, `late` samples behind (one number, or shape (6, 3))."""
    return _transport(name, False, late, every)


def held(late: float | np.ndarray = 0.0, *, every: int = 1, name: str = "hold") -> Transport:
    """Zero-order hold: every stage reads the sample of its step's start, or one `late` samples before it."""
    return _transport(name, True, late, every)


EXACT_TRANSPORT = Transport(EXACT, Reading(True, False, np.zeros((STAGES, 3)), 1))


def study_transport(name: str, lag: float, h: float) -> Transport:
    """Return one of the study's transports, for steps of h s; in the published one signals are `lag` s late.

    Raises
    ------
    KeyError
        If there is no transport of that name.
    """
    return {EXACT: EXACT_TRANSPORT, PUBLISHED: interpolated(lag / h, name=PUBLISHED)}[name]


@register_jitable
def line_between(series: np.ndarray, position: float, every: int) -> float:
    """Linear interpolation between samples `every` steps apart; `position` counts samples."""
    if position <= 0:
        return series[0]
    k = min(int(position), (len(series) - 1) // every - 1)
    return series[k * every] + (position - k) * (series[(k + 1) * every] - series[k * every])


@register_jitable
def signal_at(series: np.ndarray, k: int, i: int, s: int, reading: Reading) -> float:
    """Value of a signal that stage i of step k reads; s is its column of `Reading.late`."""
    every = reading.every
    if reading.held:
        sample = k // every - int(reading.late[i, s])
        return series[min(max(sample, 0), (len(series) - 1) // every) * every]
    return line_between(series, (k + C[i]) / every - reading.late[i, s], every)


@register_jitable
def stage_inputs(
    recording: Recording, reading: Reading, k: int, Y: np.ndarray, K: np.ndarray, inputs: np.ndarray
) -> None:
    """Write (limited u, x, v) at the six stages of step k into `inputs`, shape (6, 3).

    The limiter acts on what was read. For the exact transport the stages are computed again from the stored
    state; Y, shape (7, 6), and K, shape (6, 6), are work space.
    """
    u_max = recording.plant.valve.u_max
    if reading.exact:
        reference = recording.reference[k]
        context = (reference, 0.0, recording.drive, recording.plant)
        full_order_step(recording.states[k], context, recording.h, Y, K, Y[STAGES])
        for i in range(STAGES):
            inputs[i, 0] = limited(command(reference, Y[i, 0], recording.drive), u_max)
            inputs[i, 1] = Y[i, 0]
            inputs[i, 2] = Y[i, 1]
    else:
        for i in range(STAGES):
            inputs[i, 0] = limited(signal_at(recording.u, k, i, 0, reading), u_max)
            inputs[i, 1] = signal_at(recording.states[:, 0], k, i, 1, reading)
            inputs[i, 2] = signal_at(recording.states[:, 1], k, i, 2, reading)
