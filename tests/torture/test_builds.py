# pyright: standard
"""Other compilers and processors give the same bits."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.checkout import ROOT, copy_checkout

pytestmark = pytest.mark.slow

INFO = Path("/proc/cpuinfo")
FEATURES = set(INFO.read_text().split() if INFO.exists() else ())
BUILDS = {  # command of the compiler -> what the processor must have, as /proc/cpuinfo names it
    "gcc -O2": "",
    "gcc -march=x86-64-v3": "avx2",
    "gcc -march=x86-64-v4": "avx512f",
    "clang -O2 -march=x86-64-v3": "avx2",
}


def fingerprint(folder: Path) -> str:
    command = [sys.executable, "-m", "tests.torture.fingerprint"]
    return subprocess.check_output(command, cwd=folder, env={"PYTHONPATH": str(folder)}, text=True)


@pytest.mark.parametrize("build", BUILDS)
def test_another_build_of_the_core_gives_the_same_bits(build, tmp_path):
    name, *flags = build.split()
    if (BUILDS[build] and BUILDS[build] not in FEATURES) or not shutil.which(name):
        pytest.skip(f"no {name} with {BUILDS[build]} here")
    folder = copy_checkout(tmp_path / "checkout")
    compiler = folder / "compile"  # its own flags come last
    compiler.write_text(f'#!/bin/sh\nexec {name} -DPNEUMO_NO_CLONES "$@" {" ".join(flags)}\n')
    compiler.chmod(0o755)
    command = [sys.executable, "setup.py", "--quiet", "build_ext", "--inplace", "--force"]
    path = {"CC": "./compile", "PATH": f"{Path(sys.executable).parent}:/usr/local/bin:/usr/bin:/bin"}
    subprocess.run(command, cwd=folder, env=path, check=True)
    assert fingerprint(folder) == fingerprint(ROOT)
