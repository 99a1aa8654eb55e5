"""One run in a folder at a time; a new run waits for jobs of a killed one."""

import errno
import fcntl
import json
import os
import re
import shutil
import sys
import time
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import NamedTemporaryFile
from uuid import uuid4

from pneumo.errors import DamagedError, as_lines
from pneumo.storage.seal import check_seal, sealed_files

# A run locks RUN_LOCK and writes its name into it; its jobs share the lock JOBS_LOCK. The system releases
# both when a process ends, even when it is killed.
STATE = Path(".snakemake")
RUN_LOCK, JOBS_LOCK = STATE / "pneumo.run", STATE / "pneumo.jobs"
RUN = "PNEUMO_RUN"  # name of the run in the environment of its jobs
RESULTS = Path("results")
KEPT_ASIDE = Path("results-of")  # folder of the results of configurations that are not the run's
STUDY = STATE / "pneumo.study"  # names the configuration that results/ is of
METADATA = STATE / "metadata"  # what Snakemake knows about the files in results/
STAYS = "README.md"
PAPER = "paper"  # name of the paper's study
NO_RUN = re.compile(
    r"--(lint|report|summary|detailed-summary|list.*|dag|rulegraph|filegraph|unlock|archive|touch|delete.*)"
)
ROOM = 2_000_000  # bytes for Snakemake's own files
DATED = ("results", "paper", "pneumo", "workflow")  # folders of files whose times Snakemake compares


def check_run_folder(checkout: Path) -> None:
    """End the process with one line unless the study can run here, where Snakemake would end in a traceback.

    It runs in its `checkout` only, with room for Snakemake's own files in a ``.snakemake`` that this user can
    write.
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
    """Print the line, and return the exit code."""
    print(as_lines(problem), file=sys.stderr)
    return 2


def take_run_lock() -> None:
    """Take the run lock of this folder until this process ends; wait for jobs of a killed run.

    Ends the process with exit code 2 and one line on standard error if another run holds the lock, or if
    results cannot be written.
    """
    try:
        RESULTS.mkdir(exist_ok=True)
        if not os.access(RESULTS, os.W_OK):
            raise PermissionError(errno.EACCES, "not writable", RESULTS)
        RUN_LOCK.parent.mkdir(exist_ok=True)
        lock = os.open(RUN_LOCK, os.O_RDWR | os.O_CREAT)  # a descriptor: stays open until the process ends
        JOBS_LOCK.open("a").close()
    except OSError as error:
        why = "cannot be written; each user needs a checkout of their own, on a writable disk"
        sys.exit(_refused(f"{error.filename}: {why}"))
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        sys.exit(_refused("another run is active in this folder; wait for it or stop it"))
    os.environ[RUN] = uuid4().hex
    os.ftruncate(lock, 0)
    os.pwrite(lock, os.environ[RUN].encode(), 0)
    with JOBS_LOCK.open("a") as jobs:
        try:
            fcntl.flock(jobs, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            print("pneumo: waiting for a job of a killed run to end", file=sys.stderr)
            fcntl.flock(jobs, fcntl.LOCK_EX)
    _warn_about_future_files()


def is_dry_run(arguments: Sequence[str]) -> bool:
    """Whether Snakemake's arguments ask for a plan only; when a Snakefile is read, it does not tell.

    Examples
    --------
    >>> [is_dry_run([word]) for word in ("-n", "-np", "--dry-run", "-j2", "results/seed_sets.nc")]
    [True, True, True, False, False]
    """
    return any(re.fullmatch(r"-[a-z]*n[a-z]*|--dry-?run", argument) for argument in arguments)


def configuration_name(name: str, files: Sequence[Path]) -> str:
    """Return the name of a run's configuration: the study's, or its files' where these give none.

    Examples
    --------
    >>> configuration_name("paper", []), configuration_name("warmer", [Path("my.yaml")])
    ('paper', 'warmer')
    >>> configuration_name("paper", [Path("config/my.yaml")])
    'my'
    """
    own = "+".join(Path(file).stem for file in files)
    return re.sub(r"[^\w+-]", "_", (own or name) if name == PAPER else name)


def take_results_of(configuration: str, arguments: Sequence[str]) -> None:
    """Let results/ be those of a configuration, before a run of it is planned.

    Results of another one move to `KEPT_ASIDE`, with what Snakemake knows about them, and come back when it
    runs again. Nothing moves where Snakemake's arguments ask for no run, or while another run is active.
    """
    if is_dry_run(arguments) or any(map(NO_RUN.fullmatch, arguments)):
        return
    before = _configuration_of_results()
    STATE.mkdir(exist_ok=True)
    with RUN_LOCK.open("a") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return  # `take_run_lock` will say so
        if before not in (None, configuration):
            _move(RESULTS, METADATA, KEPT_ASIDE / before, KEPT_ASIDE / before / METADATA.name)
            print(f"pneumo: results of {before} are in {KEPT_ASIDE / before} now", file=sys.stderr)
            kept = KEPT_ASIDE / configuration
            if kept.is_dir():
                _move(kept, kept / METADATA.name, RESULTS, METADATA)
                kept.rmdir()
        STUDY.write_text(configuration, encoding="utf-8")


def _configuration_of_results() -> str | None:
    """Name of the configuration that results/ is of; None if there is none."""
    try:
        named = json.loads((RESULTS / "parameters.json").read_text(encoding="utf-8"))["name"]
    except (OSError, ValueError, LookupError, TypeError):
        named = None
    if STUDY.is_file() and any(file.name != STAYS for file in RESULTS.glob("*")):
        return STUDY.read_text(encoding="utf-8")
    return named


def _move(results: Path, metadata: Path, to: Path, metadata_to: Path) -> None:
    """Move all results but the page that describes them, and Snakemake's notes about them."""
    to.mkdir(parents=True, exist_ok=True)
    if metadata.is_dir():
        if metadata_to.is_dir():
            shutil.rmtree(metadata_to)
        metadata.rename(metadata_to)
    for file in list(results.iterdir()):
        if file not in (metadata, metadata_to, results / STAYS):
            file.rename(to / file.name)


def set_damaged_aside() -> None:
    """Rename results whose seal is missing or wrong, with a line for each, before a run is planned.

    Else the run would be planned with them, and a job that reads one would fail after Snakemake has removed
    the job's good outputs.
    """
    for file in sealed_files(RESULTS):
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
        fcntl.flock(lock, fcntl.LOCK_SH)
        if os.environ.get(RUN) not in (None, RUN_LOCK.read_text(encoding="utf-8")):
            sys.exit("pneumo: the run that started this job was killed, and another has begun")
        yield


def _warn_about_future_files() -> None:
    """Print one line if files are dated in the future, after the clock was set back.

    Snakemake refuses an output that is older than its input.
    """
    files = [file for folder in DATED for file in Path(folder).rglob("*") if file.is_file()]
    newest = max(files, key=lambda file: file.stat().st_mtime, default=None)
    if newest and newest.stat().st_mtime > time.time() + 1:
        remedy = "correct the clock, or `touch` the file, else Snakemake refuses what is made from it"
        print(f"pneumo: {newest}: modified in the future; {remedy}", file=sys.stderr)
