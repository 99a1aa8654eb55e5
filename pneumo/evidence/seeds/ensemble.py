"""Statistics over seed sets: Tables 7 to 9 with their spread, and which model beats which, by three criteria.

Seed sets are independent repetitions of the whole study. Models are compared within each set, so that the
variation common to all models cancels.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
import xarray as xr
from scipy import stats

from pneumo.physics.symbols import SYMBOLS
from pneumo.statistics.averages import OVERALL, along_levels, concatenated, statistics
from pneumo.statistics.intervals import CONFIDENCE, student_quantile
from pneumo.statistics.model_pairs import CRITERIA, MODEL_PAIRS, pair_ratios

ENSEMBLE_LONG_NAMES = {
    "seed_sets": "number of seed sets",
    "failed_sets": "seed sets in which the full-order run, or a replay, failed",
    "constant_n": "n of the lowest mean square error of the level",
    "probability": "share of seed sets in which model has the lower score than other",
    "p_value": "of the sign test, after Holm's correction over all pairs of models",
    "resolved": "whether that is below 0.05",
    "ratio_value": "ratio of mean square errors, geometric mean over seed sets",
    "ratio_low": "lower end of its 95 per cent interval",
    "ratio_high": "upper end of its 95 per cent interval",
    "ratio_single_low": "lower end of where one more seed set falls in 95 per cent of cases",
    "ratio_single_high": "upper end of where one more seed set falls in 95 per cent of cases",
    "ratio_resolvable": "smallest ratio above 1 that one seed set tells from 1",
}
SPREAD_PARTS = ("mean", "std", "low", "high")  # over seed sets; low and high: interval of the mean


_log: Callable[[xr.DataArray], xr.DataArray] = partial(xr.apply_ufunc, np.log)
_exp: Callable[[xr.DataArray], xr.DataArray] = partial(xr.apply_ufunc, np.exp)


def spread_over_seeds(values: xr.DataArray) -> xr.DataArray:
    """Mean, standard deviation and Student's interval of the mean over seed sets, along `spread`."""
    count = values.sizes["seeds"]
    mean, std = values.mean("seeds", skipna=False), values.std("seeds", ddof=1, skipna=False)
    half = student_quantile(count - 1) * std / np.sqrt(count)
    return xr.concat([mean, std, mean - half, mean + half], xr.Variable("spread", list(SPREAD_PARTS)))


def tables_by_seeds(ensemble: xr.Dataset, levels: Mapping[str, Sequence[str]]) -> xr.Dataset:
    """Tables 7, 8 and 9 of every seed set by (seeds, transport, ...), as `statistics` names them."""
    by_seeds: list[xr.Dataset] = []
    for seeds in ensemble["seeds"].values:
        cells = [ensemble.sel(seeds=seeds, transport=name) for name in ensemble["transport"].values]
        by_seeds.append(xr.concat([statistics(grid, levels) for grid in cells], ensemble["transport"]))
    return xr.concat(by_seeds, ensemble["seeds"])


def scores_by_criterion(mse: xr.DataArray, levels: Mapping[str, Sequence[str]]) -> xr.DataArray:
    """Score of each model by each criterion, lower is better, by (criterion, level, ..., model).

    Scores are in Pa^2; those of the criterion "rank" are ranks from 1. `mse`, Pa^2, is of both chambers
    joined, by (..., experiment, model, n). At a level each model has the one n of the lowest mean (or
    geometric mean) square error; "overall" takes each experiment at its own best n, as Table 7 does.
    """
    lowest = mse.min("n", skipna=False)
    scores = {OVERALL: _scores(lowest, _exp(_log(lowest).mean("experiment")))}
    for level, names in levels.items():
        part = mse.sel(experiment=np.isin(mse["experiment"], names))
        mean = part.mean("experiment", skipna=False)
        at_best = part.isel(n=mean.fillna(np.inf).argmin("n")).where(mean.notnull().all("n"))
        geometric = _exp(_log(part).mean("experiment", skipna=False)).min("n", skipna=False)
        scores[level] = _scores(at_best, geometric)
    return along_levels(scores)


def _scores(mse: xr.DataArray, geometric: xr.DataArray) -> xr.DataArray:
    dims = [["model"]]
    rank: xr.DataArray = xr.apply_ufunc(
        lambda errors: stats.rankdata(errors, axis=-1), mse, input_core_dims=dims, output_core_dims=dims
    )
    mean, rank = (values.mean("experiment", skipna=False) for values in (mse, rank))
    parts: list[xr.DataArray] = [mean, geometric, rank]
    parts = [part.drop_vars("n", errors="ignore") for part in parts]
    return xr.concat(parts, xr.Variable("criterion", list(CRITERIA)))


