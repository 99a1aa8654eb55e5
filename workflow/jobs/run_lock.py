"""One run in a folder at a time; a new run waits for jobs of a killed one."""

import errno
import os
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from tempfile import NamedTemporaryFile

from pneumo.errors import as_lines
from pneumo.regular_file import lock

# A run locks RUN_LOCK; its jobs share the lock JOBS_LOCK.
STATE = Path(".snakemake")
RUN_LOCK, JOBS_LOCK = STATE / "pneumo.run", STATE / "pneumo.jobs"
ROOM = 2_000_000  # bytes for Snakemake's own files
EACH_USER = "each user needs a checkout of their own, on a disk that can be written and has room"


def check_run_folder(checkout: Path) -> None:
    """End the process with exit code 2 and one line on standard error if the study cannot run in this folder.

    The folder must be its `checkout`, with a ``.snakemake`` that this user can write and with room for
    Snakemake's own files. Without this check Snakemake would end in a traceback.
    """
    try:
        if not Path.cwd().samefile(checkout):
            problem = f"{Path.cwd()}: the study runs in its checkout only; leave --directory out"
            _refuse(f"{problem}, or copy {checkout} to where results can be written")
        STATE.mkdir(exist_ok=True)
        with NamedTemporaryFile(dir=STATE) as probe:
            probe.write(bytes(ROOM))
        for folder in filter(Path.is_dir, STATE.iterdir()):  # of another user, perhaps
            if not os.access(folder, os.W_OK | os.X_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
    except OSError as error:
        folder = error.filename if error.filename and Path(error.filename).is_dir() else STATE
        _refuse(f"{folder}: {error.strerror}; {EACH_USER}")


def _refuse(problem: str) -> None:
    print(as_lines(problem), file=sys.stderr)
    sys.exit(2)


def take_run_lock(results: str) -> None:
    """Take the run lock of this folder until this process ends; wait for jobs of a killed run.

    `results` is the folder that the run writes into. Ends the process with exit code 2 and one line on
    standard error if another run holds the lock, or if results cannot be written.
    """
    try:
        Path(results).mkdir(exist_ok=True)
        if not os.access(results, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), results)
        lock(os.open(RUN_LOCK, os.O_RDWR | os.O_CREAT), wait=False)  # open until the process ends
        with JOBS_LOCK.open("a") as jobs:
            try:
                lock(jobs.fileno(), wait=False)
            except BlockingIOError:
                print("pneumo: waiting for a job of a killed run to end", file=sys.stderr)
                lock(jobs.fileno())
    except BlockingIOError:
        _refuse("another run is active in this folder; wait for it or stop it")
    except OSError as error:
        _refuse(f"{error.filename}: {error.strerror}; {EACH_USER}")


@contextmanager
def job_lock() -> Generator[None]:
    """Hold the lock that the jobs of a run share."""
    with JOBS_LOCK.open("a") as jobs:
        lock(jobs.fileno(), shared=True)
        yield
