"""Worst-case ranking of the models for a wall conductance k_0 that is known within a factor only.

A model and its n are chosen once, with the assumed k_0; the cylinder's may be the lowest or the highest of
the range. Errors are root mean squares over both chambers, the experiments and the runs.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.physics.models import MODELS

FULL_ORDER = "full order"  # name of its row


class RobustModel(NamedTuple):
    """A model at the n of its lowest worst-case error, with its RMS errors over the range of k_0."""

    model: str
    n: float  # NaN for a model without n
    rms: tuple[float, float, float]  # Pa, where the cylinder's k_0 is the lowest, the assumed, the highest

    @property
    def worst(self) -> float:
        """Largest of the RMS errors over the range of k_0, Pa; infinite where a replay failed."""
        return max(self.rms) if np.isfinite(self.rms).all() else np.inf


class UnknownConductance(NamedTuple):
    """Worst-case ranking of the models for an uncertain k_0."""

    factor: float
    k_0: float  # W/K, as assumed; NaN where experiments differ
    models: tuple[RobustModel, ...]  # lowest worst case first
    # Pa, the largest over k_0 of the lowest RMS error at that k_0: the best model, n, and conductance of the
    # model (true or assumed) are chosen at each.
    known: float
    #: The full order with the assumed k_0, which is the truth at that k_0; None in cells of earlier code.
    full_order: RobustModel | None = None

    @property
    def rows(self) -> tuple[RobustModel, ...]:
        """Models and full order, lowest worst case first."""
        every = self.models if self.full_order is None else (*self.models, self.full_order)
        return tuple(sorted(every, key=lambda row: row.worst))

    def model(self, name: str) -> RobustModel:
        """Row of a reduced model, by its name."""
        return next(row for row in self.models if row.model == name)


def robust_choice(cells: xr.Dataset) -> UnknownConductance:
    """Rank the models by their worst case over the range of k_0, on one cylinder.

    `cells` is from `cylinder_ranking.run_study`, with the experiments of this cylinder only.
    """

    def at_three(name: str) -> xr.DataArray:
        mean = cells[["mse", name]].mean(("experiment", "run", "chamber"), skipna=False)
        low, high = (mean[name].sel(k_0_end=end, drop=True) for end in ("low", "high"))
        return xr.concat([low, mean["mse"], high], "k_0") ** 0.5

    unknown = at_three("mse_of_wrong_k_0")
    worst = unknown.max("k_0", skipna=False).fillna(np.inf)
    rows: list[RobustModel] = []
    for name, model in MODELS.items():
        place = int(worst.sel(model=name).argmin("n"))
        n = float(cells["n"][place]) if model.has_n else np.nan
        low, assumed, high = unknown.sel(model=name).isel(n=place).values.tolist()
        rows.append(RobustModel(name, n, (low, assumed, high)))
    either = xr.concat([unknown, at_three("mse_of_right_k_0")], "taken")
    known = float(either.min(("taken", "model", "n")).max("k_0", skipna=False))
    factor, k_0 = float(cells["k_0_factor"].max()), np.unique(cells["k_0"].values)
    assumed = float(k_0[0]) if len(k_0) == 1 else np.nan
    models = tuple(sorted(rows, key=lambda row: row.worst))
    return UnknownConductance(factor, assumed, models, known, _full_order(cells))


def _full_order(cells: xr.Dataset) -> RobustModel | None:
    if "mse_of_full_order" not in cells:
        return None
    mean = cells["mse_of_full_order"].mean(("experiment", "run", "chamber"), skipna=False)
    low, high = (float(mean.sel(k_0_end=end)) ** 0.5 for end in ("low", "high"))
    return RobustModel(FULL_ORDER, np.nan, (low, 0.0, high))
