"""Estimate the settling times of every experiment, and check the durations against them."""

from pathlib import Path

from paper.study.settling_run import settle, settling_dataset
from paper.study.settling_times import settling_table
from pneumo.configuration.experiment import Study
from pneumo.storage.files import attributes, read, write
from workflow.jobs.wrapper import run_job


def main(study: Study, runs: list[Path], table: Path) -> None:
    summary = "Piston pushed onto an end stop, held until still, released; Fig. 7 and Table 5"
    for run in runs:
        e = study.experiments[run.stem]
        about = attributes(f"Settling-time run of {e.name}", summary, study.config_sha256, e)
        write(settling_dataset(e, settle(e)), run, about)
        print(f"{e.name}: settling-time run, done", flush=True)
    durations = {name: e.duration for name, e in study.experiments.items()}
    parts = {run.stem: read(run, "settling_time", "failure_time") for run in runs}
    summary = "Table 5 as reproduced, and how many settling times each full-order run lasts"
    about = attributes("Settling times", summary, study.config_sha256)
    write(settling_table(parts, durations), table, about)


run_job(main, globals())
