"""pneumo: reduced-order thermodynamic models of servo-pneumatic actuator chambers, reproduced and judged."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pneumo.engineer.linear_model import linearise
    from pneumo.engineer.model_rate import chamber_rate
    from pneumo.engineer.plants import plant
    from pneumo.engineer.runs import recorded, replay, simulate
    from pneumo.engineer.transport_floor import transport_floor
    from pneumo.physics.cylinder import Cylinder
    from pneumo.physics.models import MODELS, Model
    from pneumo.storage.files import open_grid

__all__ = [
    "MODELS",
    "Cylinder",
    "Model",
    "chamber_rate",
    "linearise",
    "open_grid",
    "plant",
    "recorded",
    "replay",
    "simulate",
    "transport_floor",
]

_HOME = {
    "Cylinder": "pneumo.physics.cylinder",
    "MODELS": "pneumo.physics.models",
    "Model": "pneumo.physics.models",
    "chamber_rate": "pneumo.engineer.model_rate",
    "linearise": "pneumo.engineer.linear_model",
    "open_grid": "pneumo.storage.files",
    "plant": "pneumo.engineer.plants",
    "recorded": "pneumo.engineer.runs",
    "replay": "pneumo.engineer.runs",
    "simulate": "pneumo.engineer.runs",
    "transport_floor": "pneumo.engineer.transport_floor",
}


def __getattr__(name: str) -> Any:
    """Load a public name on first use, so that importing one room does not import all."""
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'pneumo' has no attribute {name!r}")
