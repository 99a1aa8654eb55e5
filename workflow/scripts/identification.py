"""Identify what the paper leaves open: M, k_f, stop, amplitudes and transport."""

from pathlib import Path

from pneumo.assess.identify import SEED, identify, save_identification
from pneumo.job import logged
from pneumo.physics.exchange import from_json


def main(parameters: str, output: str, threads: int) -> None:
    study = from_json(Path(parameters).read_text())
    found = identify(study, ["D", "E"], SEED, threads, lambda text: print(text, flush=True))
    save_identification(found, study, SEED, output)


if job := globals().get("snakemake"):
    with logged(job):
        main(job.input.parameters, job.output[0], job.threads)
