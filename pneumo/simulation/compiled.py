"""Where functions get compiled.

Numba's cache does not notice edits in imported functions. So each kernel's cache folder carries a hash of its
module and of every module that this one imports, comments left out: a stale kernel cannot be loaded.
"""

import os
from collections.abc import Callable, Set
from pathlib import Path
from typing import Any

import numba
from numba.extending import register_jitable

from pneumo.hashing import compiled_hash
from pneumo.physics.jitable import JITABLE


def cache_folder(module: str) -> Path:
    """Folder for the compiled functions of a module."""
    home = os.environ.get("NUMBA_CACHE_DIR") or Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache", "pneumo")
    return Path(home).expanduser() / compiled_hash(module)[:16]


def kernel(function: Callable[..., Any] | None = None, *, fastmath: Set[str] = frozenset()) -> Any:
    """Compile a function that takes floats and arrays; its plain form stays at ``.py_func``.

    `fastmath` names liberties that the compiler may take with floats, by LLVM's names; a decorator with it
    leaves `function` out.
    """
    compiled = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=set(fastmath))

    def cached(function: Callable[..., Any]) -> Any:
        while JITABLE:  # imported by now: what a kernel calls stands above it
            register_jitable(JITABLE.pop())
        numba.config.CACHE_DIR = str(cache_folder(function.__module__))  # type: ignore[attr-defined]
        return compiled(function)

    return cached if function is None else cached(function)
