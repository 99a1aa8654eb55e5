"""Error budget of the models on one cylinder: expected error, its interval, and the parts that make it.

A model and its n are chosen once, with the configured plant. The cylinder is drawn from the distribution of
what is not known (`pneumo.configuration.priors`); errors are root mean squares over both chambers and all
experiments. A part is what the mean square error loses when a group of quantities is known. It follows from
cylinders in which only that group is off, and from others in which only the rest is: their sum lacks the
products of both, whose mean is 0, so that few draws suffice. Parts of correlated quantities overlap.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from pneumo.physics.models import MODELS

FULL_ORDER = "full order"  # name of its row
NOTHING = "nothing"  # group of the draws in which everything is as configured
ROUNDING = 1.0  # Pa, of replays of the full order
TAILS = 0.025, 0.975  # of the interval
RECORD, NOISE = 10.0, 1e3  # s, of a record and of the new run; Pa, of its pressure sensors: ASSUME


class Row(NamedTuple):
    """A model at the n of its lowest error where everything is as configured; errors in Pa."""

    model: str
    n: float  #: NaN for a model without n
    rms: float  #: expected: root of the mean square error over all draws; infinite where a replay failed
    low: float  #: 95 % of the drawn cylinders have an error between low and high; covers a measured error too
    high: float
    own: float  #: with everything as configured: what the model itself contributes
    known: Mapping[str, float] = MappingProxyType({})  #: by group, expected error if it were known
    stroke: float = np.nan  #: expected over full strokes into rest; infinite where a replay failed

    def part(self, group: str) -> float:
        """Part of the error that a group of quantities causes, Pa."""
        return max(self.rms**2 - self.known[group] ** 2, 0.0) ** 0.5


class Budget(NamedTuple):
    """Error budget of all models, lowest expected error first."""

    rows: tuple[Row, ...]
    groups: tuple[str, ...]  #: that are not known, the one that causes most error first
    measured: Mapping[str, float] = MappingProxyType({})  #: by model, RMS error on data held out of a fit, Pa
    after_record: float = np.nan  #: expected error of a full order fitted to one record, Pa

    def row(self, model: str) -> Row:
        """Row of a model, by its name."""
        return next(row for row in self.rows if row.model == model)


def error_budget(cells: xr.Dataset, best: Mapping[str, float]) -> Budget | None:
    """Error budget from the cells of one cylinder (`cylinder_ranking.run_study`); None without draws.

    `best` is each model's n with the lowest error where everything is as configured.
    """
    if "mse_drawn" not in cells:
        return None
    over = ("experiment", "chamber")
    drawn: Any = cells["mse_drawn"].mean(over, skipna=False).to_pandas()

    def mean(name: str) -> xr.DataArray:
        return cells[name].mean((*over, "part_draw"), skipna=False)

    left: Any = None  # fraction of the mean square error that is left if a group is known
    if "mse_alone" in cells:
        others, alone = mean("mse_others"), mean("mse_alone")
        left = others / (others + (alone - alone.sel(group=NOTHING)).clip(min=0))
        left = left.dropna("group", how="all").to_pandas()  # a group that is known exactly has no cells
    measured = cells["measured"].isel(experiment=0).to_series().dropna().to_dict()
    rows: list[Row] = []
    for name in cells["row"].values.tolist():
        mse, model = drawn[name].to_numpy(), MODELS.get(name)
        if model is not None:
            of_model = cells["mse"].sel(model=name, n=best[name]).mean(skipna=False)
        elif "mse_alone" in cells:  # of the full order: only where the supply sags, which replays ignore
            of_model = mean("mse_alone").sel(group=NOTHING, row=name)
            of_model = of_model.where(of_model > ROUNDING**2, 0.0)
        else:
            of_model = 0.0
        n = best[name] if model and model.has_n else np.nan
        row = Row(name, n, np.inf, np.nan, np.nan, float(of_model) ** 0.5)
        if "mse_stroke" in cells:
            row = row._replace(stroke=_root(mean("mse_stroke").sel(row=name)))
        if np.isfinite(mse.mean()):
            low, high = np.quantile(mse, TAILS, method="weibull") ** 0.5  # holds a further draw with 95 %
            low, high = (
                float(end(limit, measured.get(name, limit))) for end, limit in ((min, low), (max, high))
            )
            known = {} if left is None else (mse.mean() * left[name]) ** 0.5
            row = row._replace(rms=_root(mse.mean()), low=low, high=high, known=dict(known))
        rows.append(row)
    rows.sort(key=lambda row: row.rms)
    groups: list[str] = [] if left is None else left.index.tolist()
    groups.sort(key=lambda group: rows[0].known.get(group, np.inf))
    after_record = cells["after_record"].values[0] if "after_record" in cells else np.nan
    return Budget(tuple(rows), tuple(groups), measured, float(after_record))


def _root(mse: float | xr.DataArray) -> float:
    return float(np.nan_to_num(mse, nan=np.inf)) ** 0.5
