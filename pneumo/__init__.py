"""pneumo: reduced-order thermodynamic models of servo-pneumatic actuator chambers, reproduced and judged."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pneumo.physics.models import MODELS
    from pneumo.store import open_grid

__all__ = ["MODELS", "open_grid"]

_HOME = {"MODELS": "pneumo.physics.models", "open_grid": "pneumo.store"}


def __getattr__(name: str) -> Any:
    """Load a public name on first use, so that importing one room does not import all."""
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'pneumo' has no attribute {name!r}")
