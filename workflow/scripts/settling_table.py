"""Collect the settling times of all experiments and check the durations against them."""

from pathlib import Path

from pneumo.configuration.exchange import from_json
from pneumo.jobs.wrapper import logged
from pneumo.statistics.settling_times import settling_table
from pneumo.storage.files import read, read_json, write


def main(parameters: str, runs: list[str], output: str, code: str) -> None:
    study = from_json(read_json(parameters))
    durations = {name: e.steps * e.h for name, e in study.experiments.items()}
    parts = {Path(run).stem: read(run, "settling_time", "failure_time") for run in runs}
    attributes = {
        "title": "Settling times",
        "summary": "Table 5 as reproduced, and how many settling times each full-order run lasts",
        "config_sha256": study.config_sha256,
        "code_sha256": code,
    }
    write(settling_table(parts, durations), output, attributes)


if job := globals().get("snakemake"):
    with logged(job):
        files, code = job.input, job.params.code
        main(files.parameters, list(files.runs), job.output[0], code)
