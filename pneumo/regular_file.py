"""The one way to a file that others may have made: regular, and of a size that is known before it is read."""

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
    """Open a file to read it; OSError unless it is a regular file of at most `largest` bytes."""
    with open(path, "rb", opener=_opened) as stream:
        status = os.fstat(stream.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "not a regular file", str(path))
        if status.st_size > largest:
            raise OSError(errno.EFBIG, f"must have at most {largest} bytes", str(path))
        yield stream
