"""Measure the floor of error that signal transport leaves, beside what theory says."""

from concurrent.futures import ThreadPoolExecutor

import xarray as xr

from pneumo.configuration.exchange import from_json
from pneumo.configuration.experiment import Experiment
from pneumo.errors import ResultError
from pneumo.evidence.measured_floor import EXPERIMENTS, FINE, SWEEP, described, measure
from pneumo.jobs.wrapper import logged
from pneumo.storage.files import EXPERIMENT_LABELS, read_json, write


def main(parameters: str, output: str, threads: int, code: str) -> None:
    study = from_json(read_json(parameters))
    chosen = [e for name, e in study.experiments.items() if name in EXPERIMENTS]
    if not chosen:
        raise ResultError(f"{parameters}: has none of {', '.join(EXPERIMENTS)}, whose floor is measured")

    def one(experiment: Experiment) -> xr.Dataset:
        part = measure(experiment)
        print(f"{experiment.name}: floor of signal transport, done", flush=True)
        return part

    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(one, chosen))
    dataset = xr.concat(parts, "experiment", coords=list(EXPERIMENT_LABELS), compat="equals")
    attributes = {
        "title": "Floor of error that signal transport leaves",
        "summary": "RMS pressure error of replays on sampled signals, measured and predicted",
        "step_s": chosen[0].h / FINE,
        "sweep_s": SWEEP,
        "config_sha256": study.config_sha256,
        "code_sha256": code,
    }
    write(described(dataset), output, attributes)


if job := globals().get("snakemake"):
    with logged(job):
        main(job.input[0], job.output[0], job.threads, job.params.code)
