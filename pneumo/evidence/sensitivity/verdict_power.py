"""Power of the verdict: the items that agree with the paper and no longer do when a known mistake is made.

A mistake in what is run needs the study run again; one of bookkeeping changes the errors of all cells.
"""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment, Plant, Study
from pneumo.configuration.sampling import INTERPOLATED
from pneumo.evidence.experiments_side_by_side import for_each_experiment, side_by_side
from pneumo.evidence.seeds.seed_sets import ERRORS, seed_sets
from pneumo.evidence.sensitivity.alternatives import Alternative, reconfigured
from pneumo.papers.paper_2006.computations import finding_for
from pneumo.papers.paper_2006.results import ComputedResults, StudyResults
from pneumo.simulation.full_order import record
from pneumo.simulation.settling import settle
from pneumo.simulation.signals import PUBLISHED
from pneumo.storage.files import open_grid
from pneumo.storage.grid_layout import replayed_grid
from pneumo.storage.layout import datum_dataset, settling_dataset
from pneumo.verdict.claims import Claim, Claims
from pneumo.verdict.comparison import compare
from pneumo.verdict.sources import MissingEvidence

NO_MISTAKE = "none"


class Rerun(NamedTuple):
    """A mistake in what is run."""

    change: Callable[[Alternative, Mapping[str, Any]], Alternative]  #: from the study and its configuration


def _experiments(change: Callable[[Experiment], Experiment]) -> Rerun:
    """Change every experiment."""
    return Rerun(lambda taken, _: taken._replace(study=taken.study.changed(change)))


def _cylinders(**factors: float) -> Rerun:
    """Multiply properties of every cylinder."""

    def change(p: Plant) -> Plant:
        scaled = {name: factor * getattr(p.cylinder, name) for name, factor in factors.items()}
        return p._replace(cylinder=p.cylinder._replace(**scaled))

    return Rerun(lambda taken, _: taken.with_plants(change))


def _other_seeds(taken: Alternative, _: Mapping[str, Any]) -> Alternative:
    seeds = seed_sets(taken.study, 2)[1]
    return taken._replace(study=taken.study.changed(lambda e: e.with_seed(seeds[e.cylinder])))


def _models(**taken_from: str) -> Callable[[xr.Dataset], xr.Dataset]:
    """Give models the errors of others."""

    def change(grid: xr.Dataset) -> xr.Dataset:
        names = grid["model"].values.tolist()
        others = grid.sel(model=[taken_from.get(name, name) for name in names])
        return others.assign_coords(model=names)

    return change


def _n_shifted(grid: xr.Dataset) -> xr.Dataset:
    """Errors at the next higher n; the highest n keeps its own."""
    last = grid.sizes["n"] - 1
    return grid.isel(n=[min(i + 1, last) for i in range(last + 1)]).assign_coords(n=grid["n"])


MISTAKES: dict[str, Rerun | Callable[[xr.Dataset], xr.Dataset]] = {
    NO_MISTAKE: lambda grid: grid,
    "M + 10 %": _cylinders(M=1.1),
    "k_f + 10 %": _cylinders(k_f=1.1),
    "other seeds": Rerun(_other_seeds),
    "gamma = 1.35": Rerun(lambda _, config: reconfigured(config, {"gas.gamma": 1.35}, "power")),
    "one settling time in place of ten": _experiments(lambda e: e._replace(steps=e.steps // 10)),
    "no leak": _experiments(lambda e: e._replace(push=e.push._replace(leak=0.0))),
    "linear for held": Rerun(lambda taken, _: taken._replace(other_sampling=INTERPOLATED)),
    "M7 and M8 exchanged": _models(M7="M8", M8="M7"),
    "M8 and M9 exchanged": _models(M8="M9", M9="M8"),
    "M9 is M8": _models(M9="M8"),
    "M10 is M8": _models(M10="M8"),
    "n shifted by 0.05": _n_shifted,
    "sign of errors": lambda grid: grid.assign(mean_error=-grid["mean_error"]),
    "MSE x 1.08": lambda grid: grid.assign(
        mean_error=math.sqrt(1.08) * grid["mean_error"], mse=1.08 * grid["mse"]
    ),
}


def rerun_results(folder: Path, alternative: Alternative, threads: int) -> ComputedResults:
    """Results of all experiments run again as an alternative; other runs are read from a folder."""
    study, runs = alternative.study, {}

    def work(e: Experiment) -> xr.Dataset:
        recording = record(e)
        runs["datum", e.name] = datum_dataset(e, recording)
        runs["settling", e.name] = settling_dataset(e, settle(e))
        return replayed_grid(e, study.n, recording, alternative.sampling(e), e.steps)[list(ERRORS)]

    cells = side_by_side(for_each_experiment(study.experiments, work, threads))
    settled = side_by_side({name: runs["settling", name]["settling_time"] for name in study.experiments})
    return ComputedResults(study, PUBLISHED, cells, settled, runs, folder)


def agrees(claim: Claim, claims: Claims, results: StudyResults) -> bool:
    """Whether an item is exact or close."""
    try:
        finding = finding_for(claim, results)
    except (MissingEvidence, KeyError):
        return False
    if any(value is not None and not math.isfinite(value) for value in (finding.value, finding.low)):
        return False
    return compare(claim, claims.classes[claim.tolerance], finding).agreement is not None


def power(
    results: Path, study: Study, configuration: Mapping[str, Any], claims: Claims, threads: int
) -> xr.Dataset:
    """Judge every item under every mistake of `MISTAKES`.

    `agrees`, 1 where the item is exact or close, by (mistake, item), from a folder of results and, for
    mistakes in what is run, from runs with `configuration`, which `study` was made from.
    """
    grid = open_grid(results / PUBLISHED).sel(experiment=list(study.experiments))[list(ERRORS)].load()
    agreeing = np.zeros((len(MISTAKES), len(claims.items)), dtype=np.int8)
    for i, (name, mistake) in enumerate(MISTAKES.items()):
        if isinstance(mistake, Rerun):
            mistaken = rerun_results(results, mistake.change(Alternative(study), configuration), threads)
        else:
            mistaken = ComputedResults(study, PUBLISHED, mistake(grid), folder=results)
        agreeing[i] = [agrees(claim, claims, mistaken) for claim in claims.items.values()]
        print(f"{name}: {agreeing[i].sum()} of {len(claims.items)} items agree", flush=True)
    about = {"units": "1", "long_name": "whether the item is exact or close"}
    coords = {"mistake": list(MISTAKES), "item": list(claims.items)}
    return xr.Dataset({"agrees": (tuple(coords), agreeing, about)}, coords)
