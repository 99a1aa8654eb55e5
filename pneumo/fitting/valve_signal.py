"""Opening of a valve: its command with dead time, lag, null offset, hysteresis, dead band and curve."""

from collections.abc import Mapping
from itertools import accumulate

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.signal import lfilter

from pneumo.configuration.experiment import Plant

INSTANT = 1e-9  # s, in place of a lag of zero
KNOTS = (0.0, 1 / 8, 1 / 4, 1 / 2, 1.0)  # of a fitted curve, over the largest command


def lagged(signal: np.ndarray, lag: float, h: float) -> np.ndarray:
    """Reading of a sensor with a lag of first order, s, by sample along the last axis, `h` s apart.

    It is exact for a signal that is linear between samples and steady before the first.
    """
    if lag == 0:
        return signal
    decay = np.exp(-h / lag)
    late = lag / h * (1 - decay)
    return lfilter([1 - late, late - decay], [1.0, -decay], signal, zi=signal[..., :1] * late)[0]


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


def largest_command(u: np.ndarray, plant: Plant) -> float:
    """Largest command of a record within the limiter, V, at which a fitted curve ends; 1 if there is none."""
    return min(float(np.abs(u).max()), plant.valve.u_max) or 1.0


def valve_curve(valve: Mapping[str, float], part: np.ndarray) -> np.ndarray:
    """Conductance over that at the largest command, at commands that are `part` of the largest.

    It is a monotone cubic spline, and beyond the largest command a line with the last slope between knots.
    """
    rising = np.cumprod([1.0, valve["curve_half"], valve["curve_quarter"], valve["curve_eighth"], 0.0])
    slope = (1 - valve["curve_half"]) / (1 - KNOTS[-2])
    inside = PchipInterpolator(KNOTS, rising[::-1])(np.minimum(part, 1.0))
    return inside + slope * np.maximum(part - 1, 0.0)


def behind_valve(u: np.ndarray, h: float, valve: dict[str, float], largest: float) -> np.ndarray:
    """Opening, V, shape (steps, stages): `valve_signal`, then hysteresis, dead band and curve.

    Hysteresis is a play. `hysteresis` and `dead_band`, V to either side, are zero where `valve` does not have
    them. A fitted curve leaves the `largest` command, V, as it is.
    """
    dynamics = {name: valve[name] for name in ("dead_time", "lag", "null")}
    opening = valve_signal(u.mean(axis=1), h, **dynamics)
    if play := valve.get("hysteresis", 0.0):
        opening = np.array(list(accumulate(opening.tolist(), lambda at, v: min(max(at, v - play), v + play))))
    if band := valve.get("dead_band", 0.0):
        opening = np.sign(opening) * np.maximum(np.abs(opening) - band, 0.0)
    if "curve_half" in valve:
        opening = np.sign(opening) * largest * valve_curve(valve, np.abs(opening) / largest)
    return np.broadcast_to(opening[:, None], u.shape)
