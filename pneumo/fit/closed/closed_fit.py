"""Thermal laws fitted to a measurement of closed chambers, on a piston that moves or is held.

Pressures give the gas's temperature only as a ratio to the wall's, which is measured or configured: every
conductance scales with its inverse. It has two conventions here: `k_A` is the mean one of the part fitted, by
the law itself; `k_0_A` is the same at P_0, T_0 and mid-stroke by eqs (7) and (8), as in a configuration. The
full order is the law "wall heat, area and root of PT".
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import make_smoothing_spline
from scipy.optimize import OptimizeResult

from pneumo.catalogue import default_conductance
from pneumo.configuration.experiment import Plant
from pneumo.fit.closed.closed_warnings import check_closed, closed_warnings
from pneumo.fit.closed.thermal_laws import LAWS, ClosedProblem, ClosedRecord, fitted_names
from pneumo.fit.closed.thermal_time_constant import LARGEST_MOTION
from pneumo.fit.estimate import PART, alike_notes, at_temperature, error_line, ranked
from pneumo.fit.fit_result import ClosedChambersResult, Estimate, equally_good, fit_data
from pneumo.fit.least_squares import Fit
from pneumo.fit.parameter_intervals import HALF_WIDTH, WIDE, covariances, crossing, inverse_curvature
from pneumo.fit.record.measurement import Measurement
from pneumo.fit.residuals import Residual, split_residuals
from pneumo.fit.stage_signals import FEW_PAIRS, smoothing
from pneumo.physics.chamber import wall_conductance
from pneumo.physics.cylinder import Side, chamber_of, volume

REPORTED = ("n", "k_0", "k_0_A", "k_0_B", "k_A", "k_B", "V_d_A", "V_d_B", "leak", "T_A", "T_B")
HELD = ("wall heat, constant", "wall heat, area and root of PT")  # laws that differ where the piston is held
MOST_EVALUATIONS = 100  # of a law's least squares
MOST_SAMPLES = 4000  # of a chamber, that enter the sum of squares
FIRST_STEP = 0.3  # of the search for an end, on a logarithmic scale
ROUNDS, STEPS = 2, 15  # values tried for an end once it is enclosed, and evaluations for each
LEAST = 1e-3  # deviance that the least squares' own accuracy may have
NO_REPLAY = 1e6  # deviance of replays that are not stable
FARTHEST = 1e3  # factor from the estimate, beyond which the end of an interval is open
POSITIVE = ("k_A", "k_B", "V_d_A", "V_d_B")
SMALLEST = 1e-3  # of a parameter, over its scale, that differs from zero


class Solved(NamedTuple):
    """A law's least squares."""

    problem: ClosedProblem
    optimum: OptimizeResult
    pressure: np.ndarray  # Pa, of the whole record, by (chamber, sample); NaN where a chamber is left out
    residuals: dict[str, Residual]  # by chamber, of the part fitted


def closed_record(measurement: Measurement, plant: Plant) -> tuple[ClosedRecord, float, float]:
    """Record with a smoothed position, the penalty of its smoothing, s^3, and the position's noise, m."""
    c, gas, cylinder = plant.conditions, plant.gas, plant.cylinder
    x, penalty, noise = measurement.x, 0.0, 0.0
    if np.ptp(x) > 0:
        penalty, noise = smoothing(x, measurement.period)
        x = make_smoothing_spline(measurement.t, x, lam=penalty)(measurement.t)
    record = ClosedRecord(
        measurement.name,
        measurement.t,
        x + cylinder.stroke / 2,
        measurement.P,
        (cylinder.A_A, cylinder.A_B),
        cylinder.bore,
        cylinder.stroke,
        *(gas.R, gas.gamma, c.T_amb, c.P_0 * c.T_0),
    )
    return record, penalty, noise


def fit_closed(
    measurement: Measurement,
    plant: Plant,
    *,
    part: float = PART,
    check: bool = True,
    progress: Callable[[str], None] = lambda _text: None,
) -> ClosedChambersResult:
    """Fit thermal laws to both closed chambers.

    The part held out is predicted in one run from the record's first sample. `check` refuses chambers that
    look swapped, `part` is the fraction that is fitted; `progress` is called with a line after each law.
    `InputError` if no pressure changes with the piston, or beyond its noise.
    """
    plant = at_temperature(plant, measurement.T)
    record, penalty, noise = closed_record(measurement, plant)
    chambers, notes = check_closed(record, plant, measurement, check)
    moves = float(np.ptp(record.x)) > LARGEST_MOTION * record.stroke
    if not moves:
        notes.append(
            "the piston is held: dead volumes are as configured, and k_0 is proportional to the volume"
        )
    moved = noisy_records(record, penalty, noise) if moves and noise > 0 else []
    estimates: dict[str, Estimate] = {}
    solved: dict[str, Solved] = {}
    fitted = round(part * (len(record.t) - 1)) + 1
    for name in LAWS if moves else HELD:
        solved[name] = _solved(_problem(name, record, plant, fitted, chambers, moves), moved)
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


