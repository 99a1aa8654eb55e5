"""How large an error sampled signals leave in replays of a run of one's own."""

import numpy as np

from pneumo.engineer.floor_theory import SHIFTS, predicted_error
from pneumo.engineer.runs import Run
from pneumo.errors import InputError

WHOLE = 1e-6  # how far the ratio of two times may be from a whole number, for rounding


def transport_floor(run: Run, period: float, transport: str = "linear") -> tuple[float, float]:
    """RMS pressure error that no model of the air can go below when it is replayed on sampled signals.

    Linear theory along the run: no replay is made. The command's jumps fall on steps of the run.

    Parameters
    ----------
    run : Run
        From `pneumo.simulate`.
    period : float
        Time between samples of u, x and v, s: a multiple or a whole fraction of the run's step.
    transport : {"linear", "hold", "delay"}
        Straight lines between samples, the last sample, or the one before it.

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
    if run.drive is None:
        raise InputError("run: must come from simulate; a recorded one lacks the temperatures")
    ratio = max(period / run.h, run.h / period)
    if abs(ratio - round(ratio)) > WHOLE * ratio:
        raise InputError(f"period = {period:g} s: must be a multiple or a whole fraction of h = {run.h:g} s")
    error = predicted_error(run.recording, period, transport)
    A, B = np.sqrt(np.mean(error**2, axis=1)).tolist()
    return A, B
