"""Functions that run in plain Python and, called from a compiled kernel, as compiled code."""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numba.extending import register_jitable

Function = TypeVar("Function", bound=Callable[..., Any])
Real = TypeVar(
    "Real", float, np.ndarray
)  # quantities with units and symbols go the same way, unseen by types


def jitable(function: Function) -> Function:
    """Return a function as it is, and make it known to Numba: its decorator has no types."""
    return register_jitable(function)
