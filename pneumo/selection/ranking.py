"""The models ranked over repeated runs of a study.

The criterion is the mean square error, averaged over both chambers, the experiments and the runs, of each
model at the one n of its lowest error. Intervals are over runs with different seeds; two models are
compared run by run, by the logarithm of the ratio of their errors.
"""

from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from pneumo.physics.models import MODELS, Model
from pneumo.selection.error_budget import Budget, error_budget
from pneumo.statistics.best_n import best_n
from pneumo.statistics.intervals import student_interval

MATERIAL = 0.10  # a mean square error at most this fraction above the lowest is as good in practice


class Ranking(NamedTuple):
    """Ranking of the models for one cylinder.

    By model, best first, the table has `place` from 1, the `best_n` (NaN for a model without n), `best_mse`
    (Pa^2) there, `over_best`, its geometric mean over that of the best model on paired runs, both with the
    ends `_low` and `_high` of 95 % intervals, `rms_A` and `rms_B` (Pa) by chamber, and `failed`, in how many
    runs of an experiment it has no error. `by_experiment` has RMS errors, Pa, with a column for each model.
    """

    cylinder: str
    experiments: tuple[str, ...]
    runs: int  # per experiment, that succeeded
    left_out: tuple[str, ...]  # full-order runs that failed
    table: pd.DataFrame = pd.DataFrame()  # empty if no full-order run succeeded
    by_experiment: pd.DataFrame = pd.DataFrame()
    budget: Budget | None = None  # None if no cylinder was drawn


def cost(model: Model) -> tuple[int, int, int, int]:
    """Sort key that puts simpler models first: by polytropic temperature, then wall heat, n and mixing."""
    wall = ("none", "k_0", "lambda_0 A_q", "lambda A_q").index(model.wall)
    return int(model.temperature == "polytropic"), wall, int(model.has_n), int(model.mixing)


def rank_models(cells: xr.Dataset, cylinder: str) -> Ranking:
    """Rank the models by mean square error on one cylinder; `cells` is from `cylinder_ranking.run_study`."""
    cells = cells.sel(experiment=cells["cylinder"] == cylinder)
    failed_runs = _failed_runs(cells)
    if not cells["random"].any():
        cells = cells.isel(run=[0])  # without random numbers, the other runs repeat it
    cells = cells.sel(run=(cells["run_status"] == 0).all("experiment"))
    names, runs = tuple(cells["experiment"].values.tolist()), cells.sizes["run"]
    if not runs:
        return Ranking(cylinder, names, 0, failed_runs)
    mse = cells["mse"].transpose("model", "experiment", "run", "n", "chamber")
    n = best_n(mse.mean(("experiment", "run", "chamber"), skipna=False)).fillna(mse["n"][0])
    at_n = mse.sel(n=n).drop_vars("n")  # any n, where all failed
    by_run = at_n.mean(("experiment", "chamber"), skipna=False).values
    error = student_interval(by_run)
    order = np.argsort(error[0], kind="stable")  # NaN comes last
    over = np.exp(student_interval(np.log(by_run / by_run[order[0]])))
    A, B = at_n.mean(("experiment", "run"), skipna=False).values.T ** 0.5
    has_n = np.array([model.has_n for model in MODELS.values()])
    ends = ("", "_low", "_high")
    columns = {
        "place": np.argsort(order) + 1,
        "best_n": np.where(has_n & np.isfinite(error[0]), n, np.nan),
        **{f"best_mse{end}": values for end, values in zip(ends, error, strict=True)},
        **{f"over_best{end}": values for end, values in zip(ends, over, strict=True)},
        **{"rms_A": A, "rms_B": B},
        "failed": at_n.isnull().any("chamber").sum(("experiment", "run")).values,
    }
    table = pd.DataFrame(columns, index=pd.Index(MODELS, name="model")).iloc[order]
    by_experiment: Any = at_n.mean(("run", "chamber")).transpose("experiment", "model").to_pandas() ** 0.5
    budget = error_budget(cells, n.to_series().to_dict())
    return Ranking(cylinder, names, runs, failed_runs, table, by_experiment, budget)


def _failed_runs(cells: xr.Dataset) -> tuple[str, ...]:
    """A line of text for each full-order run that failed: experiment, seed, reason and time."""
    failures: list[str] = []
    meanings = cells["run_status"].attrs["flag_meanings"].split()
    for i, j in np.argwhere(cells["run_status"].transpose("experiment", "run").values):
        run = cells[["run_status", "run_failure_time", "seed"]].isel(experiment=i, run=j)
        reason, at = meanings[int(run["run_status"])].replace("_", " "), float(run["run_failure_time"])
        failures.append(f"{run['experiment'].item()}, seed {int(run['seed'])}: {reason} at {at:g} s")
    return tuple(failures)
