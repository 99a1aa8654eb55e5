"""The compiled core: loops over equations (1) to (8) and (10) in C, with the same bits on every processor.

The equations are stated in `pneumo.physics`; tests hold this C to them. Functions of the package pass arrays
and named tuples through `array`, `out` and `struct`, which refuse what the C code could not read. Every call
releases Python's lock.
"""

import sys
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from pneumo.errors import InstallationError

HERE = Path(__file__).parent


def _compiled_elsewhere() -> str:
    """Folder of an installed core with the same sources, for a checkout that has none of its own.

    `pip install .` compiles it there, but Python that starts in a checkout imports the `pneumo` of that.
    """
    sources = {file.name: file.read_bytes() for file in (*HERE.glob("*.[ch]"), HERE / "build.py")}
    for folder in (Path(place, "pneumo/core") for place in sys.path):
        files = {name: folder / name for name in sources}
        same = (file.is_file() and file.read_bytes() == sources[name] for name, file in files.items())
        if any(folder.glob("_core.*")) and all(same):
            return str(folder)
    raise InstallationError(
        f"{HERE.parents[1]}: pneumo's core is not compiled here; type `pip install -e .` in this folder"
    )


if not any(HERE.glob("_core.*")):
    __path__.append(_compiled_elsewhere())
from pneumo.core import _core  # noqa: E402 # pyright: ignore[reportAttributeAccessIssue]

ffi, lib = _core.ffi, _core.lib
lib.fill_tables()
LONGEST = 2**31  # of any count of samples, lanes or parts
CTYPES = {np.dtype(np.float64): "double[]", np.dtype(np.int8): "int8_t[]", np.dtype(np.int64): "int64_t[]"}


def struct(name: str, values: tuple[Any, ...] | dict[str, Any]) -> Any:
    """C struct of a named tuple, whose fields have the same order, nested ones too, or of fields by name."""
    return ffi.new(f"{name} *", tuple(values) if isinstance(values, tuple) else values)


def out(values: np.ndarray) -> Any:
    """C pointer to an array that the core writes: one that was just made, of a known type and in C order."""
    return ffi.from_buffer(CTYPES[values.dtype], values, require_writable=True)


def array(
    name: str, values: Any, shape: tuple[int | None, ...], dtype: type = np.float64, *, optional: bool = False
) -> Any:
    """C pointer to an array that the core reads, copied only if it has another type or layout.

    `shape` has None where any length is allowed. The pointer keeps the array alive; it is NULL for None,
    which only an `optional` array may be.

    Raises
    ------
    ValueError
        If the shape is another, or the values are None or no numbers.
    """
    if values is None and optional:
        return ffi.NULL
    if values is None:
        raise ValueError(f"{name}: None; needed is an array of shape {shape}")
    values = np.ascontiguousarray(values, dtype=dtype)
    fits = len(shape) == values.ndim and all(b in (None, a) for a, b in zip(values.shape, shape, strict=True))
    if not fits:
        raise ValueError(
            f"{name}: shape {values.shape}; needed is {tuple('any' if n is None else n for n in shape)}"
        )
    return ffi.from_buffer(CTYPES[values.dtype], values)


def rows(name: str, values: Any, kind: str) -> Any:
    """C pointer to structs of real numbers, from an array with a row for each."""
    pointer = array(name, values, (None, ffi.sizeof(kind) // ffi.sizeof("double")))
    return keep(ffi.cast(f"{kind} *", pointer), pointer)


def zeroed(kind: str) -> Any:
    """C pointer to a struct full of zeros, aligned to a cache line."""
    memory = np.zeros(ffi.sizeof(kind) + 64, np.uint8)
    pointer = ffi.from_buffer(memory[-memory.ctypes.data % 64 :])
    return keep(ffi.cast(f"{kind} *", pointer), pointer)


def keep(pointer: Any, *owners: Any) -> Any:
    """Pointer that keeps alive what it points into."""
    _owners[pointer] = owners
    return pointer


_owners: WeakKeyDictionary[Any, tuple[Any, ...]] = WeakKeyDictionary()


def whole(name: str, value: int, low: int, high: int = LONGEST) -> int:
    """A whole number in a range, for counts and indices that the core trusts; else `ValueError`."""
    if not low <= value <= high or value != int(value):
        raise ValueError(f"{name} = {value}: must be a whole number from {low} to {high}")
    return int(value)
