"""Fit a block of random cylinders with known truth."""

from pneumo.evidence.fit_coverage import coverage
from pneumo.jobs.wrapper import logged
from pneumo.storage.files import write

ABOUT = {
    "title": "Coverage of the intervals of pneumo fit",
    "summary": "Random cylinders with noisy sensors: truth, estimates, intervals, errors held out",
    "config_sha256": "none: cylinders are drawn in pneumo.evidence.synthetic_records",
}


def main(output: str, first: int, count: int, code: str) -> None:
    found = coverage(range(first, first + count), lambda text: print(text, flush=True))
    write(found, output, ABOUT | {"code_sha256": code})


if job := globals().get("snakemake"):
    with logged(job):
        main(job.output[0], int(job.wildcards.first), job.params.cases, job.params.code)
