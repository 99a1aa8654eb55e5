"""Measure the floor of error that signal transport leaves, beside what theory says."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import xarray as xr

from pneumo.configuration.experiment import Experiment
from pneumo.errors import ResultError
from pneumo.evidence.measured_floor import EXPERIMENTS, FINE, SWEEP, described, measure
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import EXPERIMENT_LABELS, attributes, read_study, write


def main(parameters: Path, floors: Path, threads: int, code: str) -> None:
    study = read_study(parameters)
    experiments = [e for name, e in study.experiments.items() if name in EXPERIMENTS]
    if not experiments:
        raise ResultError(f"{parameters}: has none of {', '.join(EXPERIMENTS)}, whose floor is measured")

    def floor_of(experiment: Experiment) -> xr.Dataset:
        part = measure(experiment)
        print(f"{experiment.name}: floor of signal transport, done", flush=True)
        return part

    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(floor_of, experiments))
    about = attributes(
        "Floor of error that signal transport leaves",
        "RMS pressure error of replays on sampled signals, measured and predicted",
        study.config_sha256,
        code,
        step_s=experiments[0].h / FINE,
        sweep_s=SWEEP,
    )
    dataset = xr.concat(parts, "experiment", coords=list(EXPERIMENT_LABELS), compat="equals")
    write(described(dataset), floors, about)


run_job(main, globals())
