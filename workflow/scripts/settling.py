"""Estimate the settling times of every experiment."""

from pathlib import Path

from pneumo.jobs.wrapper import run_job
from pneumo.simulation.settling import settle
from pneumo.storage.files import attributes, read_study, write
from pneumo.storage.layout import settling_dataset


def main(parameters: Path, runs: list[Path], code: str) -> None:
    study = read_study(parameters)
    summary = "Piston pushed onto an end stop, held until still, released; Fig. 7 and Table 5"
    for run in runs:
        e = study.experiments[run.stem]
        about = attributes(f"Settling-time run of {e.name}", summary, study.config_sha256, code, e)
        write(settling_dataset(e, settle(e)), run, about)
        print(f"{e.name}: settling-time run, done", flush=True)


run_job(main, globals())
