"""Pressure error that sampled signals cause in a replay, by linear theory: the floor for every model.

To first order, sampling delays signals by a fraction of the time between samples, which differs between jumps
of the command and everything continuous (`SHIFTS`). A delayed jump lets a wrong mass of air in, which stays
until the flow through the valve has balanced it. `floor` is the closed formula.
"""

from math import expm1, sqrt
from typing import NamedTuple

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.configuration.sampling import HELD, HELD_TO_NEXT, INTERPOLATED, Sampling
from pneumo.errors import InputError
from pneumo.evidence.signal_sampling.jump_errors import jump_errors, mean_of_ramp, pressure_rates
from pneumo.physics.cylinder import Side, chamber_of, volume
from pneumo.physics.valve import chamber_flows
from pneumo.selection.plants import check_positive
from pneumo.selection.runs import Run
from pneumo.simulation.full_order import Recording, command_series
from pneumo.simulation.runge_kutta import B

ROUNDING = 1e-6  # relative distance of a ratio of times from a whole number that is rounding
UNIFORM = 1 / 12  # variance of where a jump falls between two samples, if it may fall anywhere


class Shift(NamedTuple):
    """First-order delay that sampling causes in a signal, in sample periods."""

    sampling: Sampling
    jump: float  # delay of a jump that falls on a sample, which has the new value already
    rest: float  # delay of everything continuous: position, velocity, a command that follows them


NEXT = float(B[-1])  # weight of the stage at a step's end
SHIFTS = {
    "linear": Shift(INTERPOLATED, jump=-0.5, rest=0.0),  # the line rises from one sample before the jump on
    "hold": Shift(HELD, jump=0.0, rest=0.5),
    "delay": Shift(HELD._replace(delay=(1.0, 1.0, 1.0)), jump=1.0, rest=1.5),
    "hold_next": Shift(HELD_TO_NEXT, jump=-NEXT, rest=0.5 - NEXT),  # for samples at every step
}


def late_rest(recording: Recording, stride: int = 1) -> np.ndarray:
    """Pressure error per second of delay of all signals but the jumps: Pa/s, shape (chamber, samples).

    If the whole run is delayed, the error per second is the rate of pressure; the part of the jumps is
    subtracted.
    """
    return pressure_rates(recording, stride) - jump_errors(recording, 1, False, 0.0, True, stride)


def predicted_error(
    recording: Recording, period: float, sampling: str, stride: int = 1, late: np.ndarray | None = None
) -> np.ndarray:
    """Full-order minus replayed pressure on sampled signals, Pa, shape (chamber, samples), without a replay.

    Linear theory along a full-order run, an error every `stride` steps. `period` is the time between samples,
    s: if it is a multiple of the run's step, jumps may fall between samples; if it is less than the step, all
    fall on samples. `sampling` is a key of `SHIFTS`; `late` is `late_rest` of the run, if known already.
    """
    shift = SHIFTS[sampling]
    every = max(1, round(period / recording.h))
    error = jump_errors(recording, every, not shift.sampling.held, shift.jump, False, stride)
    if shift.rest:
        error += shift.rest * (late_rest(recording, stride) if late is None else late)
    return period * error


class Averages(NamedTuple):
    """Averages of a run, for the closed formula."""

    jump: float  # V, RMS jump of the limited command from draw to draw
    opening: float  # V, mean magnitude of the limited command
    draw: float  # s, time between draws
    speed: float  # m/s, RMS velocity of the piston
    P_rate: float  # Pa/s, RMS rate of pressure
    V: float  # m^3, volume of a chamber; of a run the root mean square of 1/V, inverted
    area: float  # m^2, of the piston
    early: float = 0.5  # how early interpolation is, in times between samples: 1/2, more at a limiter


def averages(recording: Recording, every: int) -> Averages:
    """Averages of a run, over both chambers; there are `every` steps between draws of its reference."""
    plant, states, u_max = recording.plant, recording.states, recording.plant.valve.u_max
    cylinder, x = plant.cylinder, states[:, 0]
    draws = np.arange(every, len(states), every)
    before = command_series(states[draws], recording.reference[draws - 1], recording.drive)
    after, opened = recording.u[draws], recording.u.clip(-u_max, u_max)
    jumps = opened[draws] - before.clip(-u_max, u_max)
    ramps = [
        np.subtract(*mean_of_ramp(u, w, u_max)) if w != u else w for u, w in zip(before, after, strict=True)
    ]
    late = opened[draws] - ramps
    inverse = [1 / volume(side.sign * x, chamber_of(cylinder, side), cylinder) for side in Side]
    return Averages(
        jump=sqrt(np.mean(jumps**2)),
        opening=float(np.mean(abs(opened))),
        draw=every * recording.h,
        speed=sqrt(np.mean(states[:, 1] ** 2)),
        P_rate=sqrt(np.mean(pressure_rates(recording, 1) ** 2)),
        V=1 / sqrt(np.mean(np.square(inverse))),
        area=(cylinder.A_A + cylinder.A_B) / 2,
        early=1 - float(np.sum(late * jumps) / np.sum(jumps**2)) if np.any(jumps) else 0.5,
    )


