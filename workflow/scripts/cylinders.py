"""Models compared over random cylinders."""

from pathlib import Path

import xarray as xr

from pneumo.evidence.random_cylinders.direct_rule import direct_rule
from pneumo.evidence.random_cylinders.regimes import regime_statistics, with_answers
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, read, write


def main(blocks: list[Path], compared: int, cells: Path, code: str) -> None:
    parts: list[xr.Dataset] = [read(block) for block in blocks]
    about = attributes(
        "Random cylinders: in which regime each refinement pays",
        "Groups and lowest errors of each run, pairs of models compared, one direct rule; to four digits",
        "none: cylinders are drawn in pneumo.evidence.random_cylinders.random_plants",
        code,
    )
    runs = with_answers(xr.concat(parts, "cylinder"), compared)
    write(regime_statistics(runs).merge(direct_rule(runs)), cells, about, digits=4)


run_job(main, globals())
