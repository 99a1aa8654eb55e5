# pyright: basic
"""How recorded signals reach a replay: what each Runge-Kutta stage reads of u, x and v."""

import numpy as np

from pneumo.configuration.experiment import Experiment
from pneumo.configuration.sampling import EXACT_SAMPLING, Sampling
from pneumo.physics.valve import limited
from pneumo.simulation.compiled import inlined, inlined_first
from pneumo.simulation.excitation import command
from pneumo.simulation.full_order import Recording, copy_state, full_order_step
from pneumo.simulation.runge_kutta import STAGES, STEP_TOLERANCE, C

LARGEST_FLOAT = np.finfo(np.float64).max
STUDY_SAMPLINGS = PUBLISHED, EXACT = "published", "exact"  # names of folders of results


def study_sampling(name: str, experiment: Experiment) -> Sampling:
    """`Sampling` of an experiment's signals in the replays of results/`name`, "published" or "exact".

    Raises
    ------
    KeyError
        If `name` is not in `STUDY_SAMPLINGS`.
    """
    return {EXACT: EXACT_SAMPLING, PUBLISHED: experiment.sampling}[name]


@inlined
def replay_tolerance(sampling: Sampling) -> float:
    """Estimated error over P_0 above which a step of a replay is halved, if halving is allowed.

    Where a stage at the step's end reads the next sample, half a step would read it for half the time:
    halving would change the signals, not only the error. Such a step is halved only where it fails.
    """
    return LARGEST_FLOAT if sampling.next_at_end else STEP_TOLERANCE


@inlined
def line_between(series: np.ndarray, position: float, every: int, last: int) -> float:
    """Interpolate linearly at `position` between samples that are `every` steps apart in `series`.

    `position` and `last`, the index of the last sample, count samples, not steps.
    """
    if position <= 0:
        return series[0]
    k = min(int(position), last - 1)
    return series[k * every] + (position - k) * (series[(k + 1) * every] - series[k * every])


@inlined_first
def stage_inputs(
    recording: Recording,
    sampling: Sampling,
    k: int,
    part: int,
    parts: int,
    y: np.ndarray,
    Y: np.ndarray,
    K: np.ndarray,
    inputs: np.ndarray,
) -> None:
    """Write limited u, x and v at the six stages of a part of step k, and at its end, into `inputs`.

    `inputs` has shape (7, 3). A step is divided into `parts` equal parts, which must be asked for in their
    order; the command is limited after it was read. With exact sampling the full-order states are integrated
    again: y, shape (6,), keeps them from one part to the next; Y and K, shape (7, 6), are work space.
    """
    u_max = recording.plant.valve.u_max
    if sampling.exact:
        if part == 0:
            copy_state(recording.states[k], y)
        reference = recording.reference[k]
        full_order_step(y, (reference, 0.0, recording.drive, recording.plant), recording.h / parts, Y, K)
        for i in range(STAGES + 1):
            inputs[i, 0] = limited(command(reference, Y[i, 0], recording.drive), u_max)
            inputs[i, 1] = Y[i, 0]
            inputs[i, 2] = Y[i, 1]
    else:
        u, x, v, delay = recording.u, recording.states[:, 0], recording.states[:, 1], sampling.delay
        every, last = sampling.every, (len(u) - 1) // sampling.every
        for i in range(STAGES + 1):
            fraction = (part + (C[i] if i < STAGES else 1.0)) / parts
            if sampling.held:
                sample = (k + 1 if sampling.next_at_end and fraction == 1.0 else k) // every
                u_i = u[min(max(sample - int(delay[0]), 0), last) * every]
                inputs[i, 1] = x[min(max(sample - int(delay[1]), 0), last) * every]
                inputs[i, 2] = v[min(max(sample - int(delay[2]), 0), last) * every]
            else:
                position = (k + fraction) / every
                u_i = line_between(u, position - delay[0], every, last)
                inputs[i, 1] = line_between(x, position - delay[1], every, last)
                inputs[i, 2] = line_between(v, position - delay[2], every, last)
            inputs[i, 0] = limited(u_i, u_max)
