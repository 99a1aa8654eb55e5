"""Measure the floor of error that signal transport leaves, beside what theory says."""

from pathlib import Path

import xarray as xr

from pneumo.configuration.experiment import Experiment
from pneumo.errors import ResultError
from pneumo.evidence.experiments_side_by_side import for_each_experiment, side_by_side
from pneumo.evidence.measured_floor import (
    FLOOR_EXPERIMENTS,
    FLOOR_REFINEMENT,
    SWEEP,
    measured_floor,
    with_floor_attributes,
)
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, read_study, write


def main(parameters: Path, floors: Path, threads: int, code: str) -> None:
    study = read_study(parameters)
    experiments = {name: e for name, e in study.experiments.items() if name in FLOOR_EXPERIMENTS}
    if not experiments:
        names = ", ".join(FLOOR_EXPERIMENTS)
        raise ResultError(f"{parameters}: has none of {names}, whose floor is measured")

    def floor_of(experiment: Experiment) -> xr.Dataset:
        part = measured_floor(experiment)
        print(f"{experiment.name}: floor of signal transport, done", flush=True)
        return part

    floors_of_all = side_by_side(for_each_experiment(experiments, floor_of, threads))
    about = attributes(
        "Floor of error that signal transport leaves",
        "RMS pressure error of replays on sampled signals, measured and predicted",
        study.config_sha256,
        code,
        step_s=next(iter(experiments.values())).h / FLOOR_REFINEMENT,
        sweep_s=SWEEP,
    )
    write(with_floor_attributes(floors_of_all), floors, about)


run_job(main, globals())
