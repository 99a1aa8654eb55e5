"""Pairs of models that are compared, and the criteria to compare by."""

from typing import NamedTuple

import xarray as xr

REFINED_MODELS = ("M5", "M6", "M7", "M8", "M9", "M10")  # with the temperature law of eq (6)


class ModelPair(NamedTuple):
    """Two models whose errors are compared: mostly, the first is the second with a refinement."""

    model: str
    other: str
    refinement: str  # what the first has and the second lacks

    @property
    def name(self) -> str:
        """Name of the ratio of their errors, such as M8/M7."""
        return f"{self.model}/{self.other}"

    def ratio(self, score: xr.DataArray) -> xr.DataArray:
        """Error (or other score, by model) of the first model divided by that of the second."""
        return score.sel(model=self.model, drop=True) / score.sel(model=self.other, drop=True)


REFINEMENT_STEPS = (  # each adds one thing
    ModelPair("M5", "M2", "temperature law, eq (6)"),
    ModelPair("M6", "M5", "mixing, without wall heat"),
    ModelPair("M8", "M7", "mixing, with wall heat"),
    ModelPair("M7", "M5", "wall heat, without mixing"),
    ModelPair("M8", "M6", "wall heat, with mixing"),
    ModelPair("M9", "M8", "wall area A_q(x)"),
    ModelPair("M10", "M9", "conductance with the root of PT"),
)
_SUMMARY_PAIRS = (
    *REFINEMENT_STEPS[1:3],
    ModelPair("M10", "M8", "wall area and conductance"),
    ModelPair("M6", "M7", "mixing in place of wall heat"),
)
MODEL_PAIRS = {pair.name: pair for pair in _SUMMARY_PAIRS}
REFINEMENT_PAIRS = tuple(MODEL_PAIRS)[:3]  # the first is the second, refined
