"""Draw the error budget."""

from pathlib import Path

from pneumo.jobs.wrapper import logged
from pneumo.publish.figures.budget_figure import error_budget
from pneumo.publish.style import save
from pneumo.storage.files import read

if job := globals().get("snakemake"):
    with logged(job):
        save(error_budget(read(job.input[0])), Path(job.output[0]).with_suffix(""))
