"""Reading a file by a library in another process: a damaged file can crash it, or make it fill the memory."""

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pneumo.errors import InputError

LARGEST_MEMORY = 800_000_000  # bytes for the file and the library that reads it, besides those of pneumo
LONGEST = 300.0  # s, for one file
SERVE = "from pneumo.fitting.record.reader_process import serve; serve()"


def isolated(function: Callable[..., Any], *arguments: Any) -> Any:
    """Result of a function called in another process, or the error raised there."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", SERVE],
            input=pickle.dumps((function, arguments)),
            capture_output=True,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            timeout=LONGEST,
        )
        result, error = pickle.loads(done.stdout)  # noqa: S301 - written by `serve`
    except (subprocess.TimeoutExpired, EOFError, pickle.UnpicklingError):
        raise ValueError("its content crashes the library that reads it, or takes it too long") from None
    if error is not None:
        raise error
    return result


def serve() -> None:
    """Answer the call of `isolated`."""
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # a library's own output is no answer
    function, arguments = pickle.load(sys.stdin.buffer)  # noqa: S301 - written by `isolated`
    status = Path("/proc/self/statm")
    if status.exists():  # elsewhere memory cannot be bounded
        import resource

        used = int(status.read_text(encoding="ascii").split()[0]) * resource.getpagesize()
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        resource.setrlimit(resource.RLIMIT_AS, (used + LARGEST_MEMORY, hard))
    result, error = None, None
    try:
        result = function(*arguments)
    except (InputError, ImportError) as refused:
        error = refused
    except MemoryError:
        error = ValueError(f"reading it needs more than {LARGEST_MEMORY // 10**6} MB of memory")
    except Exception as failed:
        error = ValueError(" ".join(str(failed).split())[:500] or type(failed).__name__)
    pickle.dump((result, error), answer, pickle.HIGHEST_PROTOCOL)
    answer.flush()
