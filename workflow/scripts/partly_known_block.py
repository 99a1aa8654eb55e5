"""Observers and controllers of one plant that they know in part only."""

from pathlib import Path

from pneumo.configuration.parameters import load
from pneumo.configuration.parameters import study as read
from pneumo.evidence.at_work.partly_known import STICK_SLIP, PartlyKnown, partly_known_plant
from pneumo.evidence.at_work.plant_at_work import full_force
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, read_study, write


def main(
    parameters: Path, template: Path, plant: str, experiments: str, number: int, block: Path, code: str
) -> None:
    study, template_study = read_study(parameters), read(load(template))
    both = {e.name: e for e in [*study.experiments.values(), *template_study.experiments.values()]}
    open_loop, closed_loop = (both[name] for name in experiments.split("-"))
    hidden = STICK_SLIP * full_force(closed_loop.plant) if plant == "stick-slip" else 0.0
    known = PartlyKnown(open_loop, closed_loop, hidden, plant == "sagging-supply")
    cells = partly_known_plant(known, study.n, number, lambda text: print(f"{plant}: {text}", flush=True))
    title = f"Models at work on a plant that is known in part: {plant}"
    words = "Errors of observers and controllers with reduced models and the full order"
    template_sha256 = template_study.config_sha256
    about = attributes(title, words, study.config_sha256, code, template_sha256=template_sha256)
    write(cells, block, about)


run_job(main, globals())
