"""Run a block of random cylinders, each in open and in closed loop, with the whole grid."""

from concurrent.futures import ThreadPoolExecutor

import xarray as xr

from pneumo.evidence.random_cylinders import cylinder_cells
from pneumo.jobs.wrapper import logged
from pneumo.storage.files import write


def main(output: str, numbers: list[int], threads: int, code: str) -> None:
    def one(number: int) -> xr.Dataset:
        found = cylinder_cells(number)
        print(f"cylinder {number}: done", flush=True)
        return found

    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(one, numbers))
    attributes = {
        "title": f"Random cylinders {numbers[0]} to {numbers[-1]}",
        "summary": "Errors of the whole grid, exact transport, and dimensionless groups of each run",
        "config_sha256": "none: cylinders are drawn in pneumo.evidence.random_cylinders",
        "code_sha256": code,
    }
    write(xr.concat(parts, xr.Variable("cylinder", numbers)), output, attributes)


if job := globals().get("snakemake"):
    with logged(job):
        p = job.params
        main(job.output[0], list(p.numbers), job.threads, p.code)
