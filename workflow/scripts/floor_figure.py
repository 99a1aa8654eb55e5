"""Draw the floor of signal transport."""

from pathlib import Path

from pneumo.jobs.wrapper import logged
from pneumo.publish.figures.floor_figure import floor
from pneumo.publish.style import save
from pneumo.storage.files import read

if job := globals().get("snakemake"):
    with logged(job):
        save(floor(read(job.input[0])), Path(job.output[0]).with_suffix(""))
