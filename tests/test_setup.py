"""Set-up by the Makefile, and the profile of every run, where a home folder or a disk cannot be written."""

import os
import shutil
import subprocess
import sys
import tomllib

import pytest
from checkout import ROOT

pytestmark = pytest.mark.skipif(not shutil.which("make"), reason="make is not installed")

OF_SET_UP = ("Makefile", "requirements.lock", "pyproject.toml", "paper-verdict/pyproject.toml")


def make(folder, *arguments, **environment):
    kept = {
        name: value for name, value in os.environ.items() if name not in ("UV_CACHE_DIR", "XDG_CACHE_HOME")
    }
    return subprocess.run(
        ["make", *arguments], cwd=folder, env=kept | environment, capture_output=True, text=True
    )


@pytest.mark.parametrize("home", [True, False])
def test_a_checkout_whose_path_setuptools_cannot_take_is_refused_at_once(home, tmp_path, monkeypatch):
    if not home:
        monkeypatch.delenv("HOME", raising=False)
    folder = tmp_path / "a{}b"
    folder.mkdir()
    for name in OF_SET_UP:
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    done = make(folder, "reproduce")
    assert done.returncode == 2 and not (folder / ".venv").exists()
    assert done.stderr.splitlines()[0] == (
        f"{folder}: setuptools installs nothing under a path with {{ or }} in it; rename the folder"
    )


def test_a_path_may_have_quotes_and_spaces(tmp_path):
    folder = tmp_path / """it's a "path" of `mine`"""
    tool = folder / ".venv/bin/snakemake"
    tool.parent.mkdir(parents=True)
    tool.write_text('#!/bin/sh\necho "$VIRTUAL_ENV: $*"\n')
    tool.chmod(0o755)
    for name in OF_SET_UP:
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    (folder / ".venv/.study").touch()
    done = make(folder, "reproduce", "JOBS=3")
    assert f"{folder}/.venv: -j3" in done.stdout.splitlines(), done.stderr


def test_zigs_compiler_is_required_only_where_none_is_found(tmp_path):
    code = "from build_backend import missing; print(*missing())"

    def required(**environment):
        command = [sys.executable, "-c", code]
        return subprocess.check_output(command, cwd=ROOT, env=environment, text=True).strip()

    compiler = tmp_path / "cc"
    assert required(PATH=str(tmp_path)).startswith("ziglang")
    compiler.write_text("#!/bin/sh\nexit 1\n")  # as on a Mac without developer tools
    compiler.chmod(0o755)
    assert required(PATH=str(tmp_path)).startswith("ziglang")
    assert required(PATH=str(tmp_path), CC="mycc") == ""
    compiler.write_text("#!/bin/sh\nexit 0\n")
    assert required(PATH=str(tmp_path)) == ""


def test_the_environment_has_what_paper_verdict_needs():
    """It is installed from its folder without its dependencies: the lock of pneumo has them."""
    needs = tomllib.loads((ROOT / "paper-verdict/pyproject.toml").read_text(encoding="utf-8"))["project"]
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    for requirement in needs["dependencies"]:
        assert f"\n{requirement.partition('>=')[0]}==" in lock, requirement
