"""The study's grid with other seeds: errors of every experiment, published and exact signals."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment, Study
from pneumo.evidence.experiments_side_by_side import for_each_experiment, side_by_side
from pneumo.simulation.full_order import record
from pneumo.simulation.signals import STUDY_SAMPLINGS, study_sampling
from pneumo.statistics.averages import concatenated
from pneumo.storage.files import read
from pneumo.storage.grid_layout import replayed_grid

SEEDS_SEED = 2006  # of the seeds that are drawn
ERRORS = ("mean_error", "mse", "failure_time")  # of each cell, as far as tables need them


def seed_sets(study: Study, count: int) -> list[dict[str, int]]:
    """Seeds of every cylinder: those of the configuration first, then others, always the same.

    Neighbouring seeds would not be independent: the generator's states for 1, 2, 3 are multiples of one
    another.
    """
    configured = {e.cylinder: e.excitation.seed for e in study.experiments.values()}
    drawn = np.random.SeedSequence(SEEDS_SEED).generate_state((count - 1) * len(configured))
    rows = drawn.reshape(-1, len(configured))
    return [configured, *(dict(zip(configured, map(int, row), strict=True)) for row in rows)]


def with_seeds(study: Study, seeds: Mapping[str, int], threads: int) -> xr.Dataset:
    """Run the whole grid with the given seed of each cylinder; the result does not depend on `threads`.

    `mean_error`, Pa, `mse`, Pa^2, and `failure_time`, s, by (transport, experiment, model, n, chamber).
    """

    def work(experiment: Experiment) -> xr.Dataset:
        e = experiment.with_seed(seeds[experiment.cylinder])
        recording, samplings = record(e), [study_sampling(name, e) for name in STUDY_SAMPLINGS]
        parts = [replayed_grid(e, study.n, recording, s, e.steps)[list(ERRORS)] for s in samplings]
        return xr.concat(parts, xr.Variable("transport", list(STUDY_SAMPLINGS)))

    return side_by_side(for_each_experiment(study.experiments, work, threads))


def both_chambers(cells: xr.Dataset) -> xr.Dataset:
    """Errors of both chambers together, as those of one chamber "AB", from the result of `with_seeds`."""
    joined = concatenated(cells)[["mean_error", "mse"]]
    joined["failure_time"] = cells["failure_time"].max("chamber")
    return joined.expand_dims(chamber=["AB"], axis=-1)


def joined_seed_sets(blocks: Sequence[xr.Dataset]) -> xr.Dataset:
    """Join blocks of seed sets, from `both_chambers`, with seeds as last dimension: files compress best."""
    return xr.concat(blocks, "seeds").sortby("seeds").transpose(..., "seeds")


def read_seed_sets(file: Path) -> xr.Dataset:
    """Read the errors of all seed sets by (seeds, ...); a file holds five digits."""
    return read(file).transpose("seeds", ...).astype(float)
