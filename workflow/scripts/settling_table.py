"""Collect the settling times of all experiments and check the durations against them."""

from pathlib import Path

from pneumo.assess.statistics import settling_table
from pneumo.physics.parameters import from_json
from pneumo.store import read, write


def main(parameters: str, runs: list[str], output: str, code: str) -> None:
    study = from_json(Path(parameters).read_text())
    durations = {name: e.steps * e.h for name, e in study.experiments.items()}
    parts = {Path(run).stem: read(run, "settling_time") for run in runs}
    attributes = {
        "title": "Settling times",
        "summary": "Table 5 as reproduced, and how many settling times each full-order run lasts",
        "config_sha256": study.config_sha256,
        "code_sha256": code,
    }
    write(settling_table(parts, durations), output, attributes)


if __name__ == "__main__":
    files, code = snakemake.input, snakemake.params.code  # noqa: F821
    main(files.parameters, list(files.runs), snakemake.output[0], code)  # noqa: F821
