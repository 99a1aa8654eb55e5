"""Functions that run in plain Python and, called from a compiled kernel, as compiled code."""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

Function = TypeVar("Function", bound=Callable[..., Any])
Real = TypeVar("Real", float, np.ndarray)

JITABLE: list[Callable[..., Any]] = []  # functions that kernels may call; `simulation.compiled` tells Numba


def jitable(function: Function) -> Function:
    """Return a function as it is, noted in `JITABLE`, so that physics does not load Numba."""
    JITABLE.append(function)
    return function
