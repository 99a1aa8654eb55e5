"""One run in a folder at a time; a new run waits for jobs of a killed one."""

import errno
import os
import re
import sys
import time
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import NamedTemporaryFile
from uuid import uuid4

from pneumo.errors import DamagedError, as_lines
from pneumo.storage.seal import check_seal, sealed_files

if os.name == "nt":  # no locks there: two runs in one folder are not refused

    def _lock(file: int, *, shared: bool = False, wait: bool = True) -> None:
        """Take no lock."""

else:
    import fcntl

    def _lock(file: int, *, shared: bool = False, wait: bool = True) -> None:
        """Lock an open file until it is closed; BlockingIOError if another process has it, unless `wait`."""
        fcntl.flock(file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | (0 if wait else fcntl.LOCK_NB))


# A run locks RUN_LOCK and writes its name into it; its jobs share the lock JOBS_LOCK. The system releases
# both when a process ends, even when it is killed.
STATE = Path(".snakemake")
RUN_LOCK, JOBS_LOCK = STATE / "pneumo.run", STATE / "pneumo.jobs"
RUN = "PNEUMO_RUN"  # name of the run in the environment of its jobs
ROOM = 2_000_000  # bytes for Snakemake's own files
DATED = ("paper", "pneumo", "workflow")  # folders of files whose times Snakemake compares, beside results


def check_run_folder(checkout: Path) -> None:
    """End the process with exit code 2 and one line on standard error if the study cannot run in this folder.

    The folder must be its `checkout`, with a ``.snakemake`` that this user can write and with room for
    Snakemake's own files. Without this check Snakemake would end in a traceback.
    """
    try:
        if not Path.cwd().samefile(checkout):
            problem = f"{Path.cwd()}: the study runs in its checkout only; leave --directory out"
            sys.exit(_refused(f"{problem}, or copy {checkout} to where results can be written"))
        STATE.mkdir(exist_ok=True)
        with NamedTemporaryFile(dir=STATE) as probe:
            probe.write(bytes(ROOM))
        for folder in filter(Path.is_dir, STATE.iterdir()):  # of another user, perhaps
            if not os.access(folder, os.W_OK | os.X_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
    except OSError as error:
        folder = error.filename if error.filename and Path(error.filename).is_dir() else STATE
        remedy = "each user needs a checkout of their own, on a disk that can be written and has room"
        sys.exit(_refused(f"{folder}: {error.strerror}; {remedy}"))


def _refused(problem: str) -> int:
    """Print a problem as one line on standard error; return the exit code, 2."""
    print(as_lines(problem), file=sys.stderr)
    return 2


def take_run_lock(results: str) -> None:
    """Take the run lock of this folder until this process ends; wait for jobs of a killed run.

    `results` is the folder that the run writes into.

    Ends the process with exit code 2 and one line on standard error if another run holds the lock, or if
    results cannot be written.
    """
    try:
        Path(results).mkdir(exist_ok=True)
        if not os.access(results, os.W_OK):
            raise PermissionError(errno.EACCES, "not writable", results)
        RUN_LOCK.parent.mkdir(exist_ok=True)
        lock = os.open(RUN_LOCK, os.O_RDWR | os.O_CREAT)  # a descriptor: stays open until the process ends
        JOBS_LOCK.open("a").close()
    except OSError as error:
        why = "cannot be written; each user needs a checkout of their own, on a writable disk"
        sys.exit(_refused(f"{error.filename}: {why}"))
    try:
        _lock(lock, wait=False)
    except BlockingIOError:
        sys.exit(_refused("another run is active in this folder; wait for it or stop it"))
    os.environ[RUN] = uuid4().hex
    os.ftruncate(lock, 0)
    os.pwrite(lock, os.environ[RUN].encode(), 0)
    with JOBS_LOCK.open("a") as jobs:
        try:
            _lock(jobs.fileno(), wait=False)
        except BlockingIOError:
            print("pneumo: waiting for a job of a killed run to end", file=sys.stderr)
            _lock(jobs.fileno())
    _warn_about_future_files(results)


def is_dry_run(arguments: Sequence[str]) -> bool:
    """Whether Snakemake's arguments ask for a plan only; while it reads a Snakefile, Snakemake does not say.

    Examples
    --------
    >>> [is_dry_run([word]) for word in ("-n", "-np", "--dry-run", "-j2", "results/seed_sets.nc")]
    [True, True, True, False, False]
    """
    return any(re.fullmatch(r"-[a-z]*n[a-z]*|--dry-?run", argument) for argument in arguments)


def set_damaged_aside(results: str) -> None:
    """Before a run is planned, rename results whose seal is missing or wrong; print a line for each.

    Otherwise the run would be planned with these results, and a job that reads one of them would fail after
    Snakemake has removed the job's good outputs.
    """
    for file in sealed_files(Path(results)):
        try:
            check_seal(file)
        except DamagedError as error:
            aside = file.replace(file.with_name(f"{file.name}.damaged"))
            print(f"pneumo: {error}; now {aside.name}, and made again", file=sys.stderr)
        except OSError as error:
            print(f"pneumo: {file}: {error.strerror}", file=sys.stderr)


@contextmanager
def job_lock() -> Generator[None]:
    """Hold the lock of the run's jobs; end the process if the run was killed and another has begun."""
    with JOBS_LOCK.open("a") as lock:
        _lock(lock.fileno(), shared=True)
        if os.environ.get(RUN) not in (None, RUN_LOCK.read_text(encoding="utf-8")):
            sys.exit("pneumo: the run that started this job was killed, and another has begun")
        yield


def _warn_about_future_files(results: str) -> None:
    """Print one line if files are dated in the future, after the clock was set back.

    Snakemake refuses an output that is older than its input.
    """
    files = [file for folder in (results, *DATED) for file in Path(folder).rglob("*") if file.is_file()]
    newest = max(files, key=lambda file: file.stat().st_mtime, default=None)
    if newest and newest.stat().st_mtime > time.time() + 1:
        remedy = "correct the clock, or `touch` the file, else Snakemake refuses what is made from it"
        print(f"pneumo: {newest}: modified in the future; {remedy}", file=sys.stderr)
