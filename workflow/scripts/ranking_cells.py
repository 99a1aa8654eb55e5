"""Run every experiment of one cylinder with its seeds, and replay every model on each run."""

from pathlib import Path
from typing import Any

from pneumo.configuration.uncertain import Uncertain
from pneumo.jobs.wrapper import run_job
from pneumo.selection.cylinder_ranking import run_study, save_cells, selected
from pneumo.storage.files import read_study


def main(parameters: Path, cylinder: str, known: list[Any], cells: Path, threads: int) -> None:
    study = selected(read_study(parameters), cylinders=[cylinder])
    save_cells(study, run_study(study, threads, uncertain={cylinder: Uncertain(*known)}), cells)


run_job(main, globals())
