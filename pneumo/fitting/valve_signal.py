"""Opening of a valve that follows its command with dead time, lag, null offset, hysteresis and dead band."""

from itertools import accumulate

import numpy as np
from scipy.signal import lfilter

INSTANT = 1e-9  # s, in place of a lag of zero


def valve_signal(u: np.ndarray, h: float, *, dead_time: float, lag: float, null: float) -> np.ndarray:
    """Command behind dead time, lag and null offset, V, as its mean over each step of `h` s; shape of `u`.

    `u`, V, is the limited command's mean over each step. The valve sees it `dead_time` s later (negative:
    earlier), follows with the time constant `lag`, s, and is shut at the command `null`, V. Means over steps
    keep the integral of the command, and vary smoothly with all three numbers.
    """
    boundary = np.arange(len(u) + 1) * h
    integral = np.concatenate([[0.0], np.cumsum(u)]) * h
    before, after = boundary - dead_time, boundary[-1]
    late = np.interp(before, boundary, integral)
    # Beyond the record the command is taken to hold.
    late += np.minimum(before, 0.0) * u[0] + np.maximum(before - after, 0.0) * u[-1]
    late = np.diff(late) / h
    tau = max(lag, INSTANT)
    decay = np.exp(-h / tau)
    start, _ = lfilter([0.0, 1 - decay], [1.0, -decay], late, zi=[late[0]])
    return late + (start - late) * (tau / h) * (1 - decay) - null


def behind_valve(u: np.ndarray, h: float, valve: dict[str, float]) -> np.ndarray:
    """Command behind the valve, V, shape (steps, stages): `valve_signal`, then hysteresis and dead band.

    Hysteresis is a play. `hysteresis` and `dead_band`, V to either side, are zero where `valve` does not have
    them.
    """
    dynamics = {name: valve[name] for name in ("dead_time", "lag", "null")}
    opening = valve_signal(u.mean(axis=1), h, **dynamics)
    if play := valve.get("hysteresis", 0.0):
        opening = np.array(list(accumulate(opening.tolist(), lambda at, v: min(max(at, v - play), v + play))))
    if band := valve.get("dead_band", 0.0):
        opening = np.sign(opening) * np.maximum(np.abs(opening) - band, 0.0)
    return np.broadcast_to(opening[:, None], u.shape)
