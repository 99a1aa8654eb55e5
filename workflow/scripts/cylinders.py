"""Models compared over random cylinders, and the map."""

from pathlib import Path

import xarray as xr

from pneumo.evidence.regimes import analysed, judged
from pneumo.jobs.wrapper import logged
from pneumo.publish.figures.regimes_figure import regime_map
from pneumo.publish.style import save
from pneumo.storage.files import read, write


def main(blocks: list[str], compared: int, cells: str, figure: str, code: str) -> None:
    parts: list[xr.Dataset] = [read(block) for block in blocks]
    attributes = {
        "title": "Random cylinders: in which regime each refinement pays",
        "summary": "Groups and lowest errors of each run, pairs of models compared, shares with intervals",
        "config_sha256": "none: cylinders are drawn in pneumo.evidence.random_cylinders",
        "code_sha256": code,
    }
    write(analysed(judged(xr.concat(parts, "cylinder"), compared)), cells, attributes)
    save(regime_map(read(cells)), Path(figure).with_suffix(""))


if job := globals().get("snakemake"):
    with logged(job):
        o, p = job.output, job.params
        main(list(job.input), p.compared, o.cells, o.figure[0], p.code)
