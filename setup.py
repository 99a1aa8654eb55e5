"""Compile the core; all else about the package is in pyproject.toml."""

import os

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


setup(
    cffi_modules=["pneumo/core/build.py:ffi"],
    cmdclass={"build_ext": BuildCore},
    options={"bdist_wheel": {"py_limited_api": "cp311"}},  # one wheel for all versions from 3.11 on
)
