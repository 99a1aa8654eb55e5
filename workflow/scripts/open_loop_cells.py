"""Run the open loops with each setup of paper/decisions/0062."""

from pathlib import Path

from pneumo.evidence.identification.open_loop_cells import open_loop_cells
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, read_study, write


def main(parameters: Path, cells: Path, threads: int, code: str) -> None:
    study = read_study(parameters)
    errors = open_loop_cells(study, threads, lambda text: print(text, flush=True))
    title = "Errors of the models with each setup of the open loops"
    summary = "Mean and mean square of every cell's error by setup; setups as in paper/decisions/0062"
    write(errors, cells, attributes(title, summary, study.config_sha256, code))


run_job(main, globals())
