"""Statistics over experiments: eqs (14) to (16), Tables 7 to 9 and the percentiles of Figs 9 and 11."""

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
import xarray as xr

Labelled = TypeVar("Labelled", xr.Dataset, xr.DataArray)

OVERALL = "overall"  # Table 7's level: all experiments, each model at its best n in each


def concatenated(grid: xr.Dataset) -> xr.Dataset:
    """Statistics of the error vector that joins chambers A and B, by (experiment, model, n).

    From `pneumo.open_grid`, whose chambers have the same number of samples: `mean_error`, Pa, `mse` and
    `variance`, Pa^2; NaN where a chamber failed.
    """
    mean_error = grid["mean_error"].mean("chamber", skipna=False)
    mse = grid["mse"].mean("chamber", skipna=False)
    return xr.Dataset({"mean_error": mean_error, "mse": mse, "variance": mse - mean_error**2})


def rms_of(values: np.ndarray) -> float:
    """Root mean square of all values."""
    return float(np.sqrt(np.mean(np.square(values))))


def best_n(mse: xr.DataArray) -> xr.DataArray:
    """The n of the lowest mean square error, the lowest of equals (models without n); NaN if one failed."""
    return mse.fillna(np.inf).idxmin("n").where(mse.notnull().all("n"))


def at_n(cells: xr.Dataset, n: xr.DataArray) -> xr.Dataset:
    """Cells at the given n for each model (and experiment); NaN where n is NaN."""
    return cells.sel(n=n.fillna(cells["n"][0])).where(n.notnull()).drop_vars("n")


def over_experiments(cells: xr.Dataset, ddof: int = 1, percentiles: Any = "linear") -> xr.Dataset:
    """Average over experiments: eqs (14), (15) and (16) and the percentiles, by model.

    The variance of means in eq (16) is the sample variance (N - ddof); `percentiles` is the name that
    `numpy.percentile` has for their rule.
    """
    mean_error, mse = cells["mean_error"], cells["mse"]
    if not mse.sizes["experiment"]:
        nothing = xr.DataArray(np.nan, {"model": mse["model"]}, ["model"])
        return xr.Dataset(dict.fromkeys(("mean_error", "std", "mse", "p10", "p90"), nothing))
    alone = mean_error.sizes["experiment"] <= ddof
    spread = np.nan if alone else mean_error.var("experiment", ddof=ddof, skipna=False)
    tenths = mse.quantile([0.1, 0.9], "experiment", method=percentiles, skipna=False)
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
    """Concatenate the parts, one per level, along "level"."""
    concat: Any = xr.concat  # its overloads accept no type variable over datasets and arrays
    level = xr.Variable("level", list(parts))
    return concat(list(parts.values()), level, coords="minimal", compat="override", join="exact")


def statistics(
    grid: xr.Dataset, levels: Mapping[str, Sequence[str]], ddof: int = 1, percentiles: str = "linear"
) -> xr.Dataset:
    """Tables 7, 8 and 9 of a grid, from `pneumo.open_grid` and the experiments of each heat-transfer level.

    `best_n` by (experiment, model): Table 8. `mean_error`, `std`, `mse`, `p10`, `p90` by (level, model):
    level "overall" is Table 7, the others Table 9. `constant_n` by (level, model): the n that Table 9's rows
    use, NaN for "overall". `experiments` by level: number of experiments averaged (with none all is NaN, with
    one `std` is). An experiment in which every cell failed is left out and has a `failure_time`, s; a model
    that failed at some n in an experiment has no best n there, and its averages over that experiment are NaN.

    The variance of means in eq (16) is divided by N - ddof. ASSUME: 1, as Tables 7 and 9 say. `percentiles`
    is `Study.percentiles`.
    """
    ran = grid["mse"].notnull().any(("model", "n", "chamber"))
    failure_time = grid["failure_time"].max(("model", "n", "chamber")).where(~ran)
    grid = grid.drop_attrs()  # a percentile would keep the long name and unit of the mean square error
    cells = concatenated(grid)
    best = best_n(cells["mse"])
    cells = cells.sel(experiment=ran)
    tables = {OVERALL: over_experiments(at_n(cells, best.sel(experiment=ran)), ddof, percentiles)}
    constant = {OVERALL: xr.full_like(best.isel(experiment=0, drop=True), np.nan)}
    count = {OVERALL: cells.sizes["experiment"]}
    for level, names in levels.items():
        part = cells.sel(experiment=np.isin(cells["experiment"], names))
        count[level] = part.sizes["experiment"]
        if not count[level]:
            tables[level], constant[level] = xr.full_like(tables[OVERALL], np.nan), constant[OVERALL]
            continue
        constant[level] = best_n(part["mse"].mean("experiment", skipna=False))
        tables[level] = over_experiments(at_n(part, constant[level]), ddof, percentiles)
    result = along_levels(tables)
    result["constant_n"] = along_levels(constant)
    result["constant_n"].attrs = {"units": "1", "long_name": "n of the lowest mean square error of the level"}
    result["best_n"] = best
    attributes = {"units": "1", "long_name": "number of experiments that the level averages"}
    result["experiments"] = ("level", np.array(list(count.values()), dtype=np.int32), attributes)
    result["failure_time"] = failure_time
    return result
