"""Ratios of mean square errors with and without a refinement, under other assumptions and other physics.

Runs are cut to `CUT_TO` s, the shortest of Table 6.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment
from pneumo.evidence.experiments_side_by_side import for_each_experiment, side_by_side
from pneumo.evidence.sensitivity.alternatives import Alternative, equal_runs
from pneumo.physics.models import MODELS
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import OK, replay
from pneumo.simulation.signals import STUDY_SAMPLINGS, study_sampling
from pneumo.statistics.averages import OVERALL, along_levels
from pneumo.statistics.model_pairs import REFINED_MODELS, REFINEMENT_PAIRS, pair_ratios
from pneumo.storage.layout import experiment_labels
from pneumo.verdict.assumptions import AS_TAKEN

CUT_TO = 60.0  # s
BOTH_SAMPLINGS = STUDY_SAMPLINGS[::-1]
AVERAGES = ("mean", "geometric mean")  # over experiments


def refined_errors(experiment: Experiment, alternative: Alternative) -> np.ndarray:
    """Mean square error over both chambers, Pa^2, by (transport, model, n); NaN where a cell failed."""
    e, n = experiment, alternative.study.n
    lanes, index = grid_lanes(n, e.plant.gas.gamma)
    rows = index[np.isin(list(MODELS), REFINED_MODELS)].ravel()
    recording = alternative.record(e)
    errors: list[np.ndarray] = []
    for name in BOTH_SAMPLINGS:
        cells = replay(recording, lanes[rows], study_sampling(name, e), e.steps)
        mse = np.where(cells.status == OK, cells.mse, np.nan).mean(axis=1)
        errors.append(mse.reshape(len(REFINED_MODELS), len(n)))
    return np.array(errors)


def errors_by_alternative(name: str, alternatives: Mapping[str, Alternative]) -> xr.Dataset:
    """`mse` of one experiment under every alternative; equal runs are made once."""
    groups = equal_runs(name, alternatives)
    errors: dict[str, np.ndarray] = {}
    for group in groups:
        first = alternatives[group[0]]
        mse = refined_errors(_cut(first.study.experiments[name]), first)
        errors |= dict.fromkeys(group, mse)
    taken = alternatives[AS_TAKEN].study
    print(f"{name}: {len(groups)} full-order runs under {len(alternatives)} alternatives, done", flush=True)
    coords = {"alternative": list(alternatives), "transport": list(BOTH_SAMPLINGS)}
    coords |= {"model": list(REFINED_MODELS), "n": list(taken.n)}
    mse = tuple(coords), np.array([errors[member] for member in alternatives])
    return xr.Dataset({"mse": mse}, coords | experiment_labels(taken.experiments[name]))


def level_scores(mse: xr.DataArray, levels: Mapping[str, Sequence[str]]) -> xr.DataArray:
    """Mean square error of each model, Pa^2, averaged over each level's experiments at the level's best n.

    `mse` is by (experiment, model, n, ...), the result by (level, criterion, model, ...). The level "overall"
    has all experiments, each model with its best n in each of them, as in Table 7. NaN for a level without
    experiments.
    """
    logarithm = xr.DataArray(np.log(mse))

    def both(part: xr.DataArray, logarithms: xr.DataArray) -> xr.DataArray:
        mean = part.mean("experiment", skipna=False)
        geometric = xr.DataArray(np.exp(logarithms.mean("experiment", skipna=False)))
        return xr.concat([mean, geometric], xr.Variable("criterion", list(AVERAGES)))

    scores = {OVERALL: both(mse.min("n"), logarithm.min("n"))}
    for level, names in levels.items():
        inside = np.isin(mse["experiment"], names)
        if inside.any():
            scores[level] = both(mse.sel(experiment=inside), logarithm.sel(experiment=inside)).min("n")
        else:
            scores[level] = xr.full_like(scores[OVERALL], np.nan)
    return along_levels(scores)


def refinement_ratios(mse: xr.DataArray, levels: Mapping[str, Sequence[str]]) -> xr.Dataset:
    """Ratios of mean square error with a refinement to that without, and how often each refinement pays.

    `ratio` by (pair, level, criterion, alternative, transport); by (pair, level, criterion, transport)
    `share`, the fraction of alternatives with a ratio below one, and `counted`, how many have a ratio. The
    study as taken is not counted.
    """
    ratio = pair_ratios(level_scores(mse, levels), REFINEMENT_PAIRS, "pair")
    others = ratio.drop_sel(alternative=AS_TAKEN)
    counted = others.notnull().sum("alternative")
    share = (others < 1).sum("alternative") / counted.where(counted > 0)
    variables = {
        "ratio": (ratio, "mean square error over that of the simpler model"),
        "share": (share, "share of alternatives with a ratio below one"),
        "counted": (counted.astype(np.int32), "alternatives that have a ratio"),
    }
    return xr.Dataset(
        {k: values.assign_attrs(units="1", long_name=name) for k, (values, name) in variables.items()}
    )


def study_variants(alternatives: Mapping[str, Alternative], threads: int = 1) -> xr.Dataset:
    """`mse` by (experiment, alternative, transport, model, n), and its `refinement_ratios`."""
    study = alternatives[AS_TAKEN].study
    parts = for_each_experiment(
        study.experiments, lambda e: errors_by_alternative(e.name, alternatives), threads
    )
    cells = side_by_side(parts)
    return cells.merge(refinement_ratios(cells["mse"], study.experiments_by_level))


def _cut(experiment: Experiment) -> Experiment:
    """Return an experiment whose run lasts at most `CUT_TO` seconds."""
    return experiment._replace(steps=min(experiment.steps, round(CUT_TO / experiment.h)))
