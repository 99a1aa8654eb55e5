"""Replays of reduced models, and of full orders with other parameters, on recorded runs: Fig. 6."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import pneumo.core as core
from pneumo.configuration.experiment import Plant
from pneumo.configuration.sampling import Sampling
from pneumo.physics.models import Lane
from pneumo.simulation.full_order import RAN, Recording, core_recording, core_sampling, failure
from pneumo.simulation.polynomials import EXP_REACH, FLOW_TOLERANCE, flow_polynomial

OK, LEFT_RANGE, NO_RUN = 0, 1, 2
STATUS = {OK: "ok", LEFT_RANGE: "pressure left the positive numbers", NO_RUN: "no full-order run"}
ROW: int = core.lib.ROW  # lanes that are replayed side by side
WIDTH: int = core.lib.WIDTH  # their number is padded to a multiple of this
BLOCK = 4096  # steps whose pressures are handed on at once


class Replayed(NamedTuple):
    """Replays of several lanes (a lane is one model at one n) on one run, shape (lane, chamber, ...)."""

    mean_error: np.ndarray  # of full-order minus reduced pressure over every step, Pa
    variance: np.ndarray  # population variance of the same error, Pa^2
    mse: np.ndarray  # its mean square, Pa^2
    status: np.ndarray  # key of `STATUS`; anything but 0 makes the statistics NaN
    failure_step: np.ndarray  # step at which a lane failed, or -1
    pressure: np.ndarray  # reduced pressure, Pa, shape (lane, chamber, stored steps)


def replay(recording: Recording, lanes: np.ndarray, sampling: Sampling, stride: int = 1) -> Replayed:
    """Replay models in both chambers on the signals of a run, and compare their pressures with it.

    `lanes`, shape (lane, 10), has a row of coefficients for each model and n, from
    `pneumo.physics.models.lane_array`; `sampling` says how the signals are read; `stride` is the number of
    steps between stored pressures.

    Most lanes are replayed side by side. Those that cannot be (the full order, an unusual wall law or valve,
    a pressure too far from P_0) follow one after another. Where the run itself failed, every lane has the
    status "no full-order run" (`NO_RUN`).
    """
    different, index = np.unique(lanes, axis=0, return_inverse=True)  # M1, say, is M2 at n = 1
    pressure = np.full((len(different), 2, (len(recording.states) - 1) // stride + 1), np.nan)

    def store(of_lanes: np.ndarray, first: int, P: np.ndarray) -> None:
        pressure[of_lanes, :, first : first + len(P)] = P.T

    result = replay_in_parts(recording, different, sampling, store, stride)
    if np.all(result.status != NO_RUN):
        pressure[..., 0] = first_states(recording, different, sampling)[..., 0]
    index = index.ravel()  # NumPy 2.0 gives it another axis
    return Replayed(*(values[index] for values in result._replace(pressure=pressure)))


def replay_in_parts(
    recording: Recording,
    lanes: np.ndarray,
    sampling: Sampling,
    take: Callable[[np.ndarray, int, np.ndarray], None],
    stride: int = 1,
) -> Replayed:
    """Replay as `replay` does, but pass the stored pressures to `take` in parts, to save memory.

    `take` is handed indices of lanes, the index of a stored sample, and the lanes' pressures, Pa, from that
    sample on, shape (sample, chamber, lane). A call that begins with sample 1 replaces what these lanes had
    before. `pressure` of the result is empty.
    """
    shape = (len(lanes), 2)
    run_status, failed_at = failure(recording.states)
    mean_error, variance, mse = np.full((3, *shape), np.nan)
    status = np.full(shape, OK if run_status == RAN else NO_RUN, dtype=np.int8)
    step, pressure = np.full(shape, failed_at), np.empty((*shape, 0))
    result = Replayed(mean_error, variance, mse, status, step, pressure)
    if run_status != RAN:
        return result

    def keep(of_lanes: np.ndarray, replayed: Replayed) -> None:
        if len(of_lanes):
            take(of_lanes, 1, replayed.pressure[..., 1:].T)
        for values, own in zip(result[:-1], replayed[:-1], strict=True):
            values[of_lanes] = own

    able = followed(lanes, recording.plant)
    fast = np.flatnonzero(able)[np.argsort(needs(lanes[able]), kind="stable")]
    in_turn = np.flatnonzero(~able)
    for first in range(0, max(len(fast), 1), ROW):
        block = fast[first : first + ROW]

        def take_stored(sample: int, P: np.ndarray, block: np.ndarray = block) -> None:
            take(block, -(-sample // stride), P[-sample % stride :: stride])

        two = lanes[block], lanes[in_turn]
        moments, replayed = replay_together(recording, *two, sampling, stride, take_stored)
        result.mean_error[block], result.mse[block] = moments
        keep(in_turn, replayed)
        in_turn = in_turn[:0]
    with np.errstate(over="ignore"):  # of a lane that failed
        result.variance[:] = result.mse - result.mean_error**2
    failed = fast[~np.isfinite(result.mse[fast]).all(axis=1)]
    if len(failed):
        keep(failed, replay_one_by_one(recording, lanes[failed], sampling, stride))
    return result


def first_states(recording: Recording, lanes: np.ndarray, sampling: Sampling) -> np.ndarray:
    """First pressure and temperature of every lane, shape (lane, chamber, 2).

    They are those of the run, but P_0 and T_0 where it has none, or for a reduced model on samples of it.
    """
    c = recording.plant.conditions
    at_rest = np.array([c.P_0, c.T_0])
    own = np.broadcast_to(recording.states[0, 2:].reshape(2, 2), (len(lanes), 2, 2))
    full = np.asarray(lanes)[:, Lane._fields.index("full")] != 0
    known = (full | (sampling.rule == "exact"))[:, np.newaxis, np.newaxis] & ~np.isnan(own)
    return np.where(known, own, at_rest)


def replay_one_by_one(
    recording: Recording, lanes: np.ndarray, sampling: Sampling, stride: int = 1
) -> Replayed:
    """Replay lanes one after another, by the equations themselves; parameters are those of `replay`."""
    return replay_together(recording, lanes[:0], lanes, sampling, stride)[1]


def needs(lanes: np.ndarray) -> np.ndarray:
    """Terms of the pressure rate that each lane needs, as a number from 0 to 3.

    0: no temperature and no wall heat; 1: temperature by eq (6); 2: that temperature and wall heat; 3: as 2,
    with a wall conductance that depends on the square root of P T.
    """
    lane = Lane(*np.asarray(lanes, dtype=float).T)
    wall = np.where(lane.e_PT != 0, 3, 2)
    return np.where(lane.wall_scale != 0, wall, np.where(lane.a != 0, 1, 0))


def followed(lanes: np.ndarray, plant: Plant) -> np.ndarray:
    """Whether each lane can be replayed side by side with others, shape (lane,).

    It can where it is a reduced model whose wall heat follows one of `pneumo.physics.models.WALL_LAWS`, the
    exponent a of eq (6) is 0 or above 0.002 in magnitude, and the valve has no leak, no laminar flow, never
    two open paths and one critical ratio.
    """
    _, error = flow_polynomial(plant.gas)
    valve = plant.valve
    if error > FLOW_TOLERANCE or valve.laminar or valve.leak or not valve.paths.one_at_a_time:
        return np.zeros(len(lanes), dtype=bool)
    _, _, _, a, _, _, wall_scale, e_A, e_PT, full = np.asarray(lanes, dtype=float).T
    law = (e_PT == 0) & ((e_A == 0) | (e_A == 1)) | (e_PT == 0.5) & (e_A == 1)
    # |ln p| > 700, which is P <= 0, has to be outside the reach of the exponential.
    return (full == 0) & ((wall_scale == 0) | law) & ((a == 0) | (np.abs(a) / 2 * 700 > EXP_REACH))


class LanesSideBySide(NamedTuple):
    """Coefficients, pressures and sums of up to `ROW` lanes, in the core's layout."""

    struct: Any  # the C struct `Lanes`
    psi: Any  # polynomial of the subsonic flow, and its number of terms
    terms: int

    @classmethod
    def of(cls, lanes: np.ndarray, plant: Plant) -> "LanesSideBySide":
        """Lanes, sorted by `needs`, with the first pressures P_0."""
        core.whole("lanes", len(lanes), 0, ROW)
        psi, _ = flow_polynomial(plant.gas)
        struct, rows = core.zeroed("Lanes"), core.rows("lanes", lanes, "Lane")
        core.lib.start_lanes(struct, rows, len(lanes), core.struct("Plant", plant))
        return cls(struct, core.array("psi", psi, (None,)), len(psi))

    def row(self, values: Any) -> np.ndarray:
        """Array over the memory of one row of the struct: a number of every lane."""
        return np.frombuffer(core.ffi.buffer(values), dtype=float)


