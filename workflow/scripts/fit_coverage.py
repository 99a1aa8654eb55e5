"""Fit random cylinders with known truth: do intervals hold it, and which model predicts best."""

from concurrent.futures import ThreadPoolExecutor

from pneumo.apply.coverage import CASES, coverage, summary
from pneumo.job import logged
from pneumo.store import write, write_text


def main(output: str, table: str, threads: int, code: str, cases: int = CASES) -> None:
    with ThreadPoolExecutor(threads) as pool:
        found = coverage(cases, pool.map, lambda text: print(text, flush=True))
    attributes = {
        "title": "Coverage of the intervals of pneumo fit",
        "summary": "Random cylinders with noisy sensors: truth, estimates, intervals, errors held out",
        "config_sha256": "none: cylinders are drawn in pneumo.apply.synthetic",
        "code_sha256": code,
    }
    write(found, output, attributes)
    write_text(summary(found), table)


if job := globals().get("snakemake"):
    with logged(job):
        main(job.output.cells, job.output.table, job.threads, job.params.code)
