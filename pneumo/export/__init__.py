"""Models as source code and FMUs, printed from `pneumo.equations.equation_list`."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pneumo.export.targets import TARGETS, exported, write_files

__all__ = ["TARGETS", "exported", "write_files"]


def __getattr__(name: str) -> Any:  # who wants only the measured cost of a step does not wait for SymPy
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from pneumo.export import targets

    return getattr(targets, name)
