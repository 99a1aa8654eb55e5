"""Files that others may have made or use: regular files only, of a known size; locks."""

import errno
import os
import stat
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

LARGEST_RESULT = 50_000_000_000  # bytes; the study's largest has 92 million
NOT_WAITING = getattr(os, "O_NONBLOCK", 0)  # for the writer of a named pipe


@contextmanager
def regular_file(path: Path, largest: int) -> Generator[BinaryIO]:
    """Open a file to read it; OSError unless it is a regular file of at most `largest` bytes.

    Errors while reading name the file too; those of the operating system do not.
    """
    with open(path, "rb", opener=lambda name, flags: os.open(name, flags | NOT_WAITING)) as stream:
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


def lock(file: int, *, shared: bool = False, wait: bool = True) -> None:
    """Lock an open file or folder until it is closed or the process ends, even by a kill.

    BlockingIOError if another process has the lock, unless `wait`. Windows has no such lock.
    """
    if os.name != "nt":
        import fcntl

        fcntl.flock(file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | (0 if wait else fcntl.LOCK_NB))
