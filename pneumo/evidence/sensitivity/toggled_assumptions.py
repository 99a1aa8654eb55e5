"""Every cell of Tables 5, 7, 8 and 9 under each alternative reading of the paper."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment
from pneumo.configuration.sampling import Sampling
from pneumo.evidence.experiments_side_by_side import for_each_experiment, side_by_side
from pneumo.evidence.seeds.seed_sets import ERRORS
from pneumo.evidence.sensitivity.alternatives import Alternative, equal_runs
from pneumo.papers.paper_2006.computations import finding_for
from pneumo.papers.paper_2006.results import ComputedResults, StudyResults
from pneumo.simulation.full_order import RAN
from pneumo.simulation.settling import QUANTITIES, Settling, settle
from pneumo.simulation.signals import PUBLISHED
from pneumo.storage.grid_layout import replayed_grid
from pneumo.storage.layout import experiment_labels
from pneumo.verdict.claims import Claim
from pneumo.verdict.sources import MissingEvidence

TOGGLED_TABLES = (5, 7, 8, 9)
LONGEST_SETTLING = 3000.0  # s; twice what a settling run of the study takes; a longer one has no time


class ToggledRun(NamedTuple):
    """One experiment under one alternative: every cell of the grid, and the settling times."""

    cells: xr.Dataset
    times: xr.DataArray


def toggled_runs(experiment: Experiment, alternatives: Mapping[str, Alternative]) -> dict[str, ToggledRun]:
    """Run one experiment under every alternative; equal runs and replays are made once."""
    name = experiment.name
    groups = equal_runs(name, alternatives)
    cells: dict[str, xr.Dataset] = {}
    replays = 0
    for group in groups:
        first = alternatives[group[0]]
        recording = first.record(first.study.experiments[name])
        by_sampling: dict[Sampling, xr.Dataset] = {}
        for member in group:
            alternative = alternatives[member]
            e = alternative.study.experiments[name]
            sampling = alternative.sampling(e)
            if sampling not in by_sampling:
                grid = replayed_grid(e, alternative.study.n, recording, sampling, e.steps)
                by_sampling[sampling] = grid[list(ERRORS)]
            cells[member] = by_sampling[sampling]
        replays += len(by_sampling)

    settled: dict[Any, Settling] = {}
    times: dict[str, xr.DataArray] = {}
    for member, alternative in alternatives.items():
        e = alternative.study.experiments[name]
        key = e.plant, e.drive, e.push, e.h
        if key not in settled:
            settled[key] = settle(e, longest=LONGEST_SETTLING)
        settling = settled[key]
        values = alternative.times(settling, e.h) if settling.status == RAN else settling.times
        coords = {"quantity": list(QUANTITIES)} | experiment_labels(e)
        times[member] = xr.DataArray(values, coords, ("quantity",), "settling_time")
    counts = f"{len(groups)} full-order runs, {replays} replays, {len(settled)} settling runs"
    print(f"{name}: {counts}, done", flush=True)
    return {member: ToggledRun(cells[member], times[member]) for member in alternatives}


def reproduced(claim: Claim, results: StudyResults) -> float:
    """Number that a claim's computation finds in some results; NaN if there is none."""
    try:
        value = finding_for(claim, results).value
    except MissingEvidence:
        value = None
    return np.nan if value is None else value


def toggled_tables(
    alternatives: Mapping[str, Alternative], claims: Mapping[str, Claim], threads: int = 1
) -> xr.Dataset:
    """Every cell of Tables 5, 7, 8 and 9 under every alternative, all of the same experiments.

    `reproduced` by (alternative, item), each in its item's unit, NaN where there is no number; claims of
    other tables are passed over.
    """
    items = {name: claim for name, claim in claims.items() if claim.table in TOGGLED_TABLES}
    experiments = next(iter(alternatives.values())).study.experiments
    runs = for_each_experiment(experiments, lambda e: toggled_runs(e, alternatives), threads)
    values = np.empty((len(alternatives), len(items)))
    for i, (name, alternative) in enumerate(alternatives.items()):
        cells = side_by_side({experiment: toggled[name].cells for experiment, toggled in runs.items()})
        cells["mean_error"] = alternative.sign * cells["mean_error"]
        times = side_by_side({experiment: toggled[name].times for experiment, toggled in runs.items()})
        results = ComputedResults(alternative.study, PUBLISHED, cells, times, ddof=alternative.ddof)
        values[i] = [reproduced(claim, results) for claim in items.values()]
    attributes = {"units": "1", "long_name": "reproduced value, in the unit of its item"}
    coords = {"alternative": list(alternatives), "item": list(items)}
    return xr.Dataset({"reproduced": (tuple(coords), values, attributes)}, coords)
