"""Models of one volume of gas fitted to the runs of a rig, and judged on points that the fit did not use."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.fit.engine import Solution, covariances, parameter_interval, solve
from pneumo.fit.rig.rig_file import Rig, factor, key
from pneumo.fit.rig.rig_record import Run, halves
from pneumo.fit.rig.rig_replay import ADIABATIC, RIG_MODELS, WALL, rms, run_errors
from pneumo.physics.models import MODELS

P_SCALE, T_SCALE = 1e3, 1.0  # Pa and K, by which residuals are divided
FAR = 1e3  # residual where there is no replay
PART_OF_RUNS = 0.25  # that are fitted
PART_OF_POINTS = 0.6  # of a run with many, in time
FEW_POINTS = 200
STARTS = (0.5, 0.3, 0.15, 0.95)  # between the two ends, on a logarithmic scale where both are positive
OFF_END = 0.01  # distance from the ends, of the same kind, at which a search begins
ON_END = 1e-3  # of the distance between its ends, within which a parameter is on one of them
SLOPE_STEP = 1e-6  # of finite differences
POSSIBLE_HOSE = {"hose_volume": (0.2e-6, 1e-4), "hose_C": (0.05e-8, 10e-8)}  # 16 mm to 8 m of 4 mm
LEAST_HOSE = 1e-3  # of a vessel's volume: the gas of a smaller hose is nothing beside the vessel's
HOSE_HELPS = 0.7  # error with a hose over that without, below which one is there


class RigEstimate(NamedTuple):
    """A model fitted to some runs."""

    values: dict[str, float]  # of all quantities of the rig, SI units
    fitted: tuple[str, ...]  # names of those that were fitted
    # Ends of 95 per cent intervals of those: infinite where open, NaN where the value is on an end.
    low: dict[str, float]
    high: dict[str, float]
    rms: float  # Pa, over all points of the pressure that were fitted


def fitted_names(rig: Rig, model: str) -> list[str]:
    """Quantities of a rig that are fitted with a model."""
    names = [name for name, (low, high) in rig.ends.items() if low < high]
    row = MODELS.get(model)
    if row is None or not row.has_n:
        names = [name for name in names if name != "n"]
    if (row is not None and row.wall == "none") or model == ADIABATIC:
        names = [name for name in names if name not in WALL]
    return [name for name in names if name != "T_lag" or row is None]


class RigProblem(NamedTuple):
    """Least squares of a model; parameters run from 0 to 1 between their ends."""

    rig: Rig
    model: str
    runs: Sequence[Run]
    names: tuple[str, ...]
    temperature: bool = False  # whether measured temperatures are fitted too

    def values(self, theta: np.ndarray) -> dict[str, float]:
        """All quantities, SI units."""
        ends = self.rig.ends
        fitted = {
            name: ends[name][0] + float(part) * (ends[name][1] - ends[name][0])
            for name, part in zip(self.names, theta, strict=True)
        }
        return {name: low for name, (low, _) in ends.items()} | fitted

    def bounds(self) -> np.ndarray:
        """Bounds of the search, shape (2, parameter)."""
        return np.array([np.zeros(len(self.names)), np.ones(len(self.names))])

    def residual(self, theta: np.ndarray) -> np.ndarray:
        """Measured minus replayed, over `P_SCALE` or `T_SCALE`, shape (1, point); `FAR` without replay."""
        parts, values = list[np.ndarray](), self.values(theta)
        for run in self.runs:
            P, T = run_errors(self.rig, self.model, values, run)
            parts += [P / P_SCALE, T / T_SCALE] if self.temperature else [P / P_SCALE]
        all_errors = np.concatenate(parts)
        return np.where(np.isfinite(all_errors), -all_errors, FAR)[None]

    def jacobian(self, theta: np.ndarray) -> np.ndarray:
        """Derivative of the replayed values, shape (1, point, parameter), by one-sided differences."""
        here, steps = self.residual(theta), np.where(theta > 0.5, -SLOPE_STEP, SLOPE_STEP)
        columns = [
            (here - self.residual(row)) / step
            for row, step in zip(theta + np.diag(steps), steps, strict=True)
        ]
        return np.stack(columns, axis=-1) if columns else np.empty((*here.shape, 0))

    def prior_terms(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Nothing is known beforehand but the ends."""
        return theta, np.zeros(len(theta))

    def start(self, position: float) -> np.ndarray:
        """Parameters at a relative position, 0 to 1, between their ends.

        The position is on a logarithmic scale where both ends are positive.
        """
        theta = list[float]()
        for name in self.names:
            low, high = self.rig.ends[name]
            at = low * (high / low) ** position if low > 0 else low + position * (high - low)
            theta.append((at - low) / (high - low))
        return np.array(theta)

    def solve(self, near: Mapping[str, float] | None = None, alone: bool = False) -> Solution:
        """Lowest sum of squares that a search finds from several starts.

        `near`, values of another fit, are one more start, or with `alone` the only one.
        """
        starts = [] if alone else [self.start(position) for position in STARTS]
        if near is not None:
            ends = self.rig.ends
            parts = [(near[name] - ends[name][0]) / (ends[name][1] - ends[name][0]) for name in self.names]
            starts.insert(0, np.clip(parts, OFF_END, 1 - OFF_END))
        return min((solve(self, start) for start in starts), key=lambda found: found.squares)


