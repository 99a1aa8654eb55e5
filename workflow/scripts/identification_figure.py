"""Draw what was identified."""

from pathlib import Path

from pneumo.jobs.wrapper import logged
from pneumo.publish.figures.identification_figure import identification
from pneumo.publish.style import save
from pneumo.storage.files import read


def main(found: str, figure: str) -> None:
    save(identification(read(found)), Path(figure).with_suffix(""))


if job := globals().get("snakemake"):
    with logged(job):
        main(job.input[0], job.output[0])
