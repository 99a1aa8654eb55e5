"""Pressure error that sampled signals cause in a replay, by linear theory: the floor for every model.

To first order in the time between samples, sampling delays signals: jumps of the command by one share of
that time, everything continuous by another (`SHIFTS`). A delayed jump lets a wrong mass of air in, which
stays until the flow through the valve has balanced it. `floor` is the closed formula.
"""

from math import expm1, sqrt
from typing import NamedTuple

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.engineer.jump_errors import jump_errors, mean_of_ramp, pressure_rates
from pneumo.physics.cylinder import volume
from pneumo.physics.valve import chamber_flows
from pneumo.simulation.full_order import Recording, command_series
from pneumo.simulation.signals import Transport, held, interpolated

UNIFORM = 1 / 12  # variance of where a jump falls between two samples, if it may fall anywhere


class Shift(NamedTuple):
    """Delay of signals by sampling, to first order, in times between samples.

    Attributes
    ----------
    held : bool
        Samples are held, not interpolated linearly.
    late : int
        Samples by which the held one is older than the last.
    jump : float
        Delay of a jump that falls on a sample, the sample that has the new value already.
    rest : float
        Delay of everything continuous: position, velocity, a command that follows them.
    """

    held: bool
    late: int
    jump: float
    rest: float

    def transport(self, every: int) -> Transport:
        """Transport of a replay whose samples are `every` steps apart."""
        kind = held if self.held else interpolated
        return kind(self.late, every=every)


SHIFTS = {
    "linear": Shift(False, 0, -0.5, 0.0),  # the line begins to rise one sample before the jump
    "hold": Shift(True, 0, 0.0, 0.5),
    "delay": Shift(True, 1, 1.0, 1.5),  # the sample before the last, held
}


def late_rest(recording: Recording, stride: int = 1) -> np.ndarray:
    """Pressure error per second of delay of everything but jumps, Pa/s, shape (chamber, samples).

    The error of a delay of the whole run is the rate of its pressure; the share of the jumps is subtracted.
    """
    return pressure_rates(recording, stride) - jump_errors(recording, 1, False, 0.0, True, stride)


def predicted_error(
    recording: Recording, period: float, sampling: str, stride: int = 1, late: np.ndarray | None = None
) -> np.ndarray:
    """Full-order minus replayed pressure on sampled signals, Pa, shape (chamber, samples), without a replay.

    Linear theory along a full-order run, an error every `stride` steps.

    Parameters
    ----------
    recording : Recording
        Where its jumps fall between samples counts if `period` is longer than its step.
    period : float
        Time between samples, s: a multiple of the step, or less where all jumps fall on samples.
    sampling : str
        Key of `SHIFTS`.
    stride : int
    late : numpy.ndarray, optional
        `late_rest` of the run, where it is known already.
    """
    shift = SHIFTS[sampling]
    every = max(1, round(period / recording.h))
    error = jump_errors(recording, every, not shift.held, float(shift.late), False, stride)
    if shift.rest:
        error += shift.rest * (late_rest(recording, stride) if late is None else late)
    return period * error


class Averages(NamedTuple):
    """Averages of a run that the closed formula needs.

    Attributes
    ----------
    jump : float
        RMS jump of the limited command from draw to draw, V.
    opening : float
        Mean magnitude of the limited command, V.
    draw : float
        Time between draws, s.
    speed : float
        RMS velocity of the piston, m/s.
    P_rate : float
        RMS rate of pressure, Pa/s.
    V : float
        Volume of a chamber, m^3; of a run the root mean square of 1/V, inverted.
    area : float
        Piston area, m^2.
    early : float
        How early interpolation to the new value is, in times between samples: 1/2, more at a limiter.
    """

    jump: float
    opening: float
    draw: float
    speed: float
    P_rate: float
    V: float
    area: float
    early: float = 0.5


def averages(recording: Recording, every: int) -> Averages:
    """Averages of a run whose reference is drawn every so many steps, over both chambers."""
    drive, plant, h = recording.drive, recording.plant, recording.h
    states, reference, u_max = recording.states, recording.reference, plant.valve.u_max
    cylinder, x = plant.cylinder, states[:, 0]
    draws = np.arange(every, len(states), every)
    before = command_series(states[draws], reference[draws - 1], drive)
    after = recording.u[draws]
    jumps = after.clip(-u_max, u_max) - before.clip(-u_max, u_max)
    ramps = [
        np.subtract(*mean_of_ramp(u, w, u_max)) if w != u else w for u, w in zip(before, after, strict=True)
    ]
    late = after.clip(-u_max, u_max) - ramps
    inverse = [1 / volume(x, cylinder.A_A, cylinder), 1 / volume(-x, cylinder.A_B, cylinder)]
    return Averages(
        jump=sqrt(np.mean(jumps**2)),
        opening=float(np.mean(abs(recording.u.clip(-u_max, u_max)))),
        draw=every * h,
        speed=sqrt(np.mean(states[:, 1] ** 2)),
        P_rate=sqrt(np.mean(pressure_rates(recording, 1) ** 2)),
        V=1 / sqrt(np.mean(np.square(inverse))),
        area=(cylinder.A_A + cylinder.A_B) / 2,
        early=1 - float(np.sum(late * jumps) / np.sum(jumps**2)) if np.any(jumps) else 0.5,
    )


class Sensitivities(NamedTuple):
    """RMS pressure error per second of delay, Pa/s.

    Attributes
    ----------
    jump : float
        Of jumps of the command, all by the same time: each jump cancels most of the one before.
    rest : float
        Of everything else.
    both : float
        Of everything: the rate of pressure.
    apart : float
        Of jumps of the command, each by another time: only the flow reduces their error.
    """

    jump: float
    rest: float
    both: float
    apart: float


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
    alone = (
        1 / (2 * level) + 2 * (gamma - 1) / (2 * level + wall) + (gamma - 1) ** 2 / (2 * level + 2 * wall)
        if level
        else 0.0
    )
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

    Parameters
    ----------
    delays : Sensitivities
    period : float
        Time between samples, s.
    sampling : str
        Key of `SHIFTS`.
    early : float
        From `Averages`.
    between : bool
        Whether jumps fall anywhere between samples, not on them.
    """
    _, _, jump, rest = SHIFTS[sampling]
    if sampling == "linear":
        jump = -early
    if between:
        jump = rest
    shifted = (jump * delays.jump) ** 2 + (rest * delays.rest) ** 2
    together = jump * rest * (delays.both**2 - delays.jump**2 - delays.rest**2)
    scattered = UNIFORM * delays.apart**2 if between else 0.0
    return period * sqrt(max(shifted + together + scattered, 0.0))
