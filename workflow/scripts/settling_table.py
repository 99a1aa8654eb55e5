"""Collect the settling times of all experiments and check the durations against them."""

from pathlib import Path

from pneumo.jobs.wrapper import run_job
from pneumo.statistics.settling_times import settling_table
from pneumo.storage.files import attributes, read, read_study, write


def main(parameters: Path, runs: list[Path], table: Path, code: str) -> None:
    study = read_study(parameters)
    durations = {name: e.duration for name, e in study.experiments.items()}
    parts = {run.stem: read(run, "settling_time", "failure_time") for run in runs}
    summary = "Table 5 as reproduced, and how many settling times each full-order run lasts"
    about = attributes("Settling times", summary, study.config_sha256, code)
    write(settling_table(parts, durations), table, about)


run_job(main, globals())
