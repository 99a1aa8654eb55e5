"""The public names of the package."""

import ast
import inspect
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import pneumo

ROOT = Path(__file__).parents[1]


def test_dir_shows_the_public_names_and_each_is_there():
    assert dir(pneumo) == sorted(pneumo.__all__)
    assert {"simulate", "replay", "Run", "Plant", "PneumoError", "MODELS", "__version__"} <= set(dir(pneumo))
    assert all(getattr(pneumo, name) is not None for name in pneumo.__all__)
    assert inspect.isfunction(pneumo.simulate)
    with pytest.raises(AttributeError, match="module 'pneumo' has no attribute 'simulat'"):
        _ = pneumo.simulat


def test_type_checkers_see_the_same_names_from_the_same_modules():
    # They read imports that never run; at run time a table says where each name is.
    tree = ast.parse((ROOT / "pneumo/__init__.py").read_text(encoding="utf-8"))
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    named = {
        alias.asname: node.module
        for node in imports
        for alias in node.names
        if alias.name == alias.asname and node.module.startswith("pneumo.")
    }
    assert named == pneumo._MODULE_OF and set(named) | {"__version__"} == set(pneumo.__all__)
    assert (ROOT / "pneumo/py.typed").exists()


def test_version_is_that_of_the_distribution():
    assert pneumo.__version__ == version("pneumo")


def test_import_loads_neither_numba_nor_xarray():
    code = "import sys, pneumo; print(sorted({'numba', 'numpy', 'xarray', 'scipy'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_every_error_that_a_user_can_mend_has_one_base():
    errors = [getattr(pneumo, name) for name in pneumo.__all__ if name.endswith("Error")]
    assert len(errors) == 6 and all(issubclass(error, pneumo.PneumoError) for error in errors)
    assert str(pneumo.DamagedError(Path("E01.nc"), "damaged")) == "E01.nc: damaged"
