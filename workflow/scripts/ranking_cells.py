"""Run every experiment of one cylinder with its seeds, and replay every model on each run."""

from pathlib import Path

from pneumo.jobs.wrapper import run_job
from pneumo.selection.cylinder_ranking import run_study, save_cells, selected
from pneumo.storage.files import read_study


def main(parameters: Path, cylinder: str, k_0_factor: float, cells: Path, threads: int) -> None:
    study = selected(read_study(parameters), cylinders=[cylinder])
    save_cells(study, run_study(study, threads, k_0_factors={cylinder: k_0_factor}), cells)


run_job(main, globals())
