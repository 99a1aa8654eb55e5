"""Process that reads files by libraries: a damaged file can crash them, or make them fill the memory."""

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from threading import Timer
from typing import Any

from pneumo.errors import InputError

LARGEST_MEMORY = 800_000_000  # bytes that the process may have beyond those of its start
LONGEST = 300.0  # s, for one file
SERVE = "from pneumo.fitting.record.reader_process import serve; serve()"


class _Reader:
    """Process started by the first file; a crash ends it, and the next file starts another."""

    def __init__(self) -> None:
        self.process: subprocess.Popen[bytes] | None = None

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Result of a function in the process; the error raised there, or `EOFError` after a crash."""
        if self.process is None or self.process.poll() is not None:
            self.process = subprocess.Popen(
                [sys.executable, "-c", SERVE],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            )
        process = self.process
        assert process.stdin and process.stdout
        timer = Timer(LONGEST, process.kill)
        timer.start()
        try:
            pickle.dump((function, arguments), process.stdin)
            process.stdin.flush()
            result, error = pickle.load(process.stdout)  # noqa: S301 - written by `serve`
        except (OSError, EOFError, pickle.UnpicklingError):
            process.kill()
            process.communicate()
            self.process = None
            raise EOFError("its content crashes the library that reads it, or takes it too long") from None
        finally:
            timer.cancel()
        if error is not None:
            raise error
        return result


READER = _Reader()


def isolated(read: Callable[..., Any], kind: Any, path: Path) -> Any:
    """Content of a file of some kind as a function returns it, called in another process."""
    whole = path.absolute()
    try:
        return READER.call(read, kind, whole)
    except InputError as error:
        raise InputError(str(error).replace(str(whole), str(path))) from None


def serve() -> None:
    """Answer calls until standard input ends."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # a library's own output is no answer
    _bound_memory()
    while True:
        try:
            function, arguments = pickle.load(sys.stdin.buffer)  # noqa: S301 - written by `_Reader`
        except EOFError:
            return
        result, error = None, None
        try:
            result = function(*arguments)
        except InputError as refused:
            error = refused
        except MemoryError:
            error = ValueError(f"reading it needs more than {LARGEST_MEMORY // 10**6} MB of memory")
        except Exception as failed:
            error = ValueError(" ".join(str(failed).split())[:500] or type(failed).__name__)
        pickle.dump((result, error), answers, pickle.HIGHEST_PROTOCOL)
        answers.flush()


def _bound_memory() -> None:
    """Bound the memory of this process, where the system can."""
    import numpy as np
    import pandas as pd

    status = Path("/proc/self/statm")
    if status.exists():
        import resource

        assert np.__name__ and pd.__name__  # what they need is no part of the bound
        used = int(status.read_text(encoding="ascii").split()[0]) * resource.getpagesize()
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        resource.setrlimit(resource.RLIMIT_AS, (used + LARGEST_MEMORY, hard))
