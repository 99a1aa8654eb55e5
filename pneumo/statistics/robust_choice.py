"""Models judged by their worst case where the wall's conductance k_0 is known within a factor only.

A model and its n are chosen once, with the k_0 that is assumed; the cylinder's may be the lowest or the
highest of the range. Errors are root mean squares over both chambers, the experiments and the runs.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.physics.models import MODELS


class RobustModel(NamedTuple):
    """One model at the n whose worst case is least."""

    model: str
    n: float  # NaN where it plays no role
    rms: tuple[float, float, float]  # Pa, where the cylinder's k_0 is the lowest, the assumed, the highest

    @property
    def worst(self) -> float:
        """Largest of these errors, Pa; infinite where the model fails."""
        return max(self.rms) if np.isfinite(self.rms).all() else np.inf


class UnknownConductance(NamedTuple):
    """What is left to choose by where k_0 is known within a factor."""

    factor: float
    k_0: float  # W/K, as assumed; NaN where experiments differ
    models: tuple[RobustModel, ...]  # lowest worst case first
    # Pa, worst over k_0 of the least error at it: model, n, and whether the model takes the true k_0 or the
    # assumed one are chosen for each k_0.
    known: float

    def model(self, name: str) -> RobustModel:
        """Row of a model."""
        return next(row for row in self.models if row.model == name)


def robust_choice(cells: xr.Dataset) -> UnknownConductance:
    """Judge the models on the cells of one cylinder, from `pneumo.selection.cylinder_ranking.run_study`."""

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
    return UnknownConductance(factor, assumed, tuple(sorted(rows, key=lambda row: row.worst)), known)
