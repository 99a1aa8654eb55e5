"""Run every experiment of one cylinder with its seeds, and replay every model on each run."""

from pathlib import Path
from typing import Any

from pneumo.configuration.experiment import Study
from pneumo.configuration.priors import Uncertain
from pneumo.selection.cylinder_ranking import run_study, save_cells, selected
from workflow.jobs.wrapper import run_job


def main(study: Study, cylinder: str, known: list[Any], cells: Path, threads: int) -> None:
    chosen = selected(study, cylinders=[cylinder])
    save_cells(chosen, run_study(chosen, threads, uncertain={cylinder: Uncertain(*known)}), cells)


run_job(main, globals())
