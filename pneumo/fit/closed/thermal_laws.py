"""Thermal laws of two closed chambers with a moving piston, fitted to records and compared.

Pressures follow from the balances of energy and mass, eqs (4) and (5), with one of `LAWS`; gas flows only
past the piston. The first part of a record is fitted; one run from its first sample predicts the rest.
`pneumo.fit.closed.closed_fit` adds intervals, for `pneumo fit`.
"""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.optimize import OptimizeResult, least_squares

import pneumo.core as core
from pneumo.fit.fit_result import Estimate

R_NITROGEN, GAMMA = 296.80, 1.4  # J/(kg K); at 0.3 to 1.6 MPa nitrogen is perfect within 1 %
T_WALL = 293.15  # K. ASSUME: not in the records; k scales with its inverse, predictions do not depend on it
P_0 = 1e6  # Pa; conductances are stated at P_0, T_WALL and mid-stroke
PART = 0.6  # of a record that is fitted
THINNED = 5  # every how many samples one is fitted: 0.1 s, while a stroke takes seconds
SHOWN = 60.0  # s, of errors in the figure
FAR_OFF = 1e3  # error over 1 MPa, of a replay whose steps are too long for its conductance
STILL = 0.05  # relative change of pressure below which a record has nothing to fit


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
PARAMETERS = ("V_d_A", "V_d_B", "start_A", "start_B", "n", "k_A", "k_B", "leak")
SCALES = {"V_d_A": 1e-2, "V_d_B": 1e-2, "k_A": 10.0, "k_B": 10.0, "leak": 1e-9}  # m^3, W/K, kg/(s Pa)
GUESS = {"V_d_A": 2.0, "V_d_B": 4.0, "n": 1.2, "leak": 0.01}  # over the scales, as the bounds; others: 1
LOW = {"V_d_A": 0.01, "V_d_B": 0.01, "start_A": 0.5, "start_B": 0.5, "n": 0.8}  # others: 0
HIGH = {"start_A": 2.0, "start_B": 2.0, "n": 2.0}  # others: none


class ClosedRecord(NamedTuple):
    """Signals of two closed chambers, uniform in time, and the piston's size."""

    name: str
    t: np.ndarray  # s
    x: np.ndarray  # m, from the end where chamber A is smallest
    P: np.ndarray  # Pa, absolute, by (chamber, sample)
    areas: tuple[float, float]  # m^2, of the piston on either side
    bore: float  # m
    stroke: float  # m
    R: float = R_NITROGEN
    gamma: float = GAMMA
    T_wall: float = T_WALL
    PT_0: float = P_0 * T_WALL  # Pa K, product P T at which conductances are stated

    @property
    def h(self) -> float:
        """Time between samples, s."""
        return float(self.t[-1]) / (len(self.t) - 1)

    @property
    def uncovered(self) -> np.ndarray:
        """Distance of the piston from each cylinder head, m, by (chamber, sample)."""
        return np.array([self.x, self.stroke - self.x])

    @property
    def area_ratio(self) -> np.ndarray:
        """Heat transfer area over that in mid-stroke, by (chamber, sample)."""
        wall = np.pi / 2 * self.bore**2 + np.pi * self.bore * self.uncovered  # before eq (12)
        return wall / (np.pi / 2 * self.bore**2 + np.pi * self.bore * self.stroke / 2)


def read_closed_record(path: Path) -> ClosedRecord:
    """Record from a NetCDF file with t, x, P_A, P_B and the attributes bore_m, rod_m, stroke_m."""
    with xr.open_dataset(path.absolute(), decode_times=False) as data:
        bore, rod, stroke = (float(data.attrs[f"{name}_m"]) for name in ("bore", "rod", "stroke"))
        t, x, P_A, P_B = (data[name].values.astype(float) for name in ("t", "x", "P_A", "P_B"))
    area = np.pi / 4 * bore**2
    return ClosedRecord(
        name=path.stem,
        t=t,
        x=x,
        P=np.array([P_A, P_B]),
        areas=(area, area - np.pi / 4 * rod**2),
        bore=bore,
        stroke=stroke,
    )


