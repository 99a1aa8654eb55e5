"""Identify what the paper leaves open: M, k_f, stop, amplitudes and transport."""

from pneumo.configuration.exchange import from_json
from pneumo.evidence.identification import SEED, identify, save_identification
from pneumo.jobs.wrapper import logged
from pneumo.storage.files import read_json


def main(parameters: str, output: str, threads: int) -> None:
    study = from_json(read_json(parameters))
    found = identify(study, ["D", "E"], SEED, threads, lambda text: print(text, flush=True))
    save_identification(found, study, SEED, output)


if job := globals().get("snakemake"):
    with logged(job):
        main(job.input.parameters, job.output[0], job.threads)
