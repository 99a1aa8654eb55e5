"""Measured signals at every Runge-Kutta stage of a replay: smoothed position, velocity, command or flows.

Position and velocity come from one smoothing spline, so that noise in the velocity is the derivative of noise
in the position. Generalised cross-validation chooses the smoothing (Craven and Wahba 1979), computed in
the cosine spectrum (Garcia 2010), where it is cheap.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from scipy.fft import dct
from scipy.interpolate import make_smoothing_spline

from pneumo.configuration.experiment import Plant
from pneumo.configuration.sampling import HELD, Sampling
from pneumo.fitting.record.measurement import Measurement
from pneumo.physics.cylinder import chamber_of, volume
from pneumo.physics.valve import choked_flow
from pneumo.simulation.fitted_pressures import NODES

LONGEST_STEP, SHORTEST_STEP = 1e-3, 2e-5  # s; the first is the step of the paper's study
LARGEST_CHANGE = 0.25  # of a pressure within a step, over the supply's
SMOOTHING = np.logspace(-6, 14, 201)  # weights of the squared second difference, from none to a straight line
# Samples of a spline, which takes a kilobyte for each; of a longer record it is made of pieces that overlap.
LONGEST_SPLINE, OVERLAP = 100_000, 2_000
TINY = 1e-300  # no flow at all


class StageSignals(NamedTuple):
    """Signals of a measurement, uniform in time, as a replay reads them."""

    period: float  # s, time between samples
    h: float  # s, step of the replay, a whole fraction of the period
    u: np.ndarray  # limited command, V, by (step, stage)
    motion: np.ndarray  # position, m, and velocity, m/s, by (step, stage, 2)
    P: np.ndarray  # Pa, measured pressures by (chamber, sample)
    used: np.ndarray  # whether each of them is compared with a replay
    P_s: np.ndarray | None = None  # Pa, supply pressure where measured, by (step, stage)
    flow: np.ndarray | None = None  # kg/s, where measured, by (step, stage, chamber); u then plays no role
    begins: tuple[int, ...] = (0,)  # first samples of several records, one after another
    largest: float = 1.0  # V, command at which a curve of the valve ends
    zeros: Mapping[str, float] = MappingProxyType({})  # Pa, at which a gauge was taken to read 0, by pressure

    @property
    def stride(self) -> int:
        """Number of steps of the replay between two samples."""
        return round(self.period / self.h)

    def part(self, first: int, last: int) -> "StageSignals":
        """Signals from one sample to another, both included."""
        steps = slice(first * self.stride, last * self.stride)
        flow, P_s = (signal if signal is None else signal[steps] for signal in (self.flow, self.P_s))
        P, used = (signal[:, first : last + 1] for signal in (self.P, self.used))
        begins = (0, *(begin - first for begin in self.begins if first < begin < last))
        motion = self.motion[steps]
        return self._replace(
            u=self.u[steps], motion=motion, P=P, used=used, P_s=P_s, flow=flow, begins=begins
        )

    def residual(self, replayed: np.ndarray) -> np.ndarray:
        """Measured minus replayed pressures, Pa, by (chamber, sample); 0 where they are not compared."""
        return np.where(self.used, self.P - replayed, 0.0)

    def rms(self, replayed: np.ndarray) -> np.ndarray:
        """Root mean square of the residual, Pa, shape (chamber,)."""
        compared = np.maximum(self.used.sum(axis=1), 1)
        return np.sqrt(np.sum(self.residual(replayed) ** 2, axis=1) / compared)

    @property
    def pieces(self) -> list[tuple[int, int]]:
        """First and last sample of each record."""
        return record_ends(self.begins, self.P.shape[1])


def record_ends(begins: Sequence[int], samples: int) -> list[tuple[int, int]]:
    """First and last sample of each of several records, one after another."""
    return [(first, after - 1) for first, after in pairwise((*begins, samples))]


def smoothing(x: np.ndarray, period: float) -> float:
    """Smoothing penalty of a signal with samples every `period` seconds, s^3, by cross-validation.

    It is the weight of the integrated squared second derivative against the sum of squared residuals. Where
    jumps and impacts hide the noise, nothing is smoothed.
    """
    spectrum = np.asarray(dct(x - np.linspace(x[0], x[-1], len(x)), norm="ortho"))
    rough = (2 - 2 * np.cos(np.pi * np.arange(len(x)) / len(x))) ** 2

    def score(weight: float) -> float:
        removed = 1 - 1 / (1 + weight * rough)
        return float(np.sum((removed * spectrum) ** 2) / removed.sum() ** 2)

    return float(min(SMOOTHING, key=score)) * period**3


def smoothed(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Signal without its noise, at uniform times t, s; one that is constant is returned."""
    if np.ptp(x) == 0:
        return x
    return make_smoothing_spline(t, x, lam=smoothing(x, float(t[-1] - t[0]) / (len(t) - 1)))(t)


