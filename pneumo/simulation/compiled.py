"""Where functions get compiled.

Numba's cache does not notice edits in imported functions, so the cache folder carries a hash of
every source that can end up in compiled code: a stale kernel cannot be loaded.
"""

import os
from collections.abc import Callable, Set
from pathlib import Path
from typing import Any

import numba

from pneumo.hashing import ROOT, code_hash


def _cache_folder() -> Path:
    home = os.environ.get("NUMBA_CACHE_DIR") or Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache", "pneumo")
    names = [
        f"pneumo.{room}.{file.stem}"
        for room in ("physics", "simulation")
        for file in sorted((ROOT / room).glob("*.py"))
        if file.stem != "__init__"
    ]
    return Path(home).expanduser() / code_hash(*names)[:16]


numba.config.CACHE_DIR = str(_cache_folder())  # type: ignore[attr-defined]


def kernel(function: Callable[..., Any] | None = None, *, fastmath: Set[str] = frozenset()) -> Any:
    """Compile a function that takes floats and arrays; its plain form stays at ``.py_func``.

    Parameters
    ----------
    function : callable, optional
        Left out where the decorator takes options.
    fastmath : set of str
        Liberties the compiler may take with floats, by LLVM's names.
    """
    compiled = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=set(fastmath))
    return compiled if function is None else compiled(function)