def replay_together(
    recording: Recording,
    lanes: np.ndarray,
    in_turn: np.ndarray,
    sampling: Sampling,
    stride: int,
    take: Callable[[int, np.ndarray], None] | None = None,
) -> tuple[np.ndarray, Replayed]:
    """Replay up to `ROW` lanes, sorted by `needs`, side by side, and others in turn, on one run.

    `take` is handed the index of a sample, from 1 on, and the pressures of lanes side by side from there on,
    Pa, shape (sample, chamber, lane), which are valid until it returns. The result has the mean, Pa, and mean
    square, Pa^2, of the full-order minus these pressures, shape (2, lane, chamber), NaN where one left the
    range of the core's polynomials, and the replays of lanes in turn.
    """
    samples = len(recording.states)
    W = LanesSideBySide.of(lanes, recording.plant)
    run, rule = core_recording(recording), core_sampling(sampling)
    for now, P in zip(W.struct.now, first_states(recording, lanes[:1], sampling)[..., 0].T, strict=True):
        W.row(now)[:] = P / recording.plant.conditions.P_0 if len(P) else 0.0
    count = len(in_turn)
    y = first_states(recording, in_turn, sampling).copy()
    sums = np.empty((count, 2, 2))
    failed_at = np.empty((count, 2), np.int64)
    own = np.empty((count, 2, (samples - 1) // core.whole("stride", stride, 1) + 1))
    step = np.empty((count, 2, 3))
    arrays = [core.rows("lanes", in_turn, "Lane"), *map(core.out, (y, sums, failed_at, own, step))]
    others = core.struct("LanesInTurn", (arrays[0], count, stride, *arrays[1:]))
    pressure = np.empty((min(BLOCK, samples - 1), 2, W.struct.count))
    for first in range(0, max(samples - 1, 1), BLOCK):
        end = min(first + BLOCK, samples - 1)
        core.lib.replay_lanes(run, rule, first, end, W.struct, W.psi, W.terms, core.out(pressure), others)
        if take and len(lanes):
            take(first + 1, pressure[: end - first, :, : len(lanes)])
    both = [W.row(of).reshape(2, 2, ROW)[:, 0, : len(lanes)].T for of in (W.struct.sum, W.struct.squares)]
    mean_error, mse = sums[..., 0] / samples, sums[..., 1] / samples  # the error at t = 0, zero, counts
    status = np.where(failed_at >= 0, LEFT_RANGE, OK).astype(np.int8)
    replayed = Replayed(mean_error, mse - mean_error**2, mse, status, failed_at, own)
    return np.array(both) / samples, replayed