def fit_rig(
    rig: Rig,
    model: str,
    runs: Sequence[Run],
    temperature: bool = False,
    near: Mapping[str, float] | None = None,
    alone: bool = False,
) -> RigEstimate:
    """Estimate of a model from some runs; `near` and `alone` as in `RigProblem.solve`.

    Intervals do not include an error of the model itself.
    """
    problem = RigProblem(rig, model, runs, tuple(fitted_names(rig, model)), temperature)
    best = problem.solve(near, alone)
    values, both = problem.values(best.theta), covariances(best)
    low, high = dict[str, float](), dict[str, float]()
    for i, name in enumerate(problem.names):
        lowest, highest = rig.ends[name]
        start, end = parameter_interval(problem, best, i, both, logarithmic=False)
        on_end = not ON_END < best.theta[i] < 1 - ON_END
        if on_end and np.isfinite([start, end]).any():
            start = end = np.nan
        low[name], high[name] = (lowest + part * (highest - lowest) for part in (start, end))
    P = np.concatenate([run_errors(rig, model, values, run)[0] for run in runs])
    return RigEstimate(values, problem.names, low, high, rms(P))


def rig_warnings(rig: Rig, runs: Sequence[Run], lowest: float) -> list[str]:
    """Warning of a hose between valve and chamber that the rig lacks, if it would lower the error much.

    `runs` are those that were fitted, `lowest` is the lowest error of a model there, Pa.
    """
    if not rig.has("valve_C_in") or rig.has("hose_volume"):
        return []
    smallest, largest = POSSIBLE_HOSE["hose_volume"]
    smallest = max(smallest, LEAST_HOSE * rig.ends.get("volume", (0.0, 0.0))[0])
    if smallest >= largest:
        return []
    possible = POSSIBLE_HOSE | {"hose_volume": (smallest, largest)}
    line = fit_rig(rig.changed(**possible), "full order", runs)
    if line.rms > HOSE_HELPS * lowest:
        return []
    words = " and ".join(map(key, POSSIBLE_HOSE))
    volume, C = (line.values[name] / factor(name) for name in POSSIBLE_HOSE)
    return [
        f"a hose of {volume:.3g} mL and {C:.3g} dm3/(s bar) between valve and chamber would bring the error"
        f" from {lowest / 1e3:.3g} to {line.rms / 1e3:.3g} kPa: add {words}"
    ]


class Judged(NamedTuple):
    """A fitted model, and its errors on points that its fit did not use."""

    estimate: RigEstimate
    held_out: float  # Pa
    T: float  # K, over all temperatures; NaN where none was measured


