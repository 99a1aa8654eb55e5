"""Mass, friction and end stop of a cylinder, identified from its settling times, Table 5, within wide bounds.

The settling times of chamber A are fitted, those of chamber B are a check. Parameters are logarithms of M,
k_f and the stop's distance from the centre over the half-stroke. A settling time counts whole steps, so the
deviance has small jumps and every search goes without derivatives.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import xarray as xr
from scipy.optimize import differential_evolution, minimize, minimize_scalar

from pneumo.configuration.experiment import Experiment
from pneumo.errors import ResultError
from pneumo.evidence.identification.deviance import (
    REGION_THRESHOLD,
    THRESHOLD,
    deviance_interval,
    log_noise,
    widening,
)
from pneumo.simulation.settling import QUANTITIES, SHORTEST_WINDOW, settle, thermal_time_constant
from pneumo.statistics.averages import rms_of

# ASSUME: E12's pressures, and the closed-loop rows below 0.5 W/K, cannot be explained and are left out.
FITTED_EXPERIMENTS = {"D": ("E09", "E10", "E13", "E14"), "E": ("E11", "E15", "E16")}
FITTED_QUANTITIES = ("P_A", "T_A")
IS_FITTED = np.isin(QUANTITIES, FITTED_QUANTITIES)
MECHANICS = ("M", "k_f", "stop")
MECHANICS_UNITS = ("kg", "N s m-1", "1")
SEARCH_BOUNDS = np.array([(0.1, 20.0), (1.0, 1000.0), (0.1, 0.9)])
SETTLING_DISCREPANCY = 0.01
TIME_TO_SETTLE = 40.0  # thermal time constants; a run that is not settled by then does not fit
UNSETTLED_LOG = 3.0  # its ln(reproduced / printed)

PROFILE_STEPS = np.array([0.005, 0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 0.32])
OFFSETS = np.concatenate([-PROFILE_STEPS[::-1], [0.0], PROFILE_STEPS])  # of a profile, ln(value / estimate)
FOLLOWED = 3.0  # a profile ends above so many thresholds
IMPROVED = 0.3  # all profiles start again from a point whose deviance is lower by this
REGION = 11  # values of M in the region of M and k_f
# ln(k_f / M) in that region, less the estimate's: the valley is narrow and has a nearly constant ratio
RATIO_OFFSETS = np.linspace(-0.007, 0.007, 15)
FORCES = np.array([0.5, 0.7, 1.0, 1.4, 2.0, 3.0])  # over the configured force
NEAR = 0.02  # size of the simplex with which a search starts near an optimum

Mapper: TypeAlias = Callable[[Callable[..., Any], Iterable[Any]], Iterable[Any]]


class SettlingCells(NamedTuple):
    """A cylinder's experiments with their printed settling times, shape (experiment, 4)."""

    experiments: tuple[Experiment, ...]
    printed: np.ndarray  #: settling times as printed, s
    sigma: np.ndarray  #: standard deviation of their logarithm


def settling_cells(
    experiments: Mapping[str, Experiment], names: Sequence[str], table: xr.DataArray
) -> SettlingCells:
    """Named experiments with their rows of Table 5.

    `ResultError` if the study lacks an experiment, or Table 5 has no legible row for it.
    """
    for name in names:
        if name not in experiments:
            raise ResultError(f"{name}: not in this study; there are {', '.join(experiments)}")
        row = table.sel(experiment=name) if name in table["experiment"].values else None
        if row is None or not bool(np.isfinite(row).all()):
            raise ResultError(f"{name}: not all four settling times in Table 5 are legible")
    rows = table.sel(experiment=list(names), quantity=list(QUANTITIES))
    sigma = log_noise(rows.values, rows["half_unit"].values, SETTLING_DISCREPANCY)
    return SettlingCells(tuple(experiments[name] for name in names), rows.values, sigma)


def with_mechanics(experiment: Experiment, theta: np.ndarray, force: float = 1.0) -> Experiment:
    """Return the experiment with other mechanics, exp(`theta`), and its push force times `force`.

    exp(`theta`) is M, kg, k_f, N s/m, and the distance of the stop from the centre over the half-stroke. Leak
    and stop times of the closed loop stay as configured; the estimates are valid for these.
    """
    M, k_f, stop = np.exp(theta)
    cylinder, push = experiment.plant.cylinder._replace(M=M, k_f=k_f), experiment.push
    push = push._replace(x_stop=-stop * cylinder.stroke / 2, force=push.force * force)
    return experiment._replace(plant=experiment.plant._replace(cylinder=cylinder), push=push)


def log_ratios(data: SettlingCells, theta: np.ndarray, force: float = 1.0) -> np.ndarray:
    """ln(reproduced / printed) of every settling time, shape (experiment, 4)."""
    result = np.full(data.printed.shape, UNSETTLED_LOG)
    for i, e in enumerate(data.experiments):
        longest = TIME_TO_SETTLE * max(thermal_time_constant(e.plant), SHORTEST_WINDOW)
        times = settle(with_mechanics(e, theta, force), longest=longest).times
        if np.isfinite(times).all():  # else the run failed or did not settle
            result[i] = np.log(np.maximum(times, e.h) / data.printed[i])
    return np.clip(result, -UNSETTLED_LOG, UNSETTLED_LOG)


