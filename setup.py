"""Compile the core, and make README's links absolute; all else about the package is in pyproject.toml."""

import os
import re
import tomllib
from pathlib import Path

from setuptools import setup
from setuptools.command.build_ext import build_ext
from setuptools.errors import CompileError

from build_backend import compiler


class BuildCore(build_ext):
    """Build the extension, or say in one line what is missing."""

    def run(self):
        if os.name != "nt":
            os.environ["CC"] = compiler() or "cc"
        super().run()

    def build_extension(self, ext):
        if self.compiler.compiler_type == "msvc":
            ext.extra_compile_args = ["/O2", "/fp:precise", "/std:c11"]
        try:
            super().build_extension(ext)
        except CompileError as error:
            raise SystemExit(
                f"pneumo needs a C compiler and Python's headers to be installed from source: {error}"
            ) from None


def long_description():
    """README as a package index shows it, where relative links lead nowhere.

    They lead to the repository's address in pyproject.toml; without one, links become their words.
    """
    project = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))["project"]
    address = project["urls"].get("Repository")
    readme = re.sub(r"<!--.*?-->\n", "", Path("README.md").read_text(encoding="utf-8"))

    def absolute(match):
        image, words, target = match.groups()
        if address:
            return f"{image}[{words}]({address}/{'raw' if image else 'blob'}/v{project['version']}/{target})"
        return "" if image else words

    return re.sub(r"(!?)\[([^]]+)\]\((?!https?:)([^)#]+)\)", absolute, readme)


setup(
    long_description=long_description(),
    long_description_content_type="text/markdown",
    cffi_modules=["pneumo/core/build.py:ffi"],
    cmdclass={"build_ext": BuildCore},
    options={"bdist_wheel": {"py_limited_api": "cp311"}},  # one wheel for all versions from 3.11 on
)
