"""Thermal laws of two closed chambers with a piston that moves or is held, as a problem of least squares.

Pressures follow from the balances of energy and mass, eqs (4) and (5), with one of `LAWS`; gas flows only
past the piston. The first part of a record is fitted; one run from its first sample predicts the rest.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np

import pneumo.core as core
from pneumo.fitting.engine import Solution, WithoutPrior, solve
from pneumo.fitting.settings import LARGEST_MOTION

SCALE = 1e6  # Pa, by which residuals are divided
FAR_OFF = 1e3  # residual of a replay whose steps are too long for its conductance
LEAKS_AT_START = 0.01, 1.0  # of a search, over its scale
# Bounds of the search, over a parameter's scale; a leak of 1 empties a chamber within the record.
BOUNDS = {"V_d": (0.01, 100.0), "k": (1e-3, 1e3), "n": (0.8, 2.0), "leak": (0.0, 100.0)}
BOUNDS |= {"start": (0.5, 2.0), "first": (0.5, 2.0)}


class Law(NamedTuple):
    """Thermal law of the gas: its index n, and its wall heat if `explicit_heat`."""

    n: float | None = None  # gamma where None, fitted where NaN
    explicit_heat: bool = False
    e_A: float = 0.0  # exponents of the conductance, as in `wall_conductance`
    e_PT: float = 0.0


LAWS = {
    "isothermal": Law(1.0),
    "adiabatic": Law(),
    "free n": Law(np.nan),
    "wall heat, constant": Law(explicit_heat=True),
    "wall heat, root of PT": Law(explicit_heat=True, e_PT=0.5),
    "wall heat, area and root of PT": Law(explicit_heat=True, e_A=1.0, e_PT=0.5),
}


class ClosedRecord(NamedTuple):
    """Signals of two closed chambers, uniform in time, and the piston's size."""

    name: str
    t: np.ndarray  # s
    x: np.ndarray  # m, from the end where chamber A is smallest
    P: np.ndarray  # Pa, absolute, by (chamber, sample)
    areas: tuple[float, float]  # m^2, of the piston on either side
    bore: float  # m
    stroke: float  # m
    R: float
    gamma: float
    T_wall: float
    PT_0: float  # Pa K, product P T at which conductances are stated

    @property
    def h(self) -> float:
        """Time between samples, s."""
        return float(self.t[-1]) / (len(self.t) - 1)

    @property
    def moves(self) -> bool:
        """Whether the piston moves, so that dead volumes can be fitted."""
        return float(np.ptp(self.x)) > LARGEST_MOTION * self.stroke

    @property
    def uncovered(self) -> np.ndarray:
        """Distance of the piston from each cylinder head, m, by (chamber, sample)."""
        return np.array([self.x, self.stroke - self.x])

    @property
    def area_ratio(self) -> np.ndarray:
        """Heat transfer area over that in mid-stroke, by (chamber, sample)."""
        return (self.bore / 2 + self.uncovered) / (self.bore / 2 + self.stroke / 2)  # before eq (12)


