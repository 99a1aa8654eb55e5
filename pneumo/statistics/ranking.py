"""The models ranked over repeated runs of a study.

The criterion is the mean square error, averaged over both chambers, the experiments and the runs, of each
model at the one n of its lowest error. Intervals are over runs with different seeds; two models are
compared run by run, by the logarithm of the ratio of their errors.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.physics.models import MODELS, Model
from pneumo.statistics.averages import best_n
from pneumo.statistics.error_budget import Budget, error_budget
from pneumo.statistics.intervals import Interval, paired_ratio, student_interval

MATERIAL = 0.10  # a mean square error at most this fraction above the lowest is as good in practice


class RankedModel(NamedTuple):
    """Place and errors of one model in a ranking by mean square error."""

    place: int  # from 1; models that failed come last
    model: str
    n: float  # best constant n; NaN for a model without n, or where every n failed
    mse: Interval  # mean square error, Pa^2
    rms: tuple[float, float]  # root mean square error of chambers A and B, Pa
    over_best: Interval  # its mean square error over the best model's: geometric mean over paired runs
    failed: int  # runs of an experiment in which it has no error at its n


class Ranking(NamedTuple):
    """Ranking of the models for one cylinder."""

    cylinder: str
    experiments: tuple[str, ...]
    runs: int  # per experiment, that succeeded
    left_out: tuple[str, ...]  # full-order runs that failed
    rows: tuple[RankedModel, ...] = ()  # best first; empty if no full-order run succeeded
    budget: Budget | None = None  # None if no cylinder was drawn
    by_experiment: Mapping[str, Mapping[str, float]] = {}  # RMS error, Pa, of each model at its n

    def row(self, model: str) -> RankedModel:
        """Row of the ranking for a model, by its name."""
        return next(row for row in self.rows if row.model == model)


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

    mse = cells["mse"].mean("chamber", skipna=False)
    n = best_n(mse.mean(("experiment", "run"), skipna=False))
    cell_n = {name: float(n.sel(model=name).fillna(mse["n"][0])) for name in MODELS}  # any, where all failed
    at_best = {name: mse.sel(model=name, n=cell_n[name]) for name in MODELS}  # (experiment, run) each
    by_run = {name: value.mean("experiment", skipna=False).values for name, value in at_best.items()}
    rows = _rows(cells, cell_n, at_best, by_run)
    by_experiment = {
        name: {model: float(value.sel(experiment=name).mean() ** 0.5) for model, value in at_best.items()}
        for name in names
    }
    return Ranking(
        cylinder=cylinder,
        experiments=names,
        runs=runs,
        left_out=failed_runs,
        rows=rows,
        budget=error_budget(cells, cell_n),
        by_experiment=by_experiment,
    )


def _failed_runs(cells: xr.Dataset) -> tuple[str, ...]:
    """A line of text for each full-order run that failed: experiment, seed, reason and time."""
    failures: list[str] = []
    meanings = cells["run_status"].attrs["flag_meanings"].split()
    for i, j in np.argwhere(cells["run_status"].transpose("experiment", "run").values):
        run = cells[["run_status", "run_failure_time", "seed"]].isel(experiment=i, run=j)
        reason, at = meanings[int(run["run_status"])].replace("_", " "), float(run["run_failure_time"])
        failures.append(f"{run['experiment'].item()}, seed {int(run['seed'])}: {reason} at {at:g} s")
    return tuple(failures)


def _places(values: Mapping[str, float]) -> dict[str, int]:
    """Rank of each name by its value: 1 is the lowest; NaN comes last."""
    order = sorted(values, key=lambda name: (not np.isfinite(values[name]), values[name]))
    return {name: place for place, name in enumerate(order, start=1)}


def _rows(
    cells: xr.Dataset,
    cell_n: Mapping[str, float],
    at_best: Mapping[str, xr.DataArray],
    by_run: Mapping[str, np.ndarray],
) -> tuple[RankedModel, ...]:
    """Rows of the ranking, best first.

    By model: `cell_n` is the n to use, `at_best` the mean square error there by (experiment, run), Pa^2, and
    `by_run` its mean over experiments.
    """
    place = _places({name: float(np.mean(value)) for name, value in by_run.items()})
    best = min(place, key=lambda name: place[name])
    rows: list[RankedModel] = []
    for name, model in MODELS.items():
        of_model = cells["mse"].sel(model=name, n=cell_n[name])
        A, B = of_model.mean(("experiment", "run"), skipna=False).values ** 0.5
        error, over_best = student_interval(by_run[name]), paired_ratio(by_run[name], by_run[best])
        n = cell_n[name] if model.has_n and np.isfinite(error.value) else np.nan
        failed = int(np.isnan(at_best[name].values).sum())
        rms = float(A), float(B)
        rows.append(
            RankedModel(
                place=place[name],
                model=name,
                n=n,
                mse=error,
                rms=rms,
                over_best=over_best,
                failed=failed,
            )
        )
    return tuple(sorted(rows, key=lambda row: row.place))
