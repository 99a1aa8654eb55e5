"""The build backend of setuptools, with Zig's C compiler, a package of Python, where the machine has none."""

import os
import shlex
import subprocess
import sys
import sysconfig
from contextlib import suppress
from importlib.util import find_spec

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403

ZIG = "ziglang>=0.13"


def compiler() -> str | None:
    """Command of the C compiler: $CC, else the first that runs of Python's own, usual ones and Zig's."""
    if os.environ.get("CC"):
        return os.environ["CC"]
    for command in (sysconfig.get_config_var("CC") or "cc", "cc", "gcc", "clang"):
        if _runs(command):
            return command
    # By default Zig compiles for this very processor; the core has a form for each generation.
    return f"{shlex.quote(sys.executable)} -m ziglang cc -mcpu=baseline" if find_spec("ziglang") else None


def _runs(command: str) -> bool:
    """Whether a command is there and works: on a Mac without developer tools, cc is there but fails."""
    with suppress(OSError):
        return subprocess.run([*shlex.split(command), "--version"], capture_output=True).returncode == 0
    return False


def missing() -> list[str]:
    """Requirement of a compiler, if there is none. On Windows setuptools looks for one itself."""
    return [] if os.name == "nt" or compiler() else [ZIG]


def get_requires_for_build_wheel(config_settings: dict[str, str] | None = None) -> list[str]:
    """Return what a wheel needs to be built."""
    return [*build_meta.get_requires_for_build_wheel(config_settings), *missing()]


def get_requires_for_build_editable(config_settings: dict[str, str] | None = None) -> list[str]:
    """Return what an editable installation needs to be built."""
    return [*build_meta.get_requires_for_build_editable(config_settings), *missing()]