def is_still(record: ClosedRecord) -> bool:
    """Whether pressures hardly change, as in open chambers."""
    return bool(np.max(np.ptp(record.P, axis=1) / record.P.mean(axis=1)) < STILL)


def closed_chambers(
    P: np.ndarray,
    measured: np.ndarray,
    closed: tuple[bool, bool],
    V: np.ndarray,
    area_ratio: np.ndarray,
    h: float,
    start: np.ndarray,
    n: float,
    k: np.ndarray,
    e_A: float,
    e_PT: float,
    leak: float,
    R: float,
    gamma: float,
    T_wall: float,
    PT_0: float,
) -> np.ndarray:
    """Pressures of both chambers, Pa, by (chamber, sample), by classical Runge-Kutta steps of `h` seconds.

    P are the first pressures, Pa, `start` the first temperatures over that of the wall; volumes V, m^3, and
    `area_ratio` are by (chamber, sample). Conductances k, W/K, are stated in mid-stroke at a product P T of
    `PT_0`; `leak` is the mass flow from A to B over P_A - P_B, kg/(s Pa). A chamber that is not `closed` has
    the `measured` pressure and the temperature of the wall.
    """
    pressure, (_, samples) = np.empty(V.shape), V.shape
    core.lib.closed_chambers(
        core.array("P", P, (2,)),
        core.array("measured", measured, (2, samples)),
        core.ffi.new("bool[2]", closed),
        core.array("V", V, (2, samples)),
        core.array("area_ratio", area_ratio, (2, samples)),
        core.whole("samples", samples, 1),
        h,
        core.array("start", start, (2,)),
        n,
        core.array("k", k, (2,)),
        e_A,
        e_PT,
        leak,
        R,
        gamma,
        T_wall,
        PT_0,
        core.out(pressure),
    )
    return pressure


