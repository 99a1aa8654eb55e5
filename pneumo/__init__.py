"""pneumo: reduced-order thermodynamic models of servo-pneumatic actuator chambers, reproduced and judged."""

from importlib import import_module
from typing import Any

_HOME = {"open_grid": "pneumo.store", "MODELS": "pneumo.physics.models"}
__all__ = ["MODELS", "open_grid"]  # noqa: F822  (loaded on first use, so that imports stay light)


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'pneumo' has no attribute {name!r}")