def deviance(theta: np.ndarray, data: SettlingCells, force: float = 1.0) -> float:
    """Sum of squares of the fitted ln(reproduced / printed), each over its standard deviation."""
    return float(np.sum((log_ratios(data, theta, force) / data.sigma)[:, IS_FITTED] ** 2))


def search_bounds(
    data: SettlingCells, seed: int, mapper: Mapper, population: int = 10, generations: int = 40
) -> Any:
    """Search the wide bounds, then polish; returns the optimum as SciPy does.

    It has theta as ``x``, its deviance as ``fun`` and the number of evaluations as ``nfev``.
    """
    optimum = differential_evolution(
        deviance,
        np.log(SEARCH_BOUNDS),
        args=(data,),
        popsize=population,
        maxiter=generations,
        tol=0.05,
        rng=seed,
        polish=False,
        updating="deferred",
        workers=mapper,  # pyright: ignore[reportArgumentType]  # a map is allowed, says its documentation
    )
    for size in (4 * NEAR, NEAR, NEAR / 4):
        evaluations = optimum.nfev
        optimum = nearby(lambda theta: deviance(theta, data), optimum.x, size)
        optimum.nfev += evaluations
    return optimum


def nearby(function: Callable[[np.ndarray], float], start: np.ndarray, size: float = NEAR) -> Any:
    """Minimum near `start` by Nelder and Mead's search, as SciPy returns it.

    `size` is that of the first simplex.
    """
    simplex = np.vstack([start, start + size * np.eye(len(start))])
    options = {"initial_simplex": simplex, "xatol": 2e-4, "fatol": 0.02, "maxfev": 25 * len(start)}
    return minimize(function, start, method="Nelder-Mead", options=options)


def mechanics_profiles(
    data: SettlingCells, best: Any, widen: float, mapper: Mapper
) -> tuple[np.ndarray, Any, int]:
    """Profile of each parameter from the optimum `best`: lowest deviance over the other parameters.

    A profile ends where the deviance exceeds the optimum's by `FOLLOWED` thresholds times `widen`, the factor
    from `widening`. Returns the profiles, shape (parameter, offset), NaN beyond their ends; the point of
    lowest deviance, as from `search_bounds`; and the number of evaluations.
    """
    stop_at = best.fun + FOLLOWED * THRESHOLD * widen

    def walk(task: tuple[int, int]) -> list[Any]:
        fixed, sign = task
        free = np.delete(best.x, fixed)
        steps = []
        for offset in sign * PROFILE_STEPS:
            at = best.x[fixed] + offset
            optimum = nearby(lambda rest, at=at: deviance(np.insert(rest, fixed, at), data), free)
            free, optimum.x = optimum.x, np.insert(optimum.x, fixed, at)
            steps.append(optimum)
            if optimum.fun > stop_at:
                break
        return steps

    tasks = [(fixed, sign) for fixed in range(len(MECHANICS)) for sign in (-1, 1)]
    result = np.full((len(MECHANICS), len(OFFSETS)), np.nan)
    result[:, len(PROFILE_STEPS)] = best.fun
    walks = list(mapper(walk, tasks))
    for (fixed, sign), steps in zip(tasks, walks, strict=True):
        at = len(PROFILE_STEPS) + sign * np.arange(1, len(steps) + 1)
        result[fixed, at] = [optimum.fun for optimum in steps]
    met = [optimum for steps in walks for optimum in steps]
    return result, min([best, *met], key=lambda optimum: optimum.fun), sum(optimum.nfev for optimum in met)


def mass_friction_region(
    data: SettlingCells, ln_M: np.ndarray, ln_ratio: np.ndarray, stops: tuple[float, float], mapper: Mapper
) -> tuple[np.ndarray, int]:
    """Lowest deviance over ln(stop), shape (ln_M, ln_ratio), and the number of evaluations.

    `ln_ratio` is ln(k_f / M); ln(stop) is searched between the two `stops`.
    """

    def row(M: float) -> tuple[list[float], int]:
        optima: list[Any] = [
            minimize_scalar(
                lambda stop, ratio=ratio: deviance(np.array([M, M + ratio, stop]), data),
                bounds=stops,
                method="bounded",
                options={"xatol": 1e-3, "maxiter": 8},
            )
            for ratio in ln_ratio
        ]
        return [optimum.fun for optimum in optima], sum(optimum.nfev for optimum in optima)

    rows = list(mapper(row, ln_M))
    return np.array([values for values, _ in rows]), sum(evaluations for _, evaluations in rows)


