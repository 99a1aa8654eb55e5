"""What every workflow script does around its work."""

import errno
import fcntl
import os
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from pneumo.errors import DamagedError, PneumoError

# A run holds the first alone for as long as it lives, and writes its name into it; each of its jobs holds
# the second with the others. The kernel lets go of both when a process ends, however it ends.
RUN_LOCK, JOBS_LOCK = Path(".snakemake/pneumo.run"), Path(".snakemake/pneumo.jobs")
RUN = "PNEUMO_RUN"  # name of the run in the environment of its jobs
DISK = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)  # full, or not to be written


@contextmanager
def of_this_run() -> Iterator[None]:
    """Keep the next run waiting until this job ends; end at once if the next has begun already."""
    with JOBS_LOCK.open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_SH)
        if os.environ.get(RUN) not in (None, RUN_LOCK.read_text(encoding="utf-8")):
            sys.exit("pneumo: the run that started this job was killed, and another has begun")
        yield


@contextmanager
def logged(job: Any) -> Iterator[None]:
    """Write to the job's log how long its work took, or what stopped it.

    An error that the user can mend is also one line on standard error, and the exit code is 2. A damaged
    file that the job was to read is removed, so that the next run makes it again.

    Parameters
    ----------
    job : snakemake.script.Snakemake
    """
    start = time.perf_counter()
    log = Path(job.log[0])
    try:
        with of_this_run():
            yield
    except BaseException as error:
        mendable = isinstance(error, PneumoError) or getattr(error, "errno", 0) in DISK
        text = " ".join(str(error).split())
        if isinstance(error, DamagedError):
            error.path.unlink(missing_ok=True)
            text += "; removed, the next run makes it again"
        with suppress(OSError):  # the disk may be full
            log.write_text(f"{text}\n" if mendable else traceback.format_exc(), encoding="utf-8")
        if not mendable:
            raise
        print(f"pneumo: {text}", file=sys.stderr)
        sys.exit(2)
    log.write_text(f"{job.rule}: {time.perf_counter() - start:.2f} s\n", encoding="utf-8")
