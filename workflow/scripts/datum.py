"""Run the full-order system of every experiment."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from pneumo.configuration.exchange import from_json
from pneumo.configuration.experiment import Experiment, Study
from pneumo.jobs.wrapper import logged
from pneumo.simulation.full_order import Recording, record
from pneumo.storage.files import attributes_of, read_json, write
from pneumo.storage.layout import datum_dataset, failure_text


def main(parameters: str, outputs: list[str], code: str) -> None:
    study = from_json(read_json(parameters))
    experiments = [study.experiments[Path(output).stem] for output in outputs]
    # The kernel holds no lock: the next runs are computed while one is written.
    with ThreadPoolExecutor(1) as ahead:
        recordings = ahead.map(record, experiments)
        for output, experiment, recording in zip(outputs, experiments, recordings, strict=True):
            save(study, experiment, recording, output, code)


def save(study: Study, experiment: Experiment, recording: Recording, output: str, code: str) -> None:
    """Write one run and say how it went."""
    attributes = {
        "title": f"Full-order run of {experiment.name}",
        "summary": "Every step of the sixth-order model, eqs (3) to (8), against which models are judged",
        "experiment_parameters": attributes_of(experiment),
        "config_sha256": study.config_sha256,
        "code_sha256": code,
    }
    dataset = datum_dataset(experiment, recording)
    write(dataset, output, attributes)
    print(f"{experiment.name}: full-order run, {experiment.steps * experiment.h:g} s, done", flush=True)
    if dataset["status"]:
        print(f"{experiment.name}: {failure_text(dataset)}", flush=True)


if job := globals().get("snakemake"):
    with logged(job):
        main(job.input[0], list(job.output), job.params.code)
