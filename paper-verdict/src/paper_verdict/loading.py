"""A paper from its folder: its files, and the functions of its ``computations.py``."""

import importlib.util
import sys
from collections.abc import Generator
from contextlib import contextmanager
from inspect import isclass, isroutine
from pathlib import Path
from types import ModuleType
from typing import Any

from paper_verdict.judging import Paper

HOOKS = ("sources", "highlights", "about", "changed", "chi_square")  # functions that are no computations


def load_paper(folder: Path) -> Paper:
    """The paper of a folder.

    Functions of ``computations.py``, if there is one, are its computations and proofs; those named in `HOOKS`
    are fields of the `Paper`. A module that defines ``PAPER`` gives its own `Paper`. The current folder and
    the paper's can be imported from. Errors in the module are those of Python.
    """
    file = folder / "computations.py"
    if not file.is_file():
        return Paper(folder)
    module = _module(file)
    own = getattr(module, "PAPER", None)
    if own is not None:
        return own._replace(folder=folder)
    functions = {
        name: value
        for name, value in vars(module).items()
        if callable(value) and not isclass(value) and not name.startswith("_")
    }
    hooks: dict[str, Any] = {name: functions.pop(name) for name in HOOKS if name in functions}
    return Paper(folder, functions, {n: f for n, f in functions.items() if isroutine(f)}, **hooks)


def _module(file: Path) -> ModuleType:
    name = f"computations_of_{file.resolve().parent.name}".replace("-", "_")
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    with _importing_from(Path.cwd(), file.resolve().parent):
        spec.loader.exec_module(module)
    return module


@contextmanager
def _importing_from(*folders: Path) -> Generator[None]:
    before = list(sys.path)
    known = set(sys.modules)
    sys.path[:0] = [str(folder) for folder in folders if str(folder) not in before]
    try:
        yield
    finally:
        sys.path[:] = before
        beside = str(folders[-1])  # another paper may have modules of the same names
        for name in set(sys.modules) - known:
            if (getattr(sys.modules[name], "__file__", None) or "").startswith(beside):
                del sys.modules[name]
