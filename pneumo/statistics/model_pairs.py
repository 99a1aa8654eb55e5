"""Models that are compared in pairs, a refinement over the model without it, and criteria to compare by."""

from collections.abc import Sequence

import xarray as xr

REFINED_MODELS = ("M5", "M6", "M7", "M8", "M9", "M10")  # with the temperature law of eq (6)
MODEL_PAIRS = {name: tuple(name.split("/")) for name in ("M6/M5", "M8/M7", "M10/M8", "M6/M7")}
REFINEMENT_PAIRS = ("M6/M5", "M8/M7", "M10/M8")  # the first is the second, refined
CRITERIA = {
    "mean": "mean square error, averaged over experiments",
    "geometric": "geometric mean over experiments of the mean square error",
    "rank": "rank among the ten models, averaged over experiments",
}


def pair_ratios(score: xr.DataArray, pairs: Sequence[str], dimension: str) -> xr.DataArray:
    """Ratios of the models' scores along a new dimension of pairs, keys of `MODEL_PAIRS`."""
    ratios: list[xr.DataArray] = []
    for name in pairs:
        one, other = MODEL_PAIRS[name]
        ratios.append(score.sel(model=one, drop=True) / score.sel(model=other, drop=True))
    return xr.concat(ratios, xr.Variable(dimension, list(pairs)))
