"""The public names of the package."""

import inspect
import subprocess
import sys
from importlib.metadata import version

import pytest
from checkout import ROOT

import pneumo


def test_dir_shows_the_public_names_and_each_is_there():
    assert dir(pneumo) == sorted(pneumo.__all__)
    assert {"simulate", "replay", "Run", "Plant", "PneumoError", "MODELS", "__version__"} <= set(dir(pneumo))
    assert all(getattr(pneumo, name) is not None for name in pneumo.__all__)
    assert inspect.isfunction(pneumo.simulate)
    with pytest.raises(AttributeError, match="module 'pneumo' has no attribute 'simulat'"):
        _ = pneumo.simulat
    assert pneumo.__version__ == version("pneumo")


def test_import_loads_neither_numpy_nor_xarray_and_errors_have_one_base():
    code = "import sys, pneumo; print(sorted({'numpy', 'xarray', 'scipy'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
    errors = [getattr(pneumo, name) for name in pneumo.__all__ if name.endswith("Error")]
    assert len(errors) == 5 and all(issubclass(error, pneumo.PneumoError) for error in errors)


POSIX = """
import sys
sys.modules |= dict.fromkeys(["fcntl", "grp", "pwd", "resource", "syslog", "termios", "tty"])
import pkgutil, importlib, pneumo.notebook.record_fit
assert "sympy" not in sys.modules  # fits do not wait for it
for module in pkgutil.walk_packages(pneumo.__path__, "pneumo."):
    importlib.import_module(module.name)
"""


def test_every_module_is_imported_without_the_modules_that_windows_has_not(tmp_path):
    done = subprocess.run([sys.executable, "-c", POSIX], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_hardly_anything_is_imported_before_ctrl_c_is_one_line():
    code = f"import sys; sys.path.insert(0, {str(ROOT)!r}); import pneumo.cli; print('typing' in sys.modules)"
    bare = subprocess.run([sys.executable, "-S", "-c", code], capture_output=True, text=True, check=True)
    assert bare.stdout == "False\n"
