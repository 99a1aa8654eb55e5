"""Measure the error that reading samples adds to replays, and compare it with theory."""

from pathlib import Path

from pneumo.errors import ResultError
from pneumo.evidence.experiments_side_by_side import for_each_experiment, side_by_side
from pneumo.evidence.signal_sampling import measured_floor as floor
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, read_study, write


def main(parameters: Path, floors: Path, threads: int, code: str) -> None:
    study = read_study(parameters)
    experiments = {name: e for name, e in study.experiments.items() if name in floor.FLOOR_EXPERIMENTS}
    if not experiments:
        raise ResultError(f"{parameters}: has none of {', '.join(floor.FLOOR_EXPERIMENTS)}")
    parts = for_each_experiment(experiments, floor.measured_floor, threads, "floor of signal sampling")
    about = attributes(
        "Error floor of signal sampling",
        "RMS pressure error of replays on sampled signals, measured and predicted",
        study.config_sha256,
        code,
        step_s=next(iter(experiments.values())).h / floor.FLOOR_REFINEMENT,
        sweep_s=floor.SWEEP,
    )
    write(floor.with_floor_attributes(side_by_side(parts)), floors, about)


run_job(main, globals())
