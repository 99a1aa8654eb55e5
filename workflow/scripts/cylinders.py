"""Random cylinders compared, the tree grown from them, and the map."""

from pathlib import Path

import xarray as xr

from pneumo.evidence.recommended import recommendation_text
from pneumo.evidence.regimes import analysed, judged
from pneumo.jobs.wrapper import logged
from pneumo.publish.figures.regimes_figure import regimes
from pneumo.publish.style import save
from pneumo.storage.files import read, read_json, write, write_json


def main(blocks: list[str], trained: int, cells: str, tree: str, figure: str, code: str) -> None:
    parts: list[xr.Dataset] = [read(block) for block in blocks]
    runs = judged(xr.concat(parts, "cylinder"), trained)
    attributes = {
        "title": "Random cylinders: in which regime each refinement pays",
        "summary": "Groups and lowest errors of each run, pairs of models compared, shares with intervals",
        "config_sha256": "none: cylinders are drawn in pneumo.evidence.random_cylinders",
        "code_sha256": code,
    }
    write(analysed(runs), cells, attributes)
    write_json(recommendation_text(runs), tree)
    save(regimes(read(cells), read_json(tree)), Path(figure).with_suffix(""))


if job := globals().get("snakemake"):
    with logged(job):
        o, p = job.output, job.params
        main(list(job.input), p.trained, o.cells, o.tree, o.figure[0], p.code)