class ClosedProblem(NamedTuple):
    """Least squares of a law on the first part of a record; parameters are divided by their scales.

    With wall heat, `start_A` is the first temperature over the wall's. Without it, an error in the first
    pressure never decays: then `start_A` is the first pressure over the measured one.
    """

    record: ClosedRecord
    law: Law
    names: tuple[str, ...]  # fitted parameters
    fitted: int  # samples of the first part
    known: Mapping[str, float] = MappingProxyType({})  # parameters that are not fitted, in SI units
    scales: Mapping[str, float] = MappingProxyType(SCALES)
    guess: Mapping[str, float] = MappingProxyType(GUESS)
    every: int = THINNED  # every how many samples one enters the sum of squares
    chambers: tuple[int, ...] = (0, 1)  # sides whose pressures enter it

    def values(self, theta: np.ndarray) -> dict[str, float]:
        """Parameters by name, in SI units."""
        pairs = zip(self.names, theta, strict=True)
        return {**self.known, **{name: float(part) * self.scales.get(name, 1.0) for name, part in pairs}}

    def volumes(self, values: Mapping[str, float]) -> np.ndarray:
        """Volumes, m^3, by (chamber, sample)."""
        r = self.record
        return np.array([[values["V_d_A"]], [values["V_d_B"]]]) + np.array([r.areas]).T * r.uncovered

    def replay(self, theta: np.ndarray, samples: int) -> np.ndarray:
        """Pressures computed with the parameters `theta` for the first samples, Pa, by (chamber, sample)."""
        v, r, law = self.values(theta), self.record, self.law
        V, area_ratio = self.volumes(v)[:, :samples], r.area_ratio[:, :samples]
        start = np.array([v.get("start_A", 1.0), v.get("start_B", 1.0)])
        k = np.array([v.get("k_A", 0.0), v.get("k_B", 0.0)])
        first = r.P[:, 0] * np.array([v.get("first_A", 1.0), v.get("first_B", 1.0)])
        P, T = (first, start) if law.explicit_heat else (first * start, np.ones(2))
        n, gas = v.get("n", r.gamma if law.n is None else law.n), (r.R, r.gamma, r.T_wall, r.PT_0)
        inputs = r.P[:, :samples], (0 in self.chambers, 1 in self.chambers), V, area_ratio, r.h
        return closed_chambers(P, *inputs, T, n, k, law.e_A, law.e_PT, v.get("leak", 0.0), *gas)

    def errors(self, pressure: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Root mean square errors of pressures of the whole record, Pa, by chamber: fitted and held out."""
        first, rest = np.split((pressure - self.record.P) ** 2, [self.fitted], axis=1)
        return np.sqrt(first.mean(axis=1)), np.sqrt(rest.mean(axis=1))

    def residual(self, theta: np.ndarray) -> np.ndarray:
        """Replayed minus measured pressure of the samples fitted, over 1 MPa, chamber after chamber."""
        error = self.replay(theta, self.fitted) - self.record.P[:, : self.fitted]
        error = error[list(self.chambers), :: self.every].ravel() / P_0
        return np.where(np.abs(error) < FAR_OFF, error, 1.0)  # and where not finite

    def solve(
        self, start: np.ndarray | None = None, most: int | None = None, **fixed: float
    ) -> OptimizeResult:
        """Minimum of the sum of squares with some parameters `fixed`, after at most `most` evaluations."""
        first = np.array([self.guess.get(name, 1.0) for name in self.names]) if start is None else start
        free = np.array([name not in fixed for name in self.names])
        whole = np.array([fixed.get(name, value) for name, value in zip(self.names, first, strict=True)])
        low = np.array([LOW.get(name, 0.0) for name in self.names])
        high = np.array([HIGH.get(name, np.inf) for name in self.names])

        def residual(theta: np.ndarray) -> np.ndarray:
            whole[free] = theta
            return self.residual(whole)

        bounds = low[free], high[free]
        return least_squares(residual, whole[free], bounds=bounds, x_scale="jac", max_nfev=most)


def fitted_names(law: Law, leaks: bool) -> tuple[str, ...]:
    """Names of the parameters that are fitted with a law."""
    names = ["V_d_A", "V_d_B", "start_A", "start_B"]
    names += ["k_A", "k_B"] if law.explicit_heat else []
    names += ["n"] if law.n is not None and np.isnan(law.n) else []
    return (*names, "leak") if leaks else tuple(names)


def fit_law(record: ClosedRecord, law: Law, leaks: bool) -> Estimate:
    """Estimate of a law, fitted to the first `PART` of a record; without intervals."""
    problem = ClosedProblem(record, law, fitted_names(law, leaks), int(PART * len(record.t)))
    theta = problem.solve().x
    pressure = problem.replay(theta, len(record.t))
    return Estimate(problem.values(theta), {}, {}, *problem.errors(pressure), pressure)


def judged(record: ClosedRecord) -> xr.Dataset:
    """Every law fitted to a record, without and with leakage past the piston.

    `fitted_rms` and `held_out_rms`, Pa, by (law, leakage, chamber); `value`, SI units, by (law, leakage,
    parameter), NaN where a law has no such parameter; `error`, Pa, predicted minus measured without leakage
    in the first `SHOWN` seconds of the part held out, by (law, chamber, t).
    """
    fits = [[fit_law(record, law, leaks) for leaks in (False, True)] for law in LAWS.values()]
    first, by = int(PART * len(record.t)), ("law", "leakage", "chamber")
    window = slice(first, first + int(np.searchsorted(record.t, SHOWN)), THINNED)
    errors = [(row[0].pressure - record.P)[:, window] for row in fits]
    values = [[[fit.values.get(name, np.nan) for name in PARAMETERS] for fit in row] for row in fits]
    return xr.Dataset(
        {
            "fitted_rms": (by, [[fit.rms for fit in row] for row in fits], {"units": "Pa"}),
            "held_out_rms": (by, [[fit.held_out for fit in row] for row in fits], {"units": "Pa"}),
            "value": ((*by[:2], "parameter"), values),
            "error": (("law", "chamber", "t"), errors, {"units": "Pa"}),
        },
        {
            "law": list(LAWS),
            "leakage": ["none", "past the piston"],
            "chamber": ["A", "B"],
            "parameter": list(PARAMETERS),
            "t": ("t", THINNED * np.diff(record.t).mean() * np.arange(len(errors[0][0])), {"units": "s"}),
        },
    )
