"""Run every experiment of one cylinder with its seeds, and replay every model on each run."""

from pathlib import Path

from pneumo.configuration.exchange import from_json
from pneumo.engineer.own_study import run_study, save_cells, selected
from pneumo.jobs.wrapper import logged
from pneumo.storage.files import read_json


def main(parameters: str, output: str, threads: int) -> None:
    study = selected(from_json(read_json(parameters)), cylinders=[Path(output).stem])
    save_cells(study, run_study(study, threads), Path(output))


if job := globals().get("snakemake"):
    with logged(job):
        main(job.input[0], job.output[0], job.threads)