def correlation(ln_M: np.ndarray, ln_ratio: np.ndarray, deviances: np.ndarray) -> float:
    """Correlation of ln(M) and ln(k_f), with exp(-deviance / 2) as likelihood.

    `deviances` is from `mass_friction_region`, on the grid of `ln_M` and of `ln_ratio`, ln(k_f / M).
    """
    weights = np.exp(-(deviances - deviances.min()) / 2)
    x, ratio = np.meshgrid(ln_M, ln_ratio, indexing="ij")
    cov = np.cov(np.stack([x.ravel(), (x + ratio).ravel()]), aweights=weights.ravel())
    return float(cov[0, 1] / np.sqrt(cov[0, 0] * cov[1, 1]))


def identify_mechanics(
    data: SettlingCells, seed: int, mapper: Mapper, progress: Callable[[str], None], **effort: int
) -> xr.Dataset:
    """Estimate, profiles, region and misfit of one cylinder; `progress` gets a line after each stage.

    `seed` is that of the search's random numbers, `mapper` is ``map`` or that of a pool, and `effort` takes
    ``population`` and ``generations`` of `search_bounds`.
    """
    cylinder = data.experiments[0].cylinder
    best = search_bounds(data, seed, mapper, **effort)
    values = ", ".join(f"{n} = {v:.4g}" for n, v in zip(MECHANICS, np.exp(best.x), strict=True))
    progress(f"{cylinder}: searched the wide bounds, {best.nfev} evaluations: {values}")

    count, followed, searched = int(IS_FITTED.sum()) * len(data.experiments), 0, best.nfev
    while True:
        widen = widening(best.fun, count, len(MECHANICS))
        profiles, better, evaluations = mechanics_profiles(data, best, widen, mapper)
        followed += evaluations
        if better.fun > best.fun - IMPROVED * widen:
            break
        best = better
    lowest = np.nanmin(profiles)
    profiles = (profiles - lowest) / widen
    ends = [deviance_interval(x + OFFSETS, curve) for x, curve in zip(best.x, profiles, strict=True)]
    progress(f"{cylinder}: profiles, {followed} evaluations")

    # A region of two parameters reaches further than the interval of each.
    reach = 1.25 * np.sqrt(REGION_THRESHOLD / THRESHOLD)
    limits = np.clip(np.transpose(ends), best.x + OFFSETS[0], best.x + OFFSETS[-1])
    low, high = best.x + reach * (limits - best.x)
    ln_M = np.linspace(low[0], high[0], REGION)
    ln_ratio = best.x[1] - best.x[0] + RATIO_OFFSETS
    deviances, gridded = mass_friction_region(data, ln_M, ln_ratio, (low[2], high[2]), mapper)
    deviances = (deviances - lowest) / widen
    progress(f"{cylinder}: region of M and k_f, {gridded} evaluations")

    optima = list(mapper(lambda force: nearby(lambda theta: deviance(theta, data, force), best.x), FORCES))
    forces, pushed = np.array([each.fun for each in optima]), sum(each.nfev for each in optima)
    progress(f"{cylinder}: push force, {pushed} evaluations")

    ratios, names = log_ratios(data, best.x), [experiment.name for experiment in data.experiments]
    each = ("experiment", "quantity")
    return xr.Dataset(
        {
            "estimate": ("parameter", np.exp(best.x)),
            "low": ("parameter", np.exp([end[0] for end in ends])),
            "high": ("parameter", np.exp([end[1] for end in ends])),
            "profile_value": (("parameter", "offset"), np.exp(best.x[:, None] + OFFSETS)),
            "profile_deviance": (("parameter", "offset"), profiles),
            "region_M": ("M_point", np.exp(ln_M)),
            "region_ratio": ("ratio_point", np.exp(ln_ratio)),
            "region_deviance": (("M_point", "ratio_point"), deviances),
            "correlation": ((), correlation(ln_M, ln_ratio, deviances)),
            "force_deviance": ("force_ratio", (forces - lowest) / widen),
            "push_force": ((), data.experiments[0].push.force),
            "widening": ((), widen),
            "fitted_rms": ((), rms_of(ratios[:, IS_FITTED])),
            "scored_rms": ((), rms_of(ratios[:, ~IS_FITTED])),
            "evaluations": ((), searched + followed + gridded + pushed),
            "search_evaluations": ((), searched),
            "settling_printed": (each, data.printed),
            "settling_log_ratio": (each, ratios),
            "settling_sigma": (each, data.sigma),
        },
        coords={
            "parameter": list(MECHANICS),
            "parameter_unit": ("parameter", list(MECHANICS_UNITS)),
            "bound_low": ("parameter", SEARCH_BOUNDS[:, 0]),
            "bound_high": ("parameter", SEARCH_BOUNDS[:, 1]),
            "offset": OFFSETS,
            "force_ratio": FORCES,
            "experiment": names,
            "experiment_cylinder": ("experiment", [cylinder] * len(names)),
            "quantity": list(QUANTITIES),
            "fitted": ("quantity", IS_FITTED.astype(np.int8)),
        },
    )
