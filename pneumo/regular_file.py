"""Safe reading of files that others may have made: regular files only, their size checked before reading."""

import errno
import os
import stat
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

NOT_WAITING = getattr(os, "O_NONBLOCK", 0)  # for the writer of a named pipe


def _opened(path: str, flags: int) -> int:
    return os.open(path, flags | NOT_WAITING)


@contextmanager
def regular_file(path: Path, largest: int) -> Generator[BinaryIO]:
    """Open a file to read it; OSError unless it is a regular file of at most `largest` bytes.

    Errors while reading name the file too; those of the operating system do not.
    """
    with open(path, "rb", opener=_opened) as stream:
        status = os.fstat(stream.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "not a regular file", str(path))
        if status.st_size > largest:
            raise OSError(errno.EFBIG, f"is too large: at most {largest} bytes are read", str(path))
        with named(path):
            yield stream


@contextmanager
def named(path: Path) -> Generator[None]:
    """Add a file's name to an OSError that has none, such as that of a failing disk."""
    try:
        yield
    except OSError as error:
        if error.filename is None and error.errno is not None:
            raise OSError(error.errno, error.strerror, str(path)) from None
        raise
