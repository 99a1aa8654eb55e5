"""The full order and the reduced models on a block of random cylinders, with what each is told beforehand."""

from pathlib import Path

import xarray as xr

from pneumo.evidence.random_cylinders.full_order_contest import contest_cells
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, write


def main(block: Path, numbers: list[int], code: str) -> None:
    parts = [contest_cells(number) for number in numbers]
    about = attributes(
        f"The full order in the contest: random cylinders {numbers[0]} to {numbers[-1]}",
        "Errors of every row of decision 75, by what it is told beforehand",
        "none: cylinders are drawn in pneumo.evidence.random_cylinders.random_plants",
        code,
    )
    write(xr.concat(parts, xr.Variable("cylinder", numbers)), block, about, digits=4)


run_job(main, globals())
