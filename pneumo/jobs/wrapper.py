"""What every workflow script does around its work."""

import errno
import gc
import inspect
import signal
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from io import TextIOWrapper
from pathlib import Path
from typing import Any

from pneumo.errors import DamagedError, PneumoError
from pneumo.jobs.run_lock import job_lock

GARBAGE = 100_000  # objects made between two collections; at Python's 700 they take a seventh of compiling
DISK = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EPERM)  # full, or not to be written


def run_job(main: Callable[..., object], script: Mapping[str, Any]) -> None:
    """Call a workflow script's main function with what its rule gives, if Snakemake runs the script.

    Writes to the job's log how long the work took, or what stopped it. An error that the user can mend is
    also one line on standard error, and the exit code is 2. A damaged file that the job was to read is
    removed, so that the next run makes it again. Ctrl-C ends the process at once, as a kill does. `script`
    is the script's ``globals()``, into which Snakemake puts its job; each parameter of `main` takes what the
    rule has under its name: a path or a list of paths of the input or output, a value of params or
    wildcards, or ``threads``.
    """
    job = script.get("snakemake")
    if job is None:
        return
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # else Python waits for threads in compiled code
    gc.set_threshold(GARBAGE)
    start = time.perf_counter()
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # whatever the locale can write
    try:
        with job_lock():
            main(**arguments(main, job))
        _log(job, f"{job.rule}: {time.perf_counter() - start:.2f} s\n")
    except BaseException as error:
        mendable = isinstance(error, PneumoError) or getattr(error, "errno", 0) in DISK
        text = " ".join(str(error).split())
        if isinstance(error, DamagedError):
            error.path.unlink(missing_ok=True)
            text += "; removed, the next run makes it again"
        with suppress(OSError):  # the disk may be full
            _log(job, f"{text}\n" if mendable else traceback.format_exc())
        if not mendable:
            raise
        print(f"pneumo: {text}", file=sys.stderr)
        sys.exit(2)


def _log(job: Any, text: str) -> None:
    """Write a job's log; what is no Unicode, such as bytes of a path, is escaped."""
    Path(job.log[0]).write_text(text, encoding="utf-8", errors="backslashreplace")


def arguments(main: Callable[..., object], job: Any) -> dict[str, Any]:
    """Return the arguments of a script's main function, by name, from a snakemake.script.Snakemake."""
    files = {
        name: Path(file) if isinstance(file, str) else [Path(each) for each in file]
        for name, file in [*job.input.items(), *job.output.items()]
    }
    given = {**job.wildcards, **job.params, **files, "threads": job.threads}
    return {name: given[name] for name in inspect.signature(main).parameters}
