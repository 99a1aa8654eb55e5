"""Ratios of errors: the full order over reduced models, and k_0 as a state over k_0 fixed.

The criterion is that of paper/decisions/0076: intervals over plants, with and without those in `NEW`.
"""

import numpy as np
import xarray as xr

from pneumo.equations.system import FULL_ORDER
from pneumo.evidence.at_work.partly_known import ROWS, Row
from pneumo.statistics.intervals import student_interval
from pneumo.storage.layout import described

NEW = ("stick-slip", "sagging-supply")  # plants that were not in decision 49
REDUCED = ("M6", "M7", "M8", "M10")
PAYS = 0.95  # upper end of a ratio, for an answer
BOUNDS = ("value", "low", "high", "median")
PARTS = ("all", "without new")
# Against the best reduced model of the same k_0: the full order, and whatever has k_0 as a state.
COMPARED = [row for row in ROWS if row.model == FULL_ORDER or row.estimates_k_0]
STATES = [row for row in ROWS if row.estimates_k_0]


def _ratio(logarithms: np.ndarray) -> np.ndarray:
    """Geometric mean over plants with its interval, and the median, from logarithms: shape (bound,)."""
    known = logarithms[np.isfinite(logarithms)]
    return np.exp([*student_interval(known), np.median(known)])


def _of_equal_knowledge(row: Row) -> list[int]:
    """Places in `ROWS` of the reduced models with the same fixed k_0 as a row, and of M6, which has none."""
    return [
        i
        for i, other in enumerate(ROWS)
        if other.model in REDUCED
        and not other.estimates_k_0
        and (other.model == "M6" or other.k_0_factor == row.k_0_factor)
    ]


def _compared(errors: xr.DataArray) -> dict[str, tuple[tuple[str, ...], np.ndarray]]:
    """Dimensions and values of `over_reduced`, `best_reduced` and `over_fixed`, from errors of one use.

    `partly_known_statistics` describes them; plant, row and seed are no longer among the dimensions.
    """
    every: xr.DataArray = xr.apply_ufunc(np.log, errors)
    logs = every.mean("seed").transpose(..., "row", "plant")
    outer = tuple(map(str, logs.dims[:-2]))
    new = np.isin(errors["plant"].values, NEW)
    shape = logs.shape[:-2]
    over_reduced = np.empty((*shape, len(COMPARED), len(PARTS), len(BOUNDS)))
    best = np.empty((*shape, len(COMPARED)), dtype=np.int8)
    over_fixed = np.empty((*shape, len(STATES), len(PARTS), len(BOUNDS)))
    for at in np.ndindex(shape):
        of_case = logs.values[at]
        for c, row in enumerate(COMPARED):
            others = _of_equal_knowledge(row)
            chosen = others[int(np.nanmean(of_case[others], axis=1).argmin())]
            best[*at, c] = chosen
            ratios = of_case[ROWS.index(row)] - of_case[chosen]
            over_reduced[*at, c] = [_ratio(ratios), _ratio(ratios[~new])]
        for c, row in enumerate(STATES):
            ratios = of_case[ROWS.index(row)] - of_case[ROWS.index(row._replace(estimates_k_0=False))]
            over_fixed[*at, c] = [_ratio(ratios), _ratio(ratios[~new])]
    return {
        "over_reduced": ((*outer, "compared", "part", "bound"), over_reduced),
        "best_reduced": ((*outer, "compared"), best),
        "over_fixed": ((*outer, "state", "part", "bound"), over_fixed),
    }


def partly_known_statistics(cells: xr.Dataset) -> xr.Dataset:
    """Ratios of errors at each scale of wrong parameters, from the cells of all plants joined along `plant`.

    With the prefix `observer_` or `controller_`: `over_reduced`, the error of each of `COMPARED` over that of
    the best reduced model with the same k_0; `best_reduced`, the place of that model in `row`; `over_fixed`,
    the error of a row with k_0 as a state over that of the same row with k_0 fixed. Ratios are geometric
    means over plants with 95 % intervals over plants, and medians, by (..., part, bound).
    `mean_estimation_error`, Pa, and `mean_tracking_error`, m, are geometric means over seeds and plants.
    """
    variables: dict[str, tuple[tuple[str, ...], np.ndarray]] = {}
    for use, name in (("observer", "estimation_error"), ("controller", "tracking_error")):
        variables |= {f"{use}_{quantity}": value for quantity, value in _compared(cells[name]).items()}
    for name in ("estimation_error", "tracking_error"):
        logs: xr.DataArray = xr.apply_ufunc(np.log, cells[name])
        mean = logs.mean(("seed", "plant"))
        variables[f"mean_{name}"] = (tuple(map(str, mean.dims)), np.exp(mean.values))
    coords = {"compared": [row.name for row in COMPARED], "state": [row.name for row in STATES]}
    coords |= {"part": list(PARTS), "bound": list(BOUNDS)}
    about = {
        "over_reduced": ("1", "error over that of the best reduced model with the same k_0"),
        "best_reduced": ("1", "place of that model"),
        "over_fixed": ("1", "error with k_0 as a state over that with k_0 fixed"),
    }
    words = {f"{use}_{name}": text for use in ("observer", "controller") for name, text in about.items()}
    words["mean_estimation_error"] = ("Pa", "geometric mean over seeds and plants")
    words["mean_tracking_error"] = ("m", "geometric mean over seeds and plants")
    return described(xr.Dataset(variables, coords), words)


def pays(ratios: xr.DataArray) -> xr.DataArray:
    """Whether each row pays: the upper end of its ratio over all plants is below `PAYS`."""
    return ratios.sel(bound="high", part="all", drop=True) < PAYS
