"""Draw the ensemble."""

from pathlib import Path

from pneumo.jobs.wrapper import logged
from pneumo.publish.figures.ensemble_figure import ensemble_figure
from pneumo.publish.style import save
from pneumo.storage.files import read

if job := globals().get("snakemake"):
    with logged(job):
        save(ensemble_figure(read(job.input[0])), Path(job.output[0]).with_suffix(""))
