"""Worst-case ranking of the models for a cylinder that is not known exactly.

A model and its n are chosen once, with the configured plant. Cases are the assumed k_0 and both ends of its
range and, where the accuracy of valve or dead volumes is given, every combination of the ends of all three
ranges. Errors are root mean squares over both chambers, the experiments and the runs.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.physics.models import MODELS

FULL_ORDER = "full order"  # name of its row
OVER = ("experiment", "run", "chamber")  # dimensions over which errors are averaged


class RobustModel(NamedTuple):
    """A model at the n of its lowest worst-case error, with its RMS errors over the ranges."""

    model: str
    n: float  # NaN for a model without n
    rms: tuple[float, float, float]  # Pa, where the cylinder's k_0 is the lowest, the assumed, the highest
    # Pa, where k_0, valve and dead volumes are each at an end of their range, in every combination
    off_plant: tuple[float, ...] = ()

    @property
    def every(self) -> tuple[float, ...]:
        """RMS errors of all cases, Pa."""
        return self.rms + self.off_plant

    @property
    def worst(self) -> float:
        """Largest of the RMS errors, Pa; infinite where a replay failed."""
        return max(self.every) if np.isfinite(self.every).all() else np.inf


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
    valve: float = 0.0  # largest relative error of the valve's flow; 0: known exactly
    dead_volumes: float = 0.0  # the same of the dead volumes

    @property
    def rows(self) -> tuple[RobustModel, ...]:
        """Models and full order, lowest worst case first."""
        every = self.models if self.full_order is None else (*self.models, self.full_order)
        return tuple(sorted(every, key=lambda row: row.worst))

    def model(self, name: str) -> RobustModel:
        """Row of a reduced model, by its name."""
        return next(row for row in self.models if row.model == name)


def robust_choice(cells: xr.Dataset) -> UnknownConductance:
    """Rank the models by their worst case over the range of k_0, valve and dead volumes, on one cylinder.

    `cells` is from `cylinder_ranking.run_study`, with the experiments of this cylinder only.
    """

    def at_three(name: str) -> xr.DataArray:
        mean = cells[["mse", name]].mean(OVER, skipna=False)
        low, high = (mean[name].sel(k_0_end=end, drop=True) for end in ("low", "high"))
        return xr.concat([low, mean["mse"], high], "k_0") ** 0.5

    unknown = at_three("mse_of_wrong_k_0")
    valve, dead_volumes = (
        float(cells[name].max()) if name in cells else 0.0 for name in ("valve_within", "dead_volumes_within")
    )
    cases, off_plant = unknown, valve or dead_volumes
    if off_plant:
        off = cells["mse_of_off_plant"].mean(OVER, skipna=False) ** 0.5
        cases = xr.concat([unknown, off.drop_vars("off_plant").rename(off_plant="k_0")], "k_0")
    worst = cases.max("k_0", skipna=False).fillna(np.inf)
    rows: list[RobustModel] = []
    for name, model in MODELS.items():
        place = int(worst.sel(model=name).argmin("n"))
        n = float(cells["n"][place]) if model.has_n else np.nan
        low, assumed, high, *others = cases.sel(model=name).isel(n=place).values.tolist()
        rows.append(RobustModel(name, n, (low, assumed, high), tuple(others)))
    either = xr.concat([unknown, at_three("mse_of_right_k_0")], "taken")
    known = float(either.min(("taken", "model", "n")).max("k_0", skipna=False))
    factor, k_0 = float(cells["k_0_factor"].max()), np.unique(cells["k_0"].values)
    assumed = float(k_0[0]) if len(k_0) == 1 else np.nan
    models = tuple(sorted(rows, key=lambda row: row.worst))
    full_order = _full_order(cells, bool(off_plant))
    return UnknownConductance(
        factor=factor,
        k_0=assumed,
        models=models,
        known=known,
        full_order=full_order,
        valve=valve,
        dead_volumes=dead_volumes,
    )


def _full_order(cells: xr.Dataset, off_plant: bool) -> RobustModel | None:
    if "mse_of_full_order" not in cells:
        return None
    mean = cells["mse_of_full_order"].mean(OVER, skipna=False)
    low, high = (float(mean.sel(k_0_end=end)) ** 0.5 for end in ("low", "high"))
    others: list[float] = []
    if off_plant:
        others = (cells["mse_of_full_order_off_plant"].mean(OVER, skipna=False) ** 0.5).values.tolist()
    return RobustModel(FULL_ORDER, np.nan, (low, 0.0, high), tuple(others))
