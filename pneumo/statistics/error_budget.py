"""Error budget of the models on one cylinder: expected error, its interval, and the parts that make it.

A model and its n are chosen once, with the configured plant. The cylinder is drawn from the distribution of
what is not known (`pneumo.configuration.uncertain`); errors are root mean squares over both chambers and all
experiments. A part is what the mean square error loses when a group of quantities is known. It follows from
cylinders in which only that group is off, and from others in which only the rest is: their sum lacks the
products of both, whose mean is 0, so that few draws suffice. Parts of correlated quantities overlap.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.physics.models import MODELS

FULL_ORDER = "full order"  # name of its row
NOTHING = "nothing"  # group of the draws in which everything is as configured
TAILS = 0.025, 0.975  # of the interval


class Row(NamedTuple):
    """A model at the n of its lowest error where everything is as configured; errors in Pa."""

    model: str
    n: float  #: NaN for a model without n
    rms: float  #: expected: root of the mean square error over all draws; infinite where a replay failed
    low: float  #: 95 % of the drawn cylinders have an error between low and high
    high: float
    own: float  #: with everything as configured: what the model itself contributes
    known: Mapping[str, float] = MappingProxyType({})  #: by group, expected error if it were known
    mse: np.ndarray = np.empty(0)  #: by draw, Pa^2

    def part(self, group: str) -> float:
        """Part of the error that a group of quantities causes, Pa."""
        return max(self.rms**2 - self.known[group] ** 2, 0.0) ** 0.5


class Budget(NamedTuple):
    """Error budget of all models, lowest expected error first."""

    rows: tuple[Row, ...]
    groups: tuple[str, ...]  #: that are not known, the one whose measurement helps most first
    measured: Mapping[str, float] = MappingProxyType({})  #: by model, RMS error on data held out of a fit, Pa

    def row(self, model: str) -> Row:
        """Row of a model, by its name."""
        return next(row for row in self.rows if row.model == model)

    def lowest_if_known(self, group: str) -> float:
        """Lowest expected error of all models if a group of quantities were known, Pa."""
        return min((row.known[group] for row in self.rows if row.known), default=np.inf)


def error_budget(cells: xr.Dataset, best: Mapping[str, float]) -> Budget | None:
    """Error budget from the cells of one cylinder (`cylinder_ranking.run_study`); None without draws.

    `best` is each model's n with the lowest error where everything is as configured.
    """
    if "mse_drawn" not in cells:
        return None
    over = ("experiment", "chamber")
    drawn = cells["mse_drawn"].mean(over, skipna=False)
    configured = cells["mse"].mean((*over, "run"), skipna=False)
    parts = None
    if "mse_alone" in cells:
        parts = cells[["mse_alone", "mse_others"]].mean((*over, "part_draw"), skipna=False)
        least = parts["mse_alone"].sel(group=NOTHING)
        others = parts["mse_others"]
        parts = others / (others + (parts["mse_alone"] - least).clip(min=0))
        parts = parts.dropna("group", how="all")  # a group that is known exactly has no cells
    rows = [_row(FULL_ORDER, np.nan, 0.0, drawn, parts)]
    for name, model in MODELS.items():
        own = float(configured.sel(model=name, n=best[name])) ** 0.5
        rows.append(_row(name, best[name] if model.has_n else np.nan, own, drawn, parts))
    rows.sort(key=lambda row: row.rms)
    on_record = zip(cells["row"].values.tolist(), cells["measured"][0].values.tolist(), strict=True)
    measured = {name: error for name, error in on_record if np.isfinite(error)}
    budget = Budget(tuple(rows), (), measured)
    groups: list[str] = [] if parts is None else parts["group"].values.tolist()
    return budget._replace(groups=tuple(sorted(groups, key=budget.lowest_if_known)))


def _row(name: str, n: float, own: float, drawn: xr.DataArray, left: xr.DataArray | None) -> Row:
    mse = drawn.sel(row=name).values
    mean = float(mse.mean())
    if not np.isfinite(mean):
        return Row(name, n, np.inf, np.nan, np.nan, own, mse=mse)
    low, high = np.quantile(mse, TAILS, method="weibull") ** 0.5  # holds a further draw with 95 %
    groups: dict[str, float] = {}
    if left is not None:  # fraction of the mean square error that is left
        of_row = left.sel(row=name)
        groups = dict(
            zip(left["group"].values.tolist(), ((mean * of_row.values) ** 0.5).tolist(), strict=True)
        )
    return Row(name, n, mean**0.5, float(low), float(high), own, groups, mse)
