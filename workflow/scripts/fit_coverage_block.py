"""Fit a block of random cylinders with known truth."""

from pathlib import Path

from pneumo.evidence.fit_coverage.interval_coverage import coverage
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, write


def main(block: Path, first: str, cases: int, code: str) -> None:
    cases_fitted = coverage(range(int(first), int(first) + cases), lambda text: print(text, flush=True))
    about = attributes(
        "Coverage of the intervals of pneumo fit",
        "Random cylinders with noisy sensors: truth, estimates, intervals, errors held out",
        "none: cylinders are drawn in pneumo.evidence.fit_coverage.synthetic_records",
        code,
    )
    write(cases_fitted, block, about)


run_job(main, globals())
