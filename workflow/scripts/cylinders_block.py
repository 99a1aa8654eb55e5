"""Run a block of random cylinders, each in open and in closed loop, with the whole grid."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import xarray as xr

from pneumo.evidence.random_cylinders.cylinder_runs import cylinder_cells
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, write


def main(block: Path, numbers: list[int], threads: int, code: str) -> None:
    def cells_of(number: int) -> xr.Dataset:
        cells = cylinder_cells(number)
        print(f"cylinder {number}: done", flush=True)
        return cells

    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(cells_of, numbers))
    about = attributes(
        f"Random cylinders {numbers[0]} to {numbers[-1]}",
        "Errors of the whole grid, exact signals, and dimensionless groups of each run",
        "none: cylinders are drawn in pneumo.evidence.random_cylinders.random_plants",
        code,
    )
    write(xr.concat(parts, xr.Variable("cylinder", numbers)), block, about)


run_job(main, globals())
