"""Opening of a valve: its command with dead time, lag, null offset, hysteresis, dead band and curve."""

from collections.abc import Mapping
from itertools import accumulate

import numpy as np

import pneumo.core as core
from pneumo.configuration.experiment import Plant
from pneumo.physics.valve import linearity_factor
from pneumo.physics.valve_dynamics import ValveDynamics

INSTANT = 1e-9  # s, in place of a lag of zero
KNOTS = (0.0, 1 / 8, 1 / 4, 1 / 2, 1.0)  # of a fitted curve, over the largest command
# Seven rows from a knot to the next, of the table of the curve: as many as a configuration may have.
ROWS = np.interp(np.linspace(0, len(KNOTS) - 1, 7 * (len(KNOTS) - 1) + 1), range(len(KNOTS)), KNOTS)


def lagged(signal: np.ndarray, lag: float, h: float) -> np.ndarray:
    """Reading of a sensor with a lag of first order, s, by sample along the last axis, `h` s apart.

    It is exact for a signal that is linear between samples and steady before the first.
    """
    if lag == 0:
        return signal
    decay = np.exp(-h / lag)
    late = lag / h * (1 - decay)
    return filtered(signal, 1 - late, late - decay, decay, signal[..., 0] * late)


def filtered(
    signal: np.ndarray, now: float, before: float, decay: float, start: np.ndarray | float
) -> np.ndarray:
    """Filter along the last axis: y = z + now x, then z = before x + decay y, from z = start."""
    result = np.array(signal, dtype=float, order="C")
    states = np.array(np.broadcast_to(start, result.shape[:-1]), dtype=float, ndmin=1)
    samples, rows = result.shape[-1], states.size
    core.lib.filter_first_order(core.out(result), rows, samples, core.out(states), now, before, decay)
    return result


def delayed(u: np.ndarray, h: float, dead_time: float, before: float) -> np.ndarray:
    """Mean over each step of `h` s of a command that arrives `dead_time` s later, V.

    `u`, V, is the command's mean over each step. It was `before`, V, until then, and its last value holds.
    """
    boundary = np.arange(len(u) + 1) * h
    integral = np.concatenate([[0.0], np.cumsum(u)]) * h
    sent, after = boundary - dead_time, boundary[-1]
    late = np.interp(sent, boundary, integral)
    late += np.minimum(sent, 0.0) * before + np.maximum(sent - after, 0.0) * u[-1]
    return np.diff(late) / h


def following(u: np.ndarray, h: float, lag: float, before: float) -> np.ndarray:
    """Mean over each step of `h` s of what follows `u`, held in each step, with a time constant; V.

    `before` is where it starts.
    """
    decay = np.exp(-h / lag)
    start = filtered(u, 0.0, 1 - decay, decay, before)
    return u + (start - u) * (lag / h) * (1 - decay)


def valve_signal(u: np.ndarray, h: float, *, dead_time: float, lag: float, null: float) -> np.ndarray:
    """Command behind dead time, lag and null offset, V, as its mean over each step of `h` s; shape of `u`.

    `u`, V, is the limited command's mean over each step. The valve sees it `dead_time` s later (negative:
    earlier), follows with the time constant `lag`, s, and is shut at the command `null`, V. Means over steps
    keep the integral of the command, and vary smoothly with all three numbers.
    """
    late = delayed(u, h, dead_time, u[0])
    return following(late, h, max(lag, INSTANT), late[0]) - null


def outside(opening: np.ndarray, dead_band: float) -> np.ndarray:
    """Opening less the dead band to either side, V; 0 within it."""
    return np.sign(opening) * np.maximum(np.abs(opening) - dead_band, 0.0)


def opened(u: np.ndarray, h: float, dynamics: ValveDynamics) -> np.ndarray:
    """Opening of a valve with dynamics, V, as its mean over each step of `h` s, in the order of the exports.

    `u` is the limited command, V, held in each step. As in the exports, opening and command are 0 V before.
    """
    spool = delayed(u, h, dynamics.dead_time, 0.0) if dynamics.dead_time else u
    spool = following(spool, h, dynamics.lag, 0.0) if dynamics.lag else spool
    return outside(spool - dynamics.null, dynamics.dead_band)


def largest_command(u: np.ndarray, plant: Plant) -> float:
    """Largest command of a record within the limiter, V, at which a fitted curve ends; 1 if there is none."""
    return min(float(np.abs(u).max()), plant.valve.u_max) or 1.0


def valve_curve(valve: Mapping[str, float], part: np.ndarray) -> np.ndarray:
    """Conductance over that at the largest command, at commands that are `part` of the largest.

    It has straight lines between rows of a monotone cubic spline, as the table in `fitted.yaml` has, and the
    last slope between knots beyond the largest command.
    """
    from scipy.interpolate import PchipInterpolator  # takes longer than a run

    rising = np.cumprod([1.0, valve["curve_half"], valve["curve_quarter"], valve["curve_eighth"], 0.0])
    slope = (1 - valve["curve_half"]) / (1 - KNOTS[-2])
    inside = np.interp(part, ROWS, PchipInterpolator(KNOTS, rising[::-1])(ROWS))
    return inside + slope * np.maximum(part - 1, 0.0)


def bent(part: np.ndarray, linearity: float) -> np.ndarray:
    """Conductance over that at the largest command, as `valve_curve`, of a valve that is not quite linear.

    It is proportional to the command beyond the largest.
    """
    return np.interp(part, ROWS, ROWS * linearity_factor(ROWS, linearity)) + np.maximum(part - 1, 0.0)


def behind_valve(u: np.ndarray, h: float, valve: dict[str, float], largest: float) -> np.ndarray:
    """Opening, V, shape (steps, stages): `valve_signal`, then hysteresis, dead band and curve.

    Hysteresis is a play. `hysteresis` and `dead_band`, V to either side, are zero where `valve` does not have
    them. Curve and linearity leave the `largest` command, V, as it is.
    """
    dynamics = {name: valve[name] for name in ("dead_time", "lag", "null")}
    opening = valve_signal(u.mean(axis=1), h, **dynamics)
    if play := valve.get("hysteresis", 0.0):
        opening = np.array(list(accumulate(opening.tolist(), lambda at, v: min(max(at, v - play), v + play))))
    if band := valve.get("dead_band", 0.0):
        opening = outside(opening, band)
    if "linearity" in valve:
        opening = np.sign(opening) * largest * bent(np.abs(opening) / largest, valve["linearity"])
    if "curve_half" in valve:
        opening = np.sign(opening) * largest * valve_curve(valve, np.abs(opening) / largest)
    return np.broadcast_to(opening[:, None], u.shape)
