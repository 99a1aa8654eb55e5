"""Split every cell's error into the model's, the signal transport's and the step's."""

from concurrent.futures import ThreadPoolExecutor

import xarray as xr

from pneumo.configuration.exchange import from_json
from pneumo.configuration.experiment import Experiment
from pneumo.evidence.error_budget import REFERENCE_SLICE, SLICE, budget, described, summary
from pneumo.jobs.wrapper import logged
from pneumo.storage.files import EXPERIMENT_LABELS, read_json, write


def main(parameters: str, output: str, threads: int, code: str) -> None:
    study = from_json(read_json(parameters))

    def one(experiment: Experiment) -> xr.Dataset:
        part = budget(experiment, study.n, study.lag)
        print(f"{experiment.name}: error budget, done", flush=True)
        return part

    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(one, study.experiments.values()))
    cells = xr.concat(parts, "experiment", coords=list(EXPERIMENT_LABELS), compat="equals")
    attributes = {
        "title": "Error budget of the reduced models",
        "summary": "Model, signal-transport and discretisation error of every cell, from t = 0",
        "slice_s": SLICE,
        "reference_slice_s": REFERENCE_SLICE,
        "lag_s": study.lag,
        "config_sha256": study.config_sha256,
        "code_sha256": code,
    }
    write(described(cells.merge(summary(cells, study.experiments_by_level))), output, attributes)


if job := globals().get("snakemake"):
    with logged(job):
        main(job.input[0], job.output[0], job.threads, job.params.code)
