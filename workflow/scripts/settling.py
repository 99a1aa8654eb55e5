"""Estimate the settling times of every experiment."""

from pathlib import Path

from pneumo.configuration.exchange import from_json
from pneumo.jobs.wrapper import logged
from pneumo.simulation.settling import settle
from pneumo.storage.files import attributes_of, read_json, write
from pneumo.storage.layout import settling_dataset


def main(parameters: str, outputs: list[str], code: str) -> None:
    study = from_json(read_json(parameters))
    for output in outputs:
        experiment = study.experiments[Path(output).stem]
        attributes = {
            "title": f"Settling-time run of {experiment.name}",
            "summary": "Piston pushed onto an end stop, held until still, released; Fig. 7 and Table 5",
            "experiment_parameters": attributes_of(experiment),
            "config_sha256": study.config_sha256,
            "code_sha256": code,
        }
        write(settling_dataset(experiment, settle(experiment)), output, attributes)
        print(f"{experiment.name}: settling-time run, done", flush=True)


if job := globals().get("snakemake"):
    with logged(job):
        main(job.input[0], list(job.output), job.params.code)