def fitted_runs(runs: Sequence[Run]) -> Sequence[Run]:
    """Runs, or points of a single run, that are fitted."""
    if len(runs) > 1:
        return runs[: max(1, round(PART_OF_RUNS * len(runs)))]
    t = runs[0].P.t
    last = t[0] + (PART_OF_POINTS * np.ptp(t) if len(t) > FEW_POINTS else np.inf)
    return [runs[0].within(-np.inf, last)]


def judged(
    rig: Rig,
    model: str,
    runs: Sequence[Run],
    temperature: bool = False,
    near: Mapping[str, float] | None = None,
) -> Judged:
    """Estimate of a model, and its error on points held out.

    Of several runs, the first are fitted and the others held out. Of a single run with many points, the later
    ones are held out. Of one with few points, every second is held out, then the others; the estimate itself
    is from all points.
    """
    left = list[np.ndarray]()
    used = fitted_runs(runs)
    estimate = fit_rig(rig, model, used, temperature, near)
    left += [run_errors(rig, model, estimate.values, run)[0] for run in runs[len(used) :]]
    if len(runs) == 1 and len(used[0].P.t) < len(runs[0].P.t):
        later = runs[0].within(used[0].P.t[-1], np.inf)
        left.append(run_errors(rig, model, estimate.values, later)[0])
    elif len(runs) == 1:
        run = runs[0]
        for chosen, others in (halves(run.P), halves(run.P)[::-1]):
            part = fit_rig(rig, model, [run._replace(P=chosen)], temperature, estimate.values, alone=True)
            left.append(run_errors(rig, model, part.values, run._replace(P=others))[0])
    T = np.concatenate([run_errors(rig, model, estimate.values, run)[1] for run in runs])
    return Judged(estimate, rms(np.concatenate(left)), rms(T) if len(T) else np.nan)


def judged_models(
    rig: Rig,
    runs: Sequence[Run],
    models: Sequence[str] = RIG_MODELS,
    temperature: bool = False,
    progress: Callable[[str], None] = lambda _text: None,
) -> xr.Dataset:
    """Several models fitted to a rig's runs.

    Errors `fitted` and `held_out`, Pa, and `T_error`, K, by model; `estimate`, `low` and `high` by (model,
    parameter) in the unit that the parameter's name ends with, NaN where a model does not fit it or the
    value is on a bound, infinite where an end is open.
    """
    results = dict[str, Judged]()
    for model in models:
        best = min((r.estimate for r in results.values()), key=lambda e: e.rms, default=None)
        results[model] = judged(rig, model, runs, temperature, best and best.values)
        held_out = results[model].held_out
        progress(
            f"{model}: {results[model].estimate.rms / 1e3:.2f} kPa fitted, {held_out / 1e3:.2f} held out"
        )
    names = [name for name, (low, high) in rig.ends.items() if low < high]
    estimates = [result.estimate for result in results.values()]

    def by_parameter(field: str) -> tuple[tuple[str, str], list[list[float]]]:
        rows = [
            [getattr(e, field)[name] / factor(name) if name in e.fitted else np.nan for name in names]
            for e in estimates
        ]
        return ("model", "parameter"), rows

    Pa = {"units": "Pa"}
    return xr.Dataset(
        {
            "fitted": ("model", [e.rms for e in estimates], Pa),
            "held_out": ("model", [result.held_out for result in results.values()], Pa),
            "T_error": ("model", [result.T for result in results.values()], {"units": "K"}),
            "estimate": by_parameter("values"),
            "low": by_parameter("low"),
            "high": by_parameter("high"),
        },
        {"model": list(models), "parameter": [key(name) for name in names]},
    )


def values_of(result: xr.Dataset, rig: Rig, model: str) -> dict[str, float]:
    """All quantities of a rig with the estimates of a model in a result of `judged_models`, SI units."""
    values = {name: low for name, (low, _) in rig.ends.items()}
    for name in values:
        if key(name) in result["parameter"]:
            estimate = result["estimate"].sel(model=model, parameter=key(name)).item()
            values[name] = estimate * factor(name) if np.isfinite(estimate) else values[name]
    return values
