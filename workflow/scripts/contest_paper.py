"""The full order in the contest on the paper's experiments, each by itself."""

from pathlib import Path

import numpy as np
import xarray as xr

from pneumo.evidence.random_cylinders.full_order_contest import SIMULATION_SEED, contest_run
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, read_study, write

DURATION = 60.0  # s of each experiment, from its start


def main(parameters: Path, runs: Path, code: str) -> None:
    study = read_study(parameters)
    seeds = np.random.default_rng(SIMULATION_SEED).integers(1, 2**31, len(study.experiments))
    parts = [
        contest_run(e._replace(steps=min(e.steps, round(DURATION / e.h))), int(seed))
        for e, seed in zip(study.experiments.values(), seeds, strict=True)
    ]
    title = "The full order in the contest: the paper's experiments"
    words = "Errors of every row of decision 75, by what it is told beforehand"
    about = attributes(title, words, study.config_sha256, code)
    write(xr.concat(parts, xr.Variable("experiment", list(study.experiments))), runs, about, digits=4)


run_job(main, globals())