class Sensitivities(NamedTuple):
    """RMS pressure errors per second of delay of the signals, Pa/s."""

    jump: float  # of jumps of the command, all by the same time: each cancels most of the one before
    rest: float  # of everything else
    both: float  # of everything: the rate of pressure
    apart: float  # of jumps of the command, each by a different time: only the flow reduces their error


def _kept(r: float) -> float:
    """Mean of exp(-t) for t from 0 to r."""
    return -expm1(-r) / r if r else 1.0


def sensitivities(plant: Plant, known: Averages) -> Sensitivities:
    """RMS pressure error per second of delay, by a closed formula from averages of a run.

    A jump that is late by a time s leaves an error of gamma R T / V times s times the jump of the flow. Wall
    heat reduces gamma to 1, and the dependence of the flow on pressure reduces the error to 0, each at its
    rate.
    """
    gas, c = plant.gas, plant.conditions
    R, gamma = gas.R, gas.gamma

    def net(u: float, P: float) -> float:
        m_in, m_out = chamber_flows(u, P, c.T_0, plant.valve, gas, c)
        return m_in - m_out

    # Flow per volt at P_0, and how it falls with pressure: mean of the valve's two sides.
    flow = (net(1.0, c.P_0) - net(-1.0, c.P_0)) / 2
    P_1, P_2 = 1.001 * c.P_0, 0.999 * c.P_0
    slope = sum(net(u, P_2) - net(u, P_1) for u in (1.0, -1.0)) / 2 / (P_1 - P_2)
    wall = (gamma - 1) * plant.k_0 * c.T_0 / (c.P_0 * known.V)  # k_0 over the air's heat capacity, 1/s
    level = R * c.T_0 / known.V * slope * known.opening  # 1/s
    adiabatic = gamma * R * c.T_0 / known.V * flow * known.jump  # Pa/s
    index = 1 + (gamma**2 - 1) * _kept(wall * known.draw)  # mean square of gamma, reduced by wall heat
    jump = adiabatic / gamma * sqrt(index * _kept(level * known.draw) / 2)
    alone = 0.0
    if level:
        alone = 1 / (2 * level) + 2 * (gamma - 1) / (2 * level + wall)
        alone += (gamma - 1) ** 2 / (2 * level + 2 * wall)
    return Sensitivities(
        jump=jump,
        rest=gamma * c.P_0 * known.area * known.speed / known.V,
        both=known.P_rate,
        apart=adiabatic / gamma * sqrt(alone / known.draw),
    )


def floor(
    delays: Sensitivities, period: float, sampling: str, *, early: float = 0.5, between: bool = False
) -> float:
    """RMS pressure error of a replay on sampled signals, Pa: closed formula.

    Samples are `period` seconds apart; `sampling` is a key of `SHIFTS`, `early` is from `Averages`, and
    `between` is whether jumps fall anywhere between samples, not on them.
    """
    _, jump, rest = SHIFTS[sampling]
    if sampling == "linear":
        jump = -early
    if between:
        jump = rest
    shifted = (jump * delays.jump) ** 2 + (rest * delays.rest) ** 2
    together = jump * rest * (delays.both**2 - delays.jump**2 - delays.rest**2)
    scattered = UNIFORM * delays.apart**2 if between else 0.0
    return period * sqrt(max(shifted + together + scattered, 0.0))


def sampling_floor(run: Run, period: float, sampling: str = "linear") -> tuple[float, float]:
    """RMS pressure error that the sampling of u, x and v alone causes in a replay, whatever the model.

    Linear theory along the run, without a replay. Jumps of the command fall on steps of the run.

    Parameters
    ----------
    run : Run
        From `pneumo.simulate`.
    period : float
        Time between samples of u, x and v, s: a multiple or a whole fraction of the run's step.
    sampling : {"linear", "hold", "delay", "hold_next"}
        Linear interpolation, the last sample held (zero-order hold), the sample before it held, or the last
        one held but for the stage at the step's end, which reads the next (samples at every step).

    Returns
    -------
    tuple of float
        Chamber A and B, Pa.

    Raises
    ------
    InputError
        If `sampling` is none of these, the period is no multiple or fraction (for "hold_next": not the step),
        or the run was not simulated.
    """
    if sampling not in SHIFTS:
        raise InputError(f"sampling = {sampling!r}: must be one of {', '.join(SHIFTS)}")
    check_positive(period=period)
    if not run.simulated:
        raise InputError("run: must come from simulate; a recorded one lacks the temperatures")
    h = run.recording.h
    ratio = max(period / h, h / period)
    if abs(ratio - round(ratio)) > ROUNDING * ratio:
        raise InputError(f"period = {period:g} s: must be a multiple or a whole fraction of h = {h:g} s")
    if SHIFTS[sampling].sampling.next_at_end and round(ratio) != 1:
        raise InputError(f"period = {period:g} s: must be h = {h:g} s for sampling = {sampling!r}")
    error = predicted_error(run.recording, period, sampling)
    A, B = np.sqrt(np.mean(error**2, axis=1)).tolist()
    return A, B
