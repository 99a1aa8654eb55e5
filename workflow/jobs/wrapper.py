"""Around the work of every workflow script: arguments, lock, log and errors."""

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

from paper_verdict.errors import PaperError
from pneumo.errors import SYSTEM, PneumoError
from workflow.jobs.run_lock import job_lock


def run_job(main: Callable[..., object], script: Mapping[str, Any]) -> None:
    """Call a workflow script's main function with the values of its rule, if Snakemake runs the script.

    `script` is the script's ``globals()``, where Snakemake puts its job. Each parameter of `main` gets the
    rule's value of that name: a path or list of paths (input, output), a value (params, wildcards) or
    ``threads``. The job's log gets the time taken or the error. An error that the user can correct is also
    one line on standard error, with exit code 2. Ctrl-C ends the process at once, like a kill.
    """
    job = script.get("snakemake")
    if job is None:
        return
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # else Python waits for threads in compiled code
    start = time.perf_counter()
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # for locales other than UTF-8
    try:
        with job_lock():
            main(**arguments(main, job))
        _log(job, f"{job.rule}: {time.perf_counter() - start:.2f} s\n")
    except BaseException as error:
        correctable = isinstance(error, (PneumoError, PaperError)) or getattr(error, "errno", 0) in SYSTEM
        text = " ".join(str(error).split())
        with suppress(OSError):  # the disk may be full
            _log(job, f"{text}\n" if correctable else traceback.format_exc())
        if not correctable:
            raise
        print(f"pneumo: {text}", file=sys.stderr)
        sys.exit(2)


def _log(job: Any, text: str) -> None:
    """Write a job's log; bytes of a path that are not Unicode are escaped."""
    Path(job.log[0]).write_text(text, encoding="utf-8", errors="backslashreplace")


def arguments(main: Callable[..., object], job: Any) -> dict[str, Any]:
    """Return the arguments of a script's main function, by name, from a snakemake.script.Snakemake."""
    files = {
        name: Path(file) if isinstance(file, str) else [Path(each) for each in file]
        for name, file in [*job.input.items(), *job.output.items()]
    }
    given = {**job.wildcards, **job.params, **files, "threads": job.threads}
    return {name: given[name] for name in inspect.signature(main).parameters}
