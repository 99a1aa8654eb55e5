"""Split every cell's error into the model's, the signal transport's and the step's."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import xarray as xr

from pneumo.configuration.experiment import Experiment
from pneumo.evidence.error_budget import REFERENCE_SLICE, SLICE, budget, described, summary
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import EXPERIMENT_LABELS, attributes, read_study, write


def main(parameters: Path, budgets: Path, threads: int, code: str) -> None:
    study = read_study(parameters)

    def budget_of(experiment: Experiment) -> xr.Dataset:
        part = budget(experiment, study.n, study.lag)
        print(f"{experiment.name}: error budget, done", flush=True)
        return part

    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(budget_of, study.experiments.values()))
    cells = xr.concat(parts, "experiment", coords=list(EXPERIMENT_LABELS), compat="equals")
    about = attributes(
        "Error budget of the reduced models",
        "Model, signal-transport and discretisation error of every cell, from t = 0",
        study.config_sha256,
        code,
        slice_s=SLICE,
        reference_slice_s=REFERENCE_SLICE,
        lag_s=study.lag,
    )
    write(described(cells.merge(summary(cells, study.experiments_by_level))), budgets, about)


run_job(main, globals())
