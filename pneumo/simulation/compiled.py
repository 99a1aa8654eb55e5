# pyright: standard
"""Compilation of functions by Numba, and the cache of their machine code.

Numba's cache does not notice edits in imported functions. So a kernel's folder is named by a hash of its
module and of all modules that this one imports: a stale kernel is never loaded. Nor is machine code
that is damaged or that another user may have written. One line on standard error then names the problem, and
the kernel is compiled again; likewise if the folder cannot be read or written.
"""

import os
import pickle
import sys
from collections.abc import Callable, Set
from contextlib import suppress
from hashlib import sha256
from inspect import isfunction
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import numba
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps
from numba.extending import register_jitable

from pneumo.hashing import code_hash
from pneumo.physics import chamber, cylinder, valve

DIGEST = sha256().digest_size
_warned: set[str] = set()  # lines already printed


def cache_folder(module: str) -> Path:
    """Folder on disk for the compiled functions of a module, named by a hash of its code."""
    home = os.environ.get("NUMBA_CACHE_DIR") or Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache", "pneumo")
    with suppress(RuntimeError):  # a user without a home
        return Path(home).expanduser() / code_hash(module)[:16]
    return Path(os.devnull, "home")


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a function that kernels call: the compiler puts its code in place of every call.

    A call would copy the arguments, and a plant has some fifty numbers: copying took half the time of a
    full-order step.
    """
    return register_jitable(forceinline=True, no_cfunc_wrapper=True)(function)


def inlined_first(function: Callable[..., Any]) -> Any:
    """Decorate a function that kernels call: Numba puts its code in place of calls before type inference.

    The function is then compiled as a part of its callers only; with ``register_jitable(inline="always")``
    Numba would first compile it alone, in vain.
    """
    return numba.njit(inline="always")(function)


# The physics is plain Python and does not load Numba; `reference` does the same for the models.
for _module in (chamber, cylinder, valve):
    for _function in vars(_module).values():
        if isfunction(_function) and _function.__module__ == _module.__name__:
            inlined(_function)


def kernel(function: Callable[..., Any] | None = None, *, fastmath: Set[str] = frozenset()) -> Any:
    """Compile a function that takes floats and arrays; its plain form stays at ``.py_func``.

    Write ``@kernel``, or ``@kernel(fastmath={...})`` with LLVM's names for the ways in which the compiler may
    change floating-point operations, such as "contract".
    """
    compiled = numba.njit(nogil=True, error_model="numpy", fastmath=set(fastmath))

    def cached(function: Callable[..., Any]) -> Any:
        dispatcher: Any = compiled(function)
        dispatcher._cache = KernelCache(function)  # where `cache=True` puts Numba's own
        return dispatcher

    return cached if function is None else cached(function)


class KernelCache:
    """Machine code of a kernel on disk: a file for each signature and processor, with a SHA-256 in front.

    It replaces Numba's own cache, which unpickles any file, and fails if it cannot.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self.name = f"{function.__qualname__}-{function.__code__.co_firstlineno}"
        self.folder = cache_folder(function.__module__)
        self.cache_path = str(self.folder)

    def _file(self, signature: Any, codegen: Any) -> Path:
        key = repr((signature, codegen.magic_tuple(), numba.__version__, sys.version_info[:2]))
        return self.folder / f"{self.name}.{sha256(key.encode()).hexdigest()[:16]}"

    def load_overload(self, signature: Any, target: Any) -> CompileResult | None:
        """Return the compiled kernel for a signature; None if it is not there or must not be loaded."""
        target.refresh()
        file = self._file(signature, target.codegen())
        try:
            if not _only_ours(self.folder.stat()):
                return self._warn_once("others can write there; compiled code in it is not used")
            with file.open("rb") as stream:
                ours, digest = _only_ours(os.fstat(stream.fileno())), stream.read(DIGEST)
                content = stream.read()
            if ours and digest == sha256(file.name.encode() + content).digest():
                parts = pickle.loads(content)  # noqa: S301 - written by this user
                return CompileResult._rebuild(target, *parts)
        except FileNotFoundError:
            return None
        except OSError as error:
            return self._warn_once(f"{error.strerror}; compiled code is not kept there")
        except Exception:  # whatever unpickling raises where packages have changed
            pass
        return self._warn_once("compiled code in it is damaged or foreign; compiled again")

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Write a compiled kernel to its file; where the folder cannot be written, only warn."""
        file, part = self._file(signature, compiled.codegen), None
        try:
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            content = dumps(compiled._reduce())
            with NamedTemporaryFile(dir=self.folder, delete=False) as part:
                part.write(sha256(file.name.encode() + content).digest() + content)
            Path(part.name).replace(file)
        except OSError as error:
            self._warn_once(f"{error.strerror}; compiled code is not kept there")
            if part is not None:
                Path(part.name).unlink(missing_ok=True)

    def _warn_once(self, problem: str) -> None:
        """Print a problem of the folder on standard error, once in a process."""
        line = f"pneumo: {self.folder.parent}: {problem}"
        if line not in _warned:
            _warned.add(line)
            print(line, file=sys.stderr)


def _only_ours(status: os.stat_result) -> bool:
    """Whether only this user can have written a file or folder, by owner and mode; on Windows always true."""
    return os.name == "nt" or (status.st_uid == os.geteuid() and not status.st_mode & 0o022)