def beats(score: xr.DataArray) -> xr.Dataset:
    """How often a model beats another over seed sets, and whether that can be chance.

    `score` is from `scores_by_criterion`, by (seeds, ..., model). Returns by (..., model, other):
    `probability`, the fraction of seed sets in which `model` has the lower score, a tie counting half;
    `p_value` of the two-sided sign test, ties left out, after Holm's correction over all pairs of models;
    `resolved`, 1 where the p-value is below 0.05.
    """
    other = score.rename(model="other")
    wins, losses = (score < other).sum("seeds"), (score > other).sum("seeds")
    probability = (wins + 0.5 * (score.sizes["seeds"] - wins - losses)) / score.sizes["seeds"]
    decided = wins + losses
    tail = xr.apply_ufunc(stats.binom.cdf, np.minimum(wins, losses), decided, 0.5)
    dims, raw = [["model", "other"]], np.minimum(2 * tail, 1.0)
    p_value = xr.apply_ufunc(holm, raw, input_core_dims=dims, output_core_dims=dims, vectorize=True)
    comparison = xr.Dataset({"probability": probability, "p_value": p_value})
    comparison["resolved"] = (p_value < 1 - CONFIDENCE).astype(np.int8)
    return comparison


def holm(p: np.ndarray) -> np.ndarray:
    """Holm's correction of a symmetric matrix of p-values, over the pairs above its diagonal."""
    rows, columns = np.triu_indices(len(p), 1)
    pairs = p[rows, columns]
    order = np.argsort(pairs, kind="stable")
    stepped = np.maximum.accumulate(pairs[order] * np.arange(len(pairs), 0, -1))
    result = np.ones_like(p)
    result[rows[order], columns[order]] = result[columns[order], rows[order]] = np.minimum(stepped, 1.0)
    return result


def ratio_intervals(score: xr.DataArray) -> xr.Dataset:
    """Ratios of mean square errors between the models of `MODEL_PAIRS`, over seed sets.

    `score` holds the errors, Pa^2, by (seeds, ..., model). Returns by (ratio, ...): `value`, the geometric
    mean over seed sets, with its interval `low` to `high`; `single_low` to `single_high`, between which one
    seed set falls in 95 per cent of cases; `resolvable`, the smallest ratio above 1 that one seed set can
    distinguish from 1.
    """
    logs = _log(pair_ratios(score, list(MODEL_PAIRS), "ratio"))
    count, spread = logs.sizes["seeds"], spread_over_seeds(logs)
    mean, std, low, high = (spread.sel(spread=part, drop=True) for part in SPREAD_PARTS)
    alone = std * student_quantile(count - 1)
    reach = alone * (1 + 1 / count) ** 0.5  # of one more seed set
    of_mean = {"value": mean, "low": low, "high": high}
    one_set = {"single_low": mean - reach, "single_high": mean + reach, "resolvable": alone}
    return xr.Dataset({name: _exp(values) for name, values in (of_mean | one_set).items()})


def ensemble_statistics(ensemble: xr.Dataset, levels: Mapping[str, Sequence[str]]) -> xr.Dataset:
    """All statistics over sets of seeds of an ensemble by (seeds, transport, experiment, model, n, chamber).

    The dimension transport is the signal sampling. Tables 7 to 9: ``table_mse``, ``table_mean_error``,
    ``table_std``, ``table_best_n``, ``table_constant_n``, each with its `spread_over_seeds`. Pairs of models:
    ``probability`` that a model has the lower error, its ``p_value``, and whether it is ``resolved``, by
    (criterion, transport, level, model, other). Intervals of ratios of errors: ``ratio_...`` by (ratio,
    criterion, transport, level), ``experiment_ratio_...`` by (ratio, transport, experiment). Counts:
    ``seed_sets``, and by experiment ``failed_sets``, in which a run or replay failed. A statistic that needs
    a failed cell is NaN.
    """
    mse = concatenated(ensemble)["mse"]
    tables, score = tables_by_seeds(ensemble, levels), scores_by_criterion(mse, levels)
    names = ("mse", "mean_error", "std", "best_n", "constant_n")
    result = xr.Dataset({f"table_{name}": spread_over_seeds(tables[name].astype(float)) for name in names})
    result = result.merge(beats(score), compat="no_conflicts")
    of_levels = ratio_intervals(score.sel(criterion=["mean", "geometric"])).rename(criterion="averaged")
    for prefix, ratios in (
        ("ratio_", of_levels),
        ("experiment_ratio_", ratio_intervals(mse.min("n", skipna=False))),
    ):
        ratios = ratios.rename({name: f"{prefix}{name}" for name in ratios.data_vars})
        result = result.merge(ratios, compat="no_conflicts")
    result["seed_sets"] = ((), np.int32(mse.sizes["seeds"]))
    failed = mse.isnull().any(("transport", "model", "n"))
    result["failed_sets"] = failed.sum("seeds").astype(np.int32)
    for name, variable in result.data_vars.items():
        quantity = str(name).removeprefix("table_")
        known = SYMBOLS.get(quantity)
        unit, long_name = (known.unit, known.long_name) if known else ("1", None)
        long_name = long_name or ENSEMBLE_LONG_NAMES[quantity.removeprefix("experiment_")]
        variable.attrs = {"units": unit, "long_name": long_name}
    return result.drop_vars(["n"], errors="ignore")
