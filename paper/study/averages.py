"""Statistics over experiments: eqs (14) to (16), Tables 7 to 9 and the percentiles of Figs 9 and 11."""

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from pneumo.statistics.best_n import best_n

Labelled = TypeVar("Labelled", xr.Dataset, xr.DataArray)

OVERALL = "overall"  # Table 7's level: all experiments, each model at its best n in each


def concatenated(grid: xr.Dataset) -> xr.Dataset:
    """Errors over both chambers together, by (experiment, model, n), from those of each chamber.

    `grid` is from `pneumo.open_grid`. Returns `mean_error`, Pa, `mse`, Pa^2, and `variance`, Pa^2, of the
    errors of chambers A and B put one after the other; NaN where the replay of a chamber failed.
    """
    mean_error = grid["mean_error"].mean("chamber", skipna=False)
    mse = grid["mse"].mean("chamber", skipna=False)
    return xr.Dataset({"mean_error": mean_error, "mse": mse, "variance": mse - mean_error**2})


def at_n(cells: xr.Dataset, n: xr.DataArray) -> xr.Dataset:
    """Errors of each model (and experiment) at the n given for it; NaN where that n is NaN."""
    return cells.sel(n=n.fillna(cells["n"][0])).where(n.notnull()).drop_vars("n")


def over_experiments(cells: xr.Dataset, ddof: int = 1, percentile_rule: Any = "linear") -> xr.Dataset:
    """Averages over experiments by model: eqs (14), (15) and (16), and 10th and 90th percentiles of the MSE.

    The variance of means in eq (16) is divided by N - ddof; `percentile_rule` is a method of
    `numpy.percentile`.
    """
    mean_error, mse = cells["mean_error"], cells["mse"]
    if not mse.sizes["experiment"]:
        nothing = xr.DataArray(np.nan, {"model": mse["model"]}, ["model"])
        return xr.Dataset(dict.fromkeys(("mean_error", "std", "mse", "p10", "p90"), nothing))
    alone = mean_error.sizes["experiment"] <= ddof
    spread = np.nan if alone else mean_error.var("experiment", ddof=ddof, skipna=False)
    tenths = mse.quantile([0.1, 0.9], "experiment", method=percentile_rule, skipna=False)
    return xr.Dataset(
        {
            "mean_error": mean_error.mean("experiment", skipna=False),  # (15)
            "std": (cells["variance"].mean("experiment", skipna=False) + spread) ** 0.5,  # (16)
            "mse": mse.mean("experiment", skipna=False),  # (14)
            "p10": tenths.isel(quantile=0, drop=True),
            "p90": tenths.isel(quantile=1, drop=True),
        }
    )


def along_levels(parts: Mapping[str, Labelled]) -> Labelled:
    """Concatenate datasets or arrays, one for each heat-transfer level, along the new dimension "level"."""
    concat: Any = xr.concat  # its overloads accept no type variable over datasets and arrays
    level = xr.Variable("level", list(parts))
    return concat(list(parts.values()), level, coords="minimal", compat="override", join="exact")


def statistics(
    grid: xr.Dataset, levels: Mapping[str, Sequence[str]], ddof: int = 1, percentile_rule: str = "linear"
) -> xr.Dataset:
    """Tables 7, 8 and 9, from `pneumo.open_grid` and the names of the experiments of each level of wall heat.

    The dataset has `best_n` by (experiment, model): Table 8. By (level, model) it has `mean_error`, Pa,
    `std`, Pa, and `mse` and its 10th and 90th percentiles `p10` and `p90`, Pa^2: level "overall" is Table 7,
    the others are Table 9. `constant_n` by (level, model) is the n that Table 9's rows use, NaN for
    "overall". `experiments` by level is the number of experiments averaged: without any, all is NaN; with
    one, `std` is. An experiment in which every replay failed is left out and has a `failure_time`, s. A model
    that failed at some n in an experiment has no best n there, and its averages over that experiment are NaN.

    The variance of means in eq (16) is divided by N - ddof. ASSUME: 1, as Tables 7 and 9 say.
    `percentile_rule` is that of the `Study`.
    """
    ran = grid["mse"].notnull().any(("model", "n", "chamber"))
    failure_time = grid["failure_time"].max(("model", "n", "chamber")).where(~ran)
    grid = grid.drop_attrs()  # a percentile would keep the long name and unit of the mean square error
    cells = concatenated(grid)
    best = best_n(cells["mse"])
    cells = cells.sel(experiment=ran)
    tables = {OVERALL: over_experiments(at_n(cells, best.sel(experiment=ran)), ddof, percentile_rule)}
    constant = {OVERALL: xr.full_like(best.isel(experiment=0, drop=True), np.nan)}
    count = {OVERALL: cells.sizes["experiment"]}
    for level, names in levels.items():
        part = cells.sel(experiment=np.isin(cells["experiment"], names))
        count[level] = part.sizes["experiment"]
        if not count[level]:
            tables[level], constant[level] = xr.full_like(tables[OVERALL], np.nan), constant[OVERALL]
            continue
        constant[level] = best_n(part["mse"].mean("experiment", skipna=False))
        tables[level] = over_experiments(at_n(part, constant[level]), ddof, percentile_rule)
    result = along_levels(tables)
    result["constant_n"] = along_levels(constant)
    result["constant_n"].attrs = {"units": "1", "long_name": "n of the lowest mean square error of the level"}
    result["best_n"] = best
    attributes = {"units": "1", "long_name": "number of experiments that the level averages"}
    result["experiments"] = ("level", np.array(list(count.values()), dtype=np.int32), attributes)
    result["failure_time"] = failure_time
    return result
