"""Rank the models on each cylinder and write the page."""

from collections.abc import Sequence

from pneumo.configuration.exchange import from_json
from pneumo.engineer.own_study import joined, rankings
from pneumo.jobs.wrapper import logged
from pneumo.publish.pages.study_page import render
from pneumo.storage.files import read, read_json, write_text


def main(parameters: str, cells: Sequence[str], output: str) -> None:
    study = from_json(read_json(parameters))
    together = joined([read(file) for file in cells])
    write_text(render(study, together, rankings(together)), output)


if job := globals().get("snakemake"):
    with logged(job):
        main(job.input.parameters, list(job.input.cells), job.output[0])
