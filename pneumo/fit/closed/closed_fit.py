"""Thermal laws fitted to a measurement of closed chambers, with a piston that moves or is held.

Pressures give the gas's temperature only as a ratio to the wall's, which is measured or configured: all
conductances are inversely proportional to the wall's temperature. `k_A` is the mean conductance in the part
fitted, by the law itself; `k_0_A` is the law's conductance at P_0, T_0 and in mid-stroke, where
configurations state it. The law "wall heat, area and root of PT" is that of the full order.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import make_smoothing_spline
from scipy.optimize import OptimizeResult

from pneumo.catalogue import default_conductance
from pneumo.configuration.experiment import Plant
from pneumo.fit.closed.closed_warnings import check_closed, closed_warnings
from pneumo.fit.closed.thermal_laws import LAWS, ClosedProblem, ClosedRecord, fitted_names
from pneumo.fit.closed.thermal_time_constant import LARGEST_MOTION
from pneumo.fit.engine import CLOSE, HALF_WIDTH, WIDE, Solution, covariances, inverse_curvature, profile_end
from pneumo.fit.estimate import PART, alike_notes, at_temperature, error_line, ranked
from pneumo.fit.fit_result import ClosedChambersResult, Estimate, equally_good, fit_data
from pneumo.fit.record.measurement import Measurement
from pneumo.fit.residuals import Residual, split_residuals
from pneumo.fit.stage_signals import smoothing
from pneumo.physics.chamber import wall_conductance
from pneumo.physics.cylinder import Side, chamber_of, volume

REPORTED = ("n", "k_0", "k_0_A", "k_0_B", "k_A", "k_B", "V_d_A", "V_d_B", "leak", "T_A", "T_B")
HELD = ("wall heat, constant", "wall heat, area and root of PT")  # laws that differ where the piston is held
MOST_EVALUATIONS = 100  # in the least squares of a law
MOST_SAMPLES = 4000  # of a chamber in the sum of squares
FIRST_STEP = 0.3  # in the search for an end of an interval, on a logarithmic scale
STEPS = 15  # evaluations for each value that is tried for an end
NO_REPLAY = 1e3  # excess of replays that are not stable
FARTHEST = 1e3  # factor from the estimate beyond which an end is open
POSITIVE = ("k_A", "k_B", "V_d_A", "V_d_B")
SMALLEST = 1e-3  # value over its scale below which a parameter is zero


class Solved(NamedTuple):
    """A law at the minimum of its sum of squares."""

    problem: ClosedProblem
    optimum: OptimizeResult
    pressure: np.ndarray  # Pa, of the whole record, by (chamber, sample); NaN where a chamber is left out
    residuals: dict[str, Residual]  # by chamber, of the part fitted


def closed_record(measurement: Measurement, plant: Plant) -> ClosedRecord:
    """Record with a smoothed position."""
    c, gas, cylinder, t, x = plant.conditions, plant.gas, plant.cylinder, measurement.t, measurement.x
    if np.ptp(x) > 0:
        penalty, _ = smoothing(x, measurement.period)
        x = make_smoothing_spline(t, x, lam=penalty)(t)
    x, areas = x + cylinder.stroke / 2, (cylinder.A_A, cylinder.A_B)
    size = areas, cylinder.bore, cylinder.stroke
    return ClosedRecord(
        measurement.name, t, x, measurement.P, *size, gas.R, gas.gamma, c.T_amb, c.P_0 * c.T_0
    )


def moves(record: ClosedRecord) -> bool:
    """Whether the piston moves, so that dead volumes can be fitted."""
    return float(np.ptp(record.x)) > LARGEST_MOTION * record.stroke


def fit_closed(
    measurement: Measurement,
    plant: Plant,
    *,
    part: float = PART,
    check: bool = True,
    progress: Callable[[str], None] = lambda _text: None,
) -> ClosedChambersResult:
    """Fit thermal laws to two closed chambers.

    Parameters
    ----------
    part
        Fraction of the record that is fitted; one run from the first sample predicts the rest.
    check
        Whether to refuse chambers that look swapped, and a command that is not about zero.
    progress
        Is called with a line after each law.

    Raises
    ------
    InputError
        If no chamber can be fitted: its pressure must change beyond its noise, and follow the piston if that
        moves. Also if `check` refuses the record.
    """
    plant = at_temperature(plant, measurement.T)
    record = closed_record(measurement, plant)
    chambers, notes = check_closed(record, plant, measurement, check)
    if not moves(record):
        notes.append(
            "the piston is held: dead volumes are as configured, and k_0 is proportional to the volume"
        )
    estimates: dict[str, Estimate] = {}
    solved: dict[str, Solved] = {}
    fitted = round(part * (len(record.t) - 1)) + 1
    for name in LAWS if moves(record) else HELD:
        solved[name] = _solved(_problem(name, record, plant, fitted, chambers))
        estimates[name] = _estimate(solved[name])
        progress(error_line(name, estimates[name]))
    estimates = ranked(estimates)
    warnings = closed_warnings(estimates, {name: s.residuals for name, s in solved.items()}, plant)
    data = fit_data(measurement, estimates, REPORTED)
    return ClosedChambersResult(
        data=data.drop_vars(["u", "m"], errors="ignore"),
        notes=(*measurement.notes, *notes, *alike_notes(equally_good(estimates))),
        warnings=tuple(warnings),
        held_out_from=float(measurement.t[fitted - 1]),
        chambers=", ".join(Side(side).name for side in chambers),
        T_wall=plant.conditions.T_amb,
        P_0=plant.conditions.P_0,
    )


def _problem(
    name: str, record: ClosedRecord, plant: Plant, fitted: int, chambers: Sequence[int]
) -> ClosedProblem:
    """Least squares of a law, with parameters scaled to typical values of this plant."""
    cylinder, law = plant.cylinder, LAWS[name]
    known, k = {"V_d_A": cylinder.V_d_A, "V_d_B": cylinder.V_d_B}, default_conductance(cylinder).k_0
    V = volume(0.0, chamber_of(cylinder, Side.A), cylinder)
    leak = V / (record.R * record.T_wall * record.t[-1])  # changes the mass in a chamber within the record
    scales = known | {"leak": leak, "k_A": k, "k_B": k}
    absent = [f"_{side.name}" for side in Side if side not in chambers]
    absent += [] if moves(record) else ["V_d"]
    names = (*fitted_names(law, leaks=True), *(("first_A", "first_B") if law.explicit_heat else ()))
    names = tuple(name for name in names if not any(part in name for part in absent))
    every = max(1, fitted // MOST_SAMPLES)
    guess = {"n": 1.2, "leak": 0.01}
    return ClosedProblem(
        record=record,
        law=law,
        names=names,
        fitted=fitted,
        known=known,
        scales=scales,
        guess=guess,
        every=every,
        chambers=tuple(chambers),
    )


def _solved(problem: ClosedProblem) -> Solved:
    """Law at the minimum of its sum of squares."""
    optimum = problem.solve(most=MOST_EVALUATIONS)
    record, seen, first = problem.record, list(problem.chambers), problem.fitted
    pressure = np.full_like(record.P, np.nan)
    pressure[seen] = problem.replay(optimum.x, len(record.t))[seen]
    residual = (record.P - pressure)[seen, :first]
    split = split_residuals(record.P[seen, :first], residual, record.h)
    residuals = {Side(side).name: parts for side, parts in zip(seen, split, strict=True)}
    return Solved(problem, optimum, pressure, residuals)


def _estimate(solved: Solved) -> Estimate:
    """Estimate of a law: reported parameters with intervals, and errors on the parts fitted and held out."""
    problem, record = solved.problem, solved.problem.record
    values, (low, high) = problem.values(solved.optimum.x), _intervals(solved)
    # Fitted parameter, and factor from it, by reported name.
    reported: dict[str, tuple[str, float]] = {name: (name, 1.0) for name in REPORTED if name in low}
    for side, mean in _mean_conductances(solved, values).items():
        if f"k_{side}" in low:
            reported |= {f"k_{side}": (f"k_{side}", mean), f"k_0_{side}": (f"k_{side}", 1.0)}
        if f"start_{side}" in low and problem.law.explicit_heat:
            reported[f"T_{side}"] = f"start_{side}", record.T_wall
    values, low, high = (
        {name: factor * numbers[fitted] for name, (fitted, factor) in reported.items()}
        for numbers in (values, low, high)
    )
    # A configuration has one k_0: the geometric mean, weighted by the inverse variance, of those whose
    # interval has two ends, within an interval that contains both intervals.
    both = [name for name in ("k_0_A", "k_0_B") if name in values and np.isfinite(low[name] + high[name])]
    if both:
        weights = np.array([np.log(high[name] / low[name]) ** -2 for name in both])
        logs = np.log([values[name] for name in both])
        values["k_0"] = float(np.exp(weights @ logs / weights.sum()))
        low["k_0"], high["k_0"] = min(low[name] for name in both), max(high[name] for name in both)
    return Estimate(values, low, high, *problem.errors(solved.pressure), solved.pressure)


def _mean_conductances(solved: Solved, values: dict[str, float]) -> dict[str, float]:
    """Ratio of the mean conductance to the fitted one, by chamber.

    The fitted conductance holds at P_0, T_0 and in mid-stroke.
    """
    problem, law, fitted = solved.problem, solved.problem.law, solved.problem.fitted
    record, P, V = problem.record, problem.replay(solved.optimum.x, fitted), problem.volumes(values)
    leaked = values.get("leak", 0.0) * record.h * np.cumsum(P[0] - P[1])
    result: dict[str, float] = {}
    for side in Side:
        PV = P[side] * V[side, :fitted]
        ratio: Any = record.area_ratio[side, :fitted]
        start = values.get(f"start_{side.name}", 1.0)
        mass = PV[0] / (record.R * record.T_wall * start) - side.sign * leaked
        PT = P[side] * PV / (mass * record.R) / record.PT_0
        result[side.name] = float(np.mean(wall_conductance(1.0, ratio, PT, law.e_A, law.e_PT)))  # (7), (8)
    return result


def _intervals(solved: Solved) -> tuple[dict[str, float], dict[str, float]]:
    """Lower and upper ends of the intervals by parameter, in SI units; NaN where open.

    Residuals that noise does not explain are taken for the law's own error.
    """
    problem, optimum = solved.problem, solved.optimum
    theta, J, squares = optimum.x, optimum.jac, 2 * float(optimum.cost)
    residual, jacobian = (a.reshape(len(problem.chambers), -1, *a.shape[1:]) for a in (optimum.fun, J))
    fit = Solution(theta, residual, jacobian, squares, np.zeros(theta.shape))
    far = any(residual.far_from_noise for residual in solved.residuals.values())
    variances = np.array([np.diag(c) for c in covariances(fit, squares if far else 0.0)]).max(axis=0)
    half, curvature = HALF_WIDTH * np.sqrt(variances), np.diag(inverse_curvature(fit))
    low: dict[str, float] = {}
    high: dict[str, float] = {}
    for i, name in enumerate(problem.names):
        best, scale = float(theta[i]), problem.scales.get(name, 1.0)
        if name in POSITIVE and half[i] < WIDE * best:
            ends = best * np.exp(-half[i] / best), best * np.exp(half[i] / best)
        elif name not in POSITIVE or far:  # a profile helps no more where the law is wrong
            ends = best - half[i], best + half[i]
            ends = ends if ends[0] > 0 or name not in POSITIVE else (np.nan, ends[1])
        else:
            allowed = HALF_WIDTH**2 * variances[i] / curvature[i]
            ends = tuple(_end(problem, optimum, name, best, sign, allowed) for sign in (-1.0, 1.0))
        low[name], high[name] = scale * ends[0], scale * ends[1]
    if "leak" in low:
        low["leak"] = max(low["leak"], 0.0)
    return low, high


def _end(
    problem: ClosedProblem, optimum: OptimizeResult, name: str, best: float, sign: float, allowed: float
) -> float:
    """End of the interval of a positive parameter from the profile of the sum of squares; NaN where open.

    With the parameter at its end, the lowest sum of squares exceeds the minimum by `allowed`.
    """
    if best < SMALLEST and sign < 0:
        return np.nan

    def excess(distance: float) -> float:
        if distance == 0:
            return -1.0
        fixed = {name: max(best, SMALLEST) * float(np.exp(sign * distance))}
        profile = problem.solve(optimum.x, most=STEPS, **fixed)
        return float(np.sqrt(max(2 * float(profile.cost - optimum.cost) / allowed, 0.0))) - 1

    distance = profile_end(excess, FIRST_STEP, np.log(FARTHEST))
    # Beyond `NO_REPLAY`, steps as long as the sampling period are too long: the end is not known.
    if np.isinf(distance) or excess(distance * (1 + CLOSE)) > NO_REPLAY:
        return np.nan
    return max(best, SMALLEST) * float(np.exp(sign * distance))
