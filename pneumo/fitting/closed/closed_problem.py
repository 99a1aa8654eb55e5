"""Thermal laws of two closed chambers with a piston that moves or is held, as a problem of least squares.

Pressures follow from the balances of energy and mass, eqs (4) and (5), with one of `LAWS`; gas flows only
past the piston. The first part of a record is fitted; one run from its first sample predicts the rest.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

import pneumo.core as core
from pneumo.fitting.least_squares import LeastSquares, Scale, Solution, solve
from pneumo.fitting.settings import LARGEST_MOTION

SCALE = 1e6  # Pa, by which residuals are divided
FAR_OFF = 1e3  # residual of a replay whose steps are too long for its conductance
LEAKS_AT_START = 0.01, 1.0  # of a search, over its typical value
# Bounds of the search, over a parameter's typical value; a leak of 1 empties a chamber within the record.
BOUNDS = {"V_d": (0.01, 100.0), "k_0": (1e-3, 1e3), "n": (2 / 3, 5 / 3), "leak": (0.0, 100.0)}
BOUNDS |= {"T": (0.5, 2.0), "first": (0.5, 2.0)}
FREE_N = 1.2  # typical, where it is fitted
NEVER_ZERO = ("V_d", "k_0")  # searched on a logarithmic scale


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
class ClosedProblem(LeastSquares):
    """Least-squares fit of a thermal law to the first part of a record.

    With wall heat, `T_A` is the first temperature, K, and `first_A` the first pressure over the measured one.
    Without it, an error in the first pressure never decays, and `first_A` is fitted in any case.
    """

    record: ClosedRecord
    law: Law
    scales: Mapping[str, Scale]
    fixed: Mapping[str, float]  # values of all parameters, SI units, where they are not fitted
    fitted: int  # samples of the first part
    every: int = 1  # every how many samples one enters the sum of squares
    chambers: tuple[int, ...] = (0, 1)  # sides whose pressures enter it
    slope_step: ClassVar[float] = 1e-5

    def solve(self, near: np.ndarray | None = None) -> Solution:
        """Lowest minimum from a start with next to no leak, from one with a leak, and from `near`."""
        leaks = LEAKS_AT_START if "leak" in self.scales else (0.0,)
        thetas = [self.inner({**self.fixed, "leak": leak * self.fixed["leak"]}) for leak in leaks]
        if near is not None and self.law.explicit_heat:
            thetas.append(near)
        return min((solve(self, theta) for theta in thetas), key=lambda found: found.squares)

    def residual(self, theta: np.ndarray) -> np.ndarray:
        """Measured minus replayed pressures of the samples fitted, over `SCALE`, shape (chamber, sample)."""
        error = self.record.P[:, : self.fitted] - self.replay(theta, self.fitted)
        error = error[list(self.chambers), :: self.every] / SCALE
        return np.where(np.abs(error) < FAR_OFF, error, 1.0)  # and where not finite

    def replay(self, theta: np.ndarray, samples: int) -> np.ndarray:
        """Pressures computed with the parameters `theta` for the first samples, Pa, by (chamber, sample).

        Classical Runge-Kutta steps go from sample to sample, with volumes linear between. A chamber that is
        not fitted has the measured pressure and the temperature of the wall, for the leak past the piston.
        """
        v = self.values(theta)
        r = self.record
        law = self.law
        shape = (2, samples)
        V = np.array([[v["V_d_A"]], [v["V_d_B"]]]) + np.array([r.areas]).T * r.uncovered[:, :samples]
        pressure = np.empty(shape)
        core.lib.closed_chambers(
            core.array("P", r.P[:, 0] * [v["first_A"], v["first_B"]], (2,)),
            core.array("measured", r.P[:, :samples], shape),
            core.ffi.new("bool[2]", (0 in self.chambers, 1 in self.chambers)),
            core.array("V", V, shape),
            core.array("area_ratio", r.area_ratio[:, :samples], shape),
            core.whole("samples", samples, 1),
            r.h,
            core.array("start", np.array([v["T_A"], v["T_B"]]) / r.T_wall, (2,)),
            v["n"],
            core.array("k", np.array([v["k_0_A"], v["k_0_B"]]) * law.explicit_heat, (2,)),
            law.e_A,
            law.e_PT,
            v["leak"] if "leak" in self.scales else 0.0,
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
    heat = ("T_A", "T_B", "k_0_A", "k_0_B") if law.explicit_heat else ("first_A", "first_B")
    free = ("n",) if np.isnan(law.n or 1.0) else ()
    return ("V_d_A", "V_d_B", *heat, *free, *(("leak",) if leaks else ()))


def closed_problem(
    record: ClosedRecord,
    law: Law,
    names: Sequence[str],
    typical: Mapping[str, float],
    fitted: int,
    every: int = 1,
    chambers: Sequence[int] = (0, 1),
) -> ClosedProblem:
    """Least squares of a law, with the parameters `names`, on the first samples of a record.

    Parameters are searched from `typical` values of V_d_A, V_d_B, k_0_A, k_0_B and leak, SI units, and keep
    these where they are not fitted.
    """
    n = FREE_N if "n" in names else record.gamma if law.n is None else law.n
    start = {"n": n, "T_A": record.T_wall, "T_B": record.T_wall, "first_A": 1.0, "first_B": 1.0, **typical}
    scales: dict[str, Scale] = {}
    for name in names:
        low, high = BOUNDS[(stem := name.removesuffix("_A").removesuffix("_B"))]
        value = start[name]
        scales[name] = Scale(low * value, high * value, stem in NEVER_ZERO, value)
    return ClosedProblem(record, law, scales, start, fitted, every, tuple(chambers))
