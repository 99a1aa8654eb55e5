"""Observers and controllers with each model, on one plant."""

from pathlib import Path

from pneumo.configuration.parameters import load
from pneumo.configuration.parameters import study as read_configuration
from pneumo.evidence.at_work.plant_at_work import plant_at_work
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, read_study, write


def main(parameters: Path, template: Path, plant: str, number: int, block: Path, code: str) -> None:
    study, template_study = read_study(parameters), read_configuration(load(template))
    both = [*study.experiments.values(), *template_study.experiments.values()]
    open_loop, closed_loop = (next(e for e in both if e.name == name) for name in plant.split("-"))
    errors = plant_at_work(
        open_loop, closed_loop, study.n, number, lambda text: print(f"{plant}: {text}", flush=True)
    )
    about = attributes(
        f"Models at work: experiments {plant}",
        "Errors of observers and controllers with reduced models, on one full-order plant",
        study.config_sha256,
        code,
        template_sha256=template_study.config_sha256,
    )
    write(errors, block, about)


run_job(main, globals())