@dataclass(frozen=True)
class ClosedProblem(WithoutPrior):
    """Least squares of a law on the first part of a record; parameters are divided by their scales.

    With wall heat, `start_A` is the first temperature over the wall's, and `first_A` the first pressure over
    the measured one. Without it, an error in the first pressure never decays, and `start_A` stands for it.
    """

    record: ClosedRecord
    law: Law
    names: tuple[str, ...]  # fitted parameters
    fitted: int  # samples of the first part
    scales: Mapping[str, float]  # SI units; a parameter that is not fitted has the value of its scale
    guess: Mapping[str, float] = field(default_factory=lambda: {"n": 1.2})  # over the scales; others: 1
    every: int = 1  # every how many samples one enters the sum of squares
    chambers: tuple[int, ...] = (0, 1)  # sides whose pressures enter it
    slope_step: ClassVar[float] = 1e-5
    logarithmic: ClassVar[tuple[str, ...]] = ("V_d_A", "V_d_B", "k_A", "k_B")  # never zero

    def values(self, theta: np.ndarray) -> dict[str, float]:
        """Parameters by name, in SI units."""
        return dict(self.scales) | {
            name: self.si(name, part) for name, part in zip(self.names, theta, strict=True)
        }

    def si(self, name: str, part: float) -> float:
        """Value of a parameter in SI units, from that on the scale of the search."""
        return self.scales.get(name, 1.0) * float(np.exp(part) if name in self.logarithmic else part)

    def theta(self, over_scale: Mapping[str, float]) -> np.ndarray:
        """Parameters on the scale of the search, from values over their scales; others are 1."""
        values = {name: over_scale.get(name, 1.0) for name in self.names}
        return np.array([np.log(v) if name in self.logarithmic else v for name, v in values.items()])

    def solve(self, near: np.ndarray | None = None) -> Solution:
        """Lowest minimum from a start with next to no leak, from one with a leak, and from `near`."""
        leaks = LEAKS_AT_START if "leak" in self.names else (0.0,)
        thetas = [self.theta({**self.guess, "leak": leak}) for leak in leaks]
        if near is not None and self.law.explicit_heat:
            thetas.append(near)
        return min((solve(self, theta) for theta in thetas), key=lambda found: found.squares)

    def bounds(self) -> np.ndarray:
        """Bounds of the search, shape (2, parameter)."""
        ends = {name: BOUNDS[name.removesuffix("_A").removesuffix("_B")] for name in self.names}
        return np.array([self.theta({name: pair[end] for name, pair in ends.items()}) for end in range(2)])

    def residual(self, theta: np.ndarray) -> np.ndarray:
        """Measured minus replayed pressures of the samples fitted, over `SCALE`, shape (chamber, sample)."""
        error = self.record.P[:, : self.fitted] - self.replay(theta, self.fitted)
        error = error[list(self.chambers), :: self.every] / SCALE
        return np.where(np.abs(error) < FAR_OFF, error, 1.0)  # and where not finite

    def replay(self, theta: np.ndarray, samples: int) -> np.ndarray:
        """Pressures computed with the parameters `theta` for the first samples, Pa, by (chamber, sample).

        Classical Runge-Kutta steps go from sample to sample. A chamber that is not fitted has the measured
        pressure and the temperature of the wall.
        """
        v, r, law, shape = self.values(theta), self.record, self.law, (2, samples)
        start, first = (
            np.array([v.get(f"{key}_{side}", 1.0) for side in "AB"]) for key in ("start", "first")
        )
        heat, dead = law.explicit_heat, np.array([[v["V_d_A"]], [v["V_d_B"]]])
        V = dead + np.array([r.areas]).T * r.uncovered[:, :samples]
        pressure = np.empty(shape)
        core.lib.closed_chambers(
            core.array("P", r.P[:, 0] * (first if heat else start), (2,)),
            core.array("measured", r.P[:, :samples], shape),
            core.ffi.new("bool[2]", (0 in self.chambers, 1 in self.chambers)),
            core.array("V", V, shape),
            core.array("area_ratio", r.area_ratio[:, :samples], shape),
            core.whole("samples", samples, 1),
            r.h,
            core.array("start", start if heat else np.ones(2), (2,)),
            v.get("n", r.gamma if law.n is None else law.n),
            core.array("k", np.array([v["k_A"], v["k_B"]]) * heat, (2,)),
            law.e_A,
            law.e_PT,
            v["leak"] if "leak" in self.names else 0.0,
            r.R,
            r.gamma,
            r.T_wall,
            r.PT_0,
            core.out(pressure),
        )
        return pressure

    def errors(self, pressure: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Root mean square errors of pressures of the whole record, Pa, by chamber: fitted and held out."""
        first, rest = np.split((pressure - self.record.P) ** 2, [self.fitted], axis=1)
        return np.sqrt(first.mean(axis=1)), np.sqrt(rest.mean(axis=1))


def fitted_names(law: Law, leaks: bool = True) -> tuple[str, ...]:
    """Names of the parameters that are fitted with a law."""
    heat, free = (("k_A", "k_B"), ()) if law.explicit_heat else ((), ("n",) if np.isnan(law.n or 1.0) else ())
    return ("V_d_A", "V_d_B", "start_A", "start_B", *heat, *free, *(("leak",) if leaks else ()))
