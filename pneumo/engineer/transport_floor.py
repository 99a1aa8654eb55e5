"""Pressure error that sampled signals cause in replays of a run: the floor below which no model can go."""

import numpy as np

from pneumo.engineer.floor_theory import SHIFTS, predicted_error
from pneumo.engineer.runs import Run
from pneumo.errors import InputError

ROUNDING = 1e-6  # relative distance of a ratio of times from a whole number that is rounding


def transport_floor(run: Run, period: float, transport: str = "linear") -> tuple[float, float]:
    """RMS pressure error that the sampling of u, x and v alone causes in a replay, whatever the model.

    Linear theory along the run, `pneumo.engineer.floor_theory`, without a replay. Jumps of the command fall
    on steps of the run.

    Parameters
    ----------
    run : Run
        From `pneumo.simulate`.
    period : float
        Time between samples of u, x and v, s: a multiple or a whole fraction of the run's step.
    transport : {"linear", "hold", "delay"}
        Linear interpolation, the last sample held (zero-order hold), or the sample before it held.

    Returns
    -------
    tuple of float
        Chamber A and B, Pa.

    Raises
    ------
    InputError
        If there is no such transport, the period is no multiple or fraction, or the run was not simulated.
    """
    if transport not in SHIFTS:
        raise InputError(f"transport = {transport!r}: must be one of {', '.join(SHIFTS)}")
    if not (np.isfinite(period) and period > 0):
        raise InputError(f"period = {period:g}: must be a positive number")
    if not run.simulated:
        raise InputError("run: must come from simulate; a recorded one lacks the temperatures")
    h = run.recording.h
    ratio = max(period / h, h / period)
    if abs(ratio - round(ratio)) > ROUNDING * ratio:
        raise InputError(f"period = {period:g} s: must be a multiple or a whole fraction of h = {h:g} s")
    error = predicted_error(run.recording, period, transport)
    A, B = np.sqrt(np.mean(error**2, axis=1)).tolist()
    return A, B
