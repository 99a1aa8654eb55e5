"""Computations that each paper's claims are compared with: one package for each folder of ``paper/``."""

from collections.abc import Callable
from inspect import isfunction
from pathlib import Path
from types import ModuleType
from typing import Any

PAPERS = Path(__file__).resolve().parents[2] / "paper"  # in a source checkout


def functions_returning(result: object, *modules: ModuleType) -> dict[str, Callable[..., Any]]:
    """Public functions that modules define with this return annotation, by name, in their order."""
    return {
        name: function
        for module in modules
        for name, function in vars(module).items()
        if isfunction(function) and function.__module__ == module.__name__ and not name.startswith("_")
        if function.__annotations__.get("return") == result
    }
