"""The study's grid with other seeds: every experiment, both transports, errors but no pressures."""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment, Study
from pneumo.simulation.full_order import record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.simulation.signals import EXACT, PUBLISHED, study_transport
from pneumo.storage.grid_layout import replay_dataset

TRANSPORTS = (PUBLISHED, EXACT)
ENTROPY = 2006  # of the seeds that are drawn
KEPT = ["mean_error", "mse", "failure_time"]


def seed_sets(study: Study, count: int) -> list[dict[str, int]]:
    """Seeds of every cylinder: the configuration's own first, then others, drawn once and for all.

    Neighbouring seeds will not do: the generator's states for 1, 2, 3 are multiples of one another.
    """
    own = {e.cylinder: e.excitation.seed for e in study.experiments.values()}
    drawn = np.random.SeedSequence(ENTROPY).generate_state((count - 1) * len(own)).reshape(-1, len(own))
    return [own, *(dict(zip(own, map(int, seeds), strict=True)) for seeds in drawn)]


def _errors(study: Study, experiment: Experiment) -> xr.Dataset:
    """Every cell's error by (transport, model, n, chamber)."""
    recording = record(experiment)
    lanes, index = grid_lanes(study.n, experiment.plant.gas.gamma)
    parts: list[xr.Dataset] = []
    for transport in TRANSPORTS:
        reading = study_transport(transport, study.lag, experiment.h)
        cells = replay(recording, lanes, reading, experiment.steps)
        parts.append(replay_dataset(experiment, study.n, index, cells)[KEPT])
    return xr.concat(parts, xr.Variable("transport", list(TRANSPORTS)))


def with_seeds(study: Study, seeds: Mapping[str, int], threads: int) -> xr.Dataset:
    """Run the whole grid with the given seeds.

    Parameters
    ----------
    study : Study
    seeds : mapping of str to int
        Seed of each cylinder.
    threads : int
        The result does not depend on it.

    Returns
    -------
    xarray.Dataset
        `mean_error`, Pa, `mse`, Pa^2, and `failure_time`, s, by (transport, experiment, model, n, chamber).
    """

    def work(experiment: Experiment) -> xr.Dataset:
        excitation = experiment.excitation._replace(seed=seeds[experiment.cylinder])
        return _errors(study, experiment._replace(excitation=excitation))

    longest_first = sorted(study.experiments.values(), key=lambda e: -e.steps)
    with ThreadPoolExecutor(threads) as pool:
        found = dict(zip((e.name for e in longest_first), pool.map(work, longest_first), strict=True))
    labels = ["experiment", "cylinder", "loop", "k_0"]
    return xr.concat(
        [found[name] for name in study.experiments], "experiment", coords=labels, compat="equals"
    )