def longest_step(plant: Plant, u: np.ndarray, x: np.ndarray) -> float:
    """Longest step of a replay, s, in which the valve changes no pressure by more than `LARGEST_CHANGE`.

    `LARGEST_CHANGE` is relative to P_s. The largest command and the smallest volume of the record decide.
    """
    c = plant.conditions
    gas = plant.gas
    valve = plant.valve
    largest = valve.u_max if valve.paths.knots else min(float(np.max(np.abs(u))), valve.u_max)
    A_t = valve.k_xu * largest
    V = min(
        volume(np.min(s * x), chamber_of(plant.cylinder, i), plant.cylinder) for i, s in enumerate((1, -1))
    )
    rate = gas.gamma * gas.R * c.T_in * choked_flow(A_t, c.P_s, c.T_in, gas)  # times the volume, Pa m^3/s
    return float(np.clip(LARGEST_CHANGE * c.P_s * max(V, 0.0) / max(rate, TINY), SHORTEST_STEP, LONGEST_STEP))


def steps_between_samples(m: Measurement, plant: Plant) -> int:
    """Steps of a replay between two samples of a measurement."""
    longest = LONGEST_STEP if m.m is not None else longest_step(plant, m.u, m.x)
    return int(np.ceil(m.period / longest * (1 - 1e-9)))


def stage_signals(measurement: Measurement, plant: Plant, command: Sampling = HELD) -> StageSignals:
    """Signals of a measurement at the stages of a replay.

    The command is limited by the `plant`'s valve. It is `HELD` until the next sample, as by a digital
    controller, or `INTERPOLATED`, as flows and supply always are. The step between two of several records has
    no meaning.
    """
    m, u_max = measurement, plant.valve.u_max
    t, within = m.t, steps_between_samples(m, plant)
    h, steps = m.period / within, within * (len(t) - 1)
    at = (np.arange(steps)[:, None] + NODES) * h  # times of the stages
    held_u = np.broadcast_to(np.repeat(m.u[:-1], within)[:, None], at.shape)
    limited = np.clip(held_u if command == HELD else np.interp(at, t, m.u), -u_max, u_max)
    ends = record_ends(m.begins, len(t))
    penalty = min(smoothing(m.x[first : last + 1], m.period) for first, last in ends)
    motion = np.empty((*at.shape, 2))
    for begin, end in ends:
        for first in range(begin, end, LONGEST_SPLINE):
            last = min(first + LONGEST_SPLINE, end)
            seen = slice(max(first - OVERLAP, begin), min(last + OVERLAP, end) + 1)
            spline = make_smoothing_spline(t[seen], m.x[seen], lam=penalty)
            stages = slice(first * within, (last + (last == end)) * within)  # with the step to the next
            motion[stages, :, 0], motion[stages, :, 1] = spline(at[stages]), spline.derivative()(at[stages])
    return StageSignals(
        period=m.period,
        h=h,
        u=limited,
        motion=motion,
        P=m.P,
        used=np.ones(m.P.shape, dtype=bool) if m.used is None else m.used,
        P_s=None if m.P_s is None else np.interp(at, t, m.P_s),
        flow=None if m.m is None else np.stack([np.interp(at, t, side) for side in m.m], axis=-1),
        begins=m.begins,
        zeros=m.zeros,
    )