def noisy_records(record: ClosedRecord, penalty: float, noise: float) -> list[ClosedRecord]:
    """Records with a noise, or its negative, added to the smoothed position, which is smoothed again."""
    half = np.random.default_rng(0).normal(0.0, noise, (FEW_PAIRS, len(record.t)))
    noises = np.concatenate([half, -half])
    return [
        record._replace(x=make_smoothing_spline(record.t, record.x + noise, lam=penalty)(record.t))
        for noise in noises
    ]


def _problem(
    name: str, record: ClosedRecord, plant: Plant, fitted: int, chambers: Sequence[int], moves: bool
) -> ClosedProblem:
    """Least squares of a law, with parameters scaled to typical values of this plant."""
    cylinder, law = plant.cylinder, LAWS[name]
    known = {"V_d_A": cylinder.V_d_A, "V_d_B": cylinder.V_d_B}
    V = volume(0.0, chamber_of(cylinder, Side.A), cylinder)
    leak = V / (record.R * record.T_wall * record.t[-1])  # changes a chamber's mass within the record
    scales = known | {"leak": leak}
    scales |= dict.fromkeys(("k_A", "k_B"), default_conductance(cylinder).k_0)
    absent = [f"_{side.name}" for side in Side if side not in chambers] + ([] if moves else ["V_d"])
    names = (
        *fitted_names(law, leaks=True),
        *(["first_A", "first_B"] if law.explicit_heat else []),
    )
    names = tuple(name for name in names if not any(part in name for part in absent))
    guess = {"n": 1.2, "leak": 0.01}
    every = max(1, fitted // MOST_SAMPLES)
    return ClosedProblem(record, law, names, fitted, known, scales, guess, every, tuple(chambers))


def _solved(problem: ClosedProblem, moved: Sequence[ClosedRecord]) -> Solved:
    """Minimum of a law's least squares, with its pressures and the residuals of the part fitted."""
    optimum = problem.solve(most=MOST_EVALUATIONS)
    record, seen, first = problem.record, list(problem.chambers), problem.fitted
    pressure = np.full_like(record.P, np.nan)
    pressure[seen] = problem.replay(optimum.x, len(record.t))[seen]
    noisy = [problem._replace(record=other).replay(optimum.x, first)[seen] for other in moved]
    residual = (record.P - pressure)[seen, :first]
    split = split_residuals(record.P[seen, :first], residual, record.h, np.array(noisy))
    residuals = {Side(side).name: parts for side, parts in zip(seen, split, strict=True)}
    return Solved(problem, optimum, pressure, residuals)


def _estimate(solved: Solved) -> Estimate:
    """Estimates with intervals, and errors of both parts."""
    problem, optimum = solved.problem, solved.optimum
    record = problem.record
    values, (low, high) = problem.values(optimum.x), _intervals(solved)
    factors = _conventions(solved, values)
    # Name of the law's own parameter, and factor from it, by reported name.
    kept: dict[str, tuple[str, float]] = {name: (name, 1.0) for name in REPORTED if name in low}
    for side in "AB":
        if f"k_{side}" in low:
            now, at_0 = factors[side]
            kept |= {f"k_{side}": (f"k_{side}", now), f"k_0_{side}": (f"k_{side}", at_0)}
        if f"start_{side}" in low and problem.law.explicit_heat:
            kept[f"T_{side}"] = f"start_{side}", record.T_wall
    found, lows, highs = (
        {name: factor * numbers[own] for name, (own, factor) in kept.items()}
        for numbers in (values, low, high)
    )
    _put_common_conductance(found, lows, highs)
    squares = (record.P - solved.pressure) ** 2
    rms, held_out = (
        np.sqrt(part.mean(axis=1)) for part in (squares[:, : problem.fitted], squares[:, problem.fitted :])
    )
    return Estimate(found, lows, highs, rms, held_out, solved.pressure)


def _conventions(solved: Solved, values: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Mean conductance of the part fitted, and k_0, over the law's own parameter, by chamber."""
    problem, law = solved.problem, solved.problem.law
    record, P, V = problem.record, problem.replay(solved.optimum.x, problem.fitted), problem.volumes(values)
    lost = values.get("leak", 0.0) * record.h * np.cumsum(P[0] - P[1])
    result: dict[str, tuple[float, float]] = {}
    for side in Side:
        PV, ratio = P[side] * V[side, : problem.fitted], record.area_ratio[side, : problem.fitted]
        start = values.get(f"start_{side.name}", 1.0)
        mass = PV[0] / (record.R * record.T_wall * start) - side.sign * lost
        PT = P[side] * PV / (mass * record.R) / record.PT_0
        now = _mean_conductance(ratio, PT, law.e_A, law.e_PT)
        result[side.name] = now, now / _mean_conductance(ratio, PT, 1.0, 0.5)  # (7), (8)
    return result


def _mean_conductance(ratio: Any, PT: Any, e_A: float, e_PT: float) -> float:
    """Mean of a conductance that is 1 at P_0, T_0 and mid-stroke."""
    return float(np.mean(wall_conductance(1.0, ratio, PT, e_A, e_PT)))


def _put_common_conductance(values: dict[str, float], low: dict[str, float], high: dict[str, float]) -> None:
    """Put in `k_0` for both chambers, as a configuration has it: from those whose interval has two ends.

    Their mean of logarithms, weighted by the inverse variance, within an interval that holds both.
    """
    both = [name for name in ("k_0_A", "k_0_B") if name in values and np.isfinite(low[name] + high[name])]
    if not both:
        return
    weights = np.array([np.log(high[name] / low[name]) ** -2 for name in both])
    logs = np.log([values[name] for name in both])
    values["k_0"] = float(np.exp(weights @ logs / weights.sum()))
    low["k_0"], high["k_0"] = min(low[name] for name in both), max(high[name] for name in both)


def _intervals(solved: Solved) -> tuple[dict[str, float], dict[str, float]]:
    """Ends of the interval of each parameter, in SI units; NaN where open.

    Residuals that noise does not explain are taken for the law's own error.
    """
    problem, optimum = solved.problem, solved.optimum
    theta, J, squares = optimum.x, optimum.jac, 2 * float(optimum.cost)
    residual, jacobian = (of.reshape(len(problem.chambers), -1, *of.shape[1:]) for of in (optimum.fun, J))
    if len(residual) == 1:  # as with a second chamber, of the same noise, that depends on no parameter
        residual, jacobian = np.concatenate([residual] * 2), np.concatenate([jacobian, 0 * jacobian])
    fit = Fit(theta, residual, jacobian, squares, -J.T @ optimum.fun, J.T @ J, np.zeros(2 * theta.shape))
    far = any(residual.far_from_noise for residual in solved.residuals.values())
    variances = np.array([np.diag(c) for c in covariances(fit, squares if far else 0.0)]).max(axis=0)
    half, curvature = HALF_WIDTH * np.sqrt(variances), np.diag(inverse_curvature(fit))
    low: dict[str, float] = {}
    high: dict[str, float] = {}
    for i, name in enumerate(problem.names):
        best, scale = float(theta[i]), problem.scales.get(name, 1.0)
        if name in POSITIVE and half[i] < WIDE * best:
            ends = best * np.exp(-half[i] / best), best * np.exp(half[i] / best)
        elif name not in POSITIVE or far:  # a profile says no more of a law that is off
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
    """End of the profile of a parameter that is not negative, NaN where open.

    The lowest sum of squares with the parameter there exceeds the minimum by what is `allowed`.
    """
    if best < SMALLEST and sign < 0:
        return np.nan

    def deviance(distance: float) -> float:
        fixed = {name: max(best, SMALLEST) * float(np.exp(sign * distance))}
        profile = problem.solve(optimum.x, most=STEPS, **fixed)
        return max(2 * float(profile.cost - optimum.cost) / allowed, LEAST)

    nearer, below, farther = 0.0, LEAST, FIRST_STEP
    while (above := deviance(farther)) < 1:
        if farther > np.log(FARTHEST):
            return np.nan
        nearer, below, farther = farther, above, 2 * farther
    if above > NO_REPLAY:  # steps as long as the sampling period are too long: no end is known
        return np.nan
    for _ in range(ROUNDS):
        middle = crossing(nearer, below, farther, above)
        if (tried := deviance(middle)) < 1:
            nearer, below = middle, tried
        else:
            farther, above = middle, tried
    return max(best, SMALLEST) * float(np.exp(sign * (farther if above < 1 / below else nearer)))
