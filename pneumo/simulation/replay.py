"""Replays of reduced models on recorded runs, Fig. 6: the one entry, whichever kernel computes them."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pneumo.configuration.sampling import Sampling
from pneumo.simulation.full_order import RAN, Recording, failure
from pneumo.simulation.reference import replay_lanes
from pneumo.simulation.vectorised import ROW, followed, needs, replay_block

OK, LEFT_RANGE, NO_RUN = 0, 1, 2
STATUS = {OK: "ok", LEFT_RANGE: "pressure left the positive numbers", NO_RUN: "no full-order run"}


class Replayed(NamedTuple):
    """Replays of several lanes (a lane is one model at one n) on one run, shape (lane, chamber, ...)."""

    mean_error: np.ndarray  # of full-order minus reduced pressure over every step, Pa
    variance: np.ndarray  # population variance of the same error, Pa^2
    mse: np.ndarray  # its mean square, Pa^2
    status: np.ndarray  # key of `STATUS`; anything but 0 makes the statistics NaN
    failure_step: np.ndarray  # step at which a lane failed, or -1
    pressure: np.ndarray  # reduced pressure, Pa, shape (lane, chamber, stored steps)


# Is handed indices of lanes, the index of a stored sample, and the lanes' pressures, Pa, from that sample on,
# shape (sample, chamber, lane). A call that begins with sample 1 replaces what these lanes had before.
TakePressures = Callable[[np.ndarray, int, np.ndarray], None]


def replay(recording: Recording, lanes: np.ndarray, sampling: Sampling, stride: int = 1) -> Replayed:
    """Replay reduced models in both chambers on the signals of a run, and compare their pressures with it.

    `lanes`, shape (lane, 9), has a row of coefficients for each model and n, from
    `pneumo.physics.models.lane_array`; `sampling` says how the signals are read; `stride` is the number of
    steps between stored pressures.

    The vectorised kernel computes most lanes. The readable kernel computes those that the vectorised one
    cannot: an unusual wall law or valve, or a pressure too far from P_0. Where the run itself failed, every
    lane has the status "no full-order run" (`NO_RUN`).
    """
    different, index = np.unique(lanes, axis=0, return_inverse=True)  # M1, say, is M2 at n = 1
    pressure = np.full((len(different), 2, (len(recording.states) - 1) // stride + 1), np.nan)

    def store(of_lanes: np.ndarray, first: int, P: np.ndarray) -> None:
        pressure[of_lanes, :, 0] = recording.plant.conditions.P_0
        pressure[of_lanes, :, first : first + len(P)] = P.T

    result = replay_in_parts(recording, different, sampling, store, stride)
    index = index.ravel()  # NumPy 2.0 gives it another axis
    return Replayed(*(values[index] for values in result._replace(pressure=pressure)))


def replay_in_parts(
    recording: Recording, lanes: np.ndarray, sampling: Sampling, take: TakePressures, stride: int = 1
) -> Replayed:
    """Replay as `replay` does, but pass the stored pressures to `take` in parts, to save memory.

    `pressure` of the result is empty.
    """
    shape = (len(lanes), 2)
    run_status, step = failure(recording.states)
    if run_status != RAN:
        return _no_replay(shape, step)
    result = Replayed(
        mean_error=np.empty(shape),
        variance=np.empty(shape),
        mse=np.empty(shape),
        status=np.full(shape, OK, dtype=np.int8),
        failure_step=np.full(shape, -1),
        pressure=np.empty((*shape, 0)),
    )
    able = followed(lanes, recording.plant)
    fast = np.flatnonzero(able)[np.argsort(needs(lanes[able]), kind="stable")]
    for first in range(0, len(fast), ROW):
        block = fast[first : first + ROW]

        def take_stored(sample: int, P: np.ndarray, block: np.ndarray = block) -> None:
            take(block, -(-sample // stride), P[-sample % stride :: stride])

        result.mean_error[block], result.mse[block] = replay_block(
            recording, lanes[block], sampling, take_stored
        )
    with np.errstate(over="ignore"):  # of a lane that failed
        result.variance[:] = result.mse - result.mean_error**2
    rest = ~able
    rest[fast] = ~np.isfinite(result.mse[fast]).all(axis=1)
    if rest.any():
        by_reference = replay_by_reference(recording, lanes[rest], sampling, stride)
        take(np.flatnonzero(rest), 1, by_reference.pressure[..., 1:].T)
        for values, values_of_rest in zip(result[:-1], by_reference[:-1], strict=True):
            values[rest] = values_of_rest
    return result


def replay_by_reference(
    recording: Recording, lanes: np.ndarray, sampling: Sampling, stride: int = 1
) -> Replayed:
    """Replay all lanes with the readable, slow kernel; parameters are those of `replay`."""
    moments, failed_at, pressure = replay_lanes(recording, lanes, sampling, stride)
    samples = len(recording.states)  # the error at t = 0 is zero by construction and counts
    mean_error, mse = moments[..., 0] / samples, moments[..., 1] / samples
    status = np.where(failed_at >= 0, LEFT_RANGE, OK).astype(np.int8)
    return Replayed(mean_error, mse - mean_error**2, mse, status, failed_at, pressure)


def _no_replay(shape: tuple[int, int], step: int) -> Replayed:
    """Result of a replay on a run that failed at `step`: no statistics, status "no full-order run"."""
    nothing = np.full(shape, np.nan)
    status, failed = np.full(shape, NO_RUN, dtype=np.int8), np.full(shape, step)
    return Replayed(nothing, nothing, nothing, status, failed, np.empty((*shape, 0)))
