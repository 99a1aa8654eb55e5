"""What every workflow script does around its work."""

import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pneumo.store import ResultError


@contextmanager
def logged(job: Any) -> Iterator[None]:
    """Write to the job's log how long its work took, or what stopped it.

    An error that the user can mend is also one line on standard error, and the exit code is 2.

    Parameters
    ----------
    job : snakemake.script.Snakemake
    """
    start = time.perf_counter()
    log = Path(job.log[0])
    try:
        yield
    except (ResultError, ArithmeticError) as error:
        log.write_text(f"{error}\n", encoding="utf-8")
        print(f"pneumo: {error}", file=sys.stderr)
        sys.exit(2)
    except BaseException:
        log.write_text(traceback.format_exc(), encoding="utf-8")
        raise
    log.write_text(f"{job.rule}: {time.perf_counter() - start:.2f} s\n", encoding="utf-8")
