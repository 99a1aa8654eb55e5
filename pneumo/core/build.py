"""Build of the compiled core with cffi: setup.py compiles `ffi` into the module `pneumo.core._core`."""

from pathlib import Path

from cffi import FFI

FOLDER = Path(__file__).parent
SOURCES = ("full_order", "replay", "fitted", "closed", "kalman")
# No contraction of a * b + c, so that all processors compute the same bits; the other flags change no result:
# they let square roots and selections become vector instructions.
FLAGS = ["-std=c99", "-O3", "-g0", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"]

ffi = FFI()
ffi.cdef(FOLDER.joinpath("core.h").read_text(encoding="utf-8"))
ffi.set_source(
    "pneumo.core._core",
    '#include "maths.h"',
    sources=[f"pneumo/core/{name}.c" for name in SOURCES],
    depends=[f"pneumo/core/{name}.h" for name in ("core", "maths", "rates", "open_port", "lanes")],
    include_dirs=["pneumo/core"],
    extra_compile_args=FLAGS,
)
