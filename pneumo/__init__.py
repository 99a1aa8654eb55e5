"""pneumo: reduced-order thermodynamic models of servo-pneumatic actuator chambers, reproduced and judged."""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pneumo.apply.linearise import linearise
    from pneumo.apply.rate import chamber_rate
    from pneumo.apply.runs import plant, recorded, replay, simulate
    from pneumo.apply.transport import transport_floor
    from pneumo.physics.cylinder import Cylinder
    from pneumo.physics.models import MODELS, Model
    from pneumo.store import open_grid

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
    "chamber_rate": "pneumo.apply.rate",
    "linearise": "pneumo.apply.linearise",
    "open_grid": "pneumo.store",
    "plant": "pneumo.apply.runs",
    "recorded": "pneumo.apply.runs",
    "replay": "pneumo.apply.runs",
    "transport_floor": "pneumo.apply.transport",
}


class _Simulate(ModuleType):
    """The room `pneumo.simulate`, which can be called as well: `pneumo.apply.runs.simulate`."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        return import_module("pneumo.apply.runs").simulate(*args, **options)


class _Pneumo(ModuleType):
    """The package itself, which makes its room `simulate` callable as soon as an import puts it here."""

    def __setattr__(self, name: str, value: Any) -> None:
        if name == "simulate":
            value.__class__ = _Simulate
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Pneumo


def __getattr__(name: str) -> Any:
    """Load a public name on first use, so that importing one room does not import all."""
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    if name == "simulate":
        return import_module("pneumo.simulate")
    raise AttributeError(f"module 'pneumo' has no attribute {name!r}")
