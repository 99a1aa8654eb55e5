"""Power of the verdict: which items no longer agree with the paper when a known mistake is made.

A mistake in physics or set-up needs the study run again; one of bookkeeping changes the errors of all cells.
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
from pneumo.papers.paper_2006.numbers_of_tables import printed_numbers
from pneumo.papers.paper_2006.results import ComputedResults, StudyResults
from pneumo.papers.paper_2006.summary import EXPERIMENTS
from pneumo.simulation.full_order import record
from pneumo.simulation.settling import settle
from pneumo.simulation.signals import PUBLISHED
from pneumo.storage.files import open_grid
from pneumo.storage.grid_layout import replayed_grid
from pneumo.storage.layout import datum_dataset, described, settling_dataset
from pneumo.verdict.claims import Claim, Claims
from pneumo.verdict.comparison import compare
from pneumo.verdict.power import NO_MISTAKE
from pneumo.verdict.sources import MissingEvidence

LONG_NAMES = {
    "agrees": ("1", "whether the item is exact or close"),
    "number": ("1", "ln of MSE and sigma, mean error (Pa), n, or log10 of a percentile"),
}


class Rerun(NamedTuple):
    """A mistake that needs the study run again."""

    change: Callable[[Alternative, Mapping[str, Any]], Alternative]  #: from the study and its configuration


def _experiments(change: Callable[[Experiment], Experiment]) -> Rerun:
    """Mistake that changes every experiment."""
    return Rerun(lambda taken, _: taken._replace(study=taken.study.changed(change)))


def _cylinders(**factors: float) -> Rerun:
    """Mistake that multiplies properties of every cylinder by factors."""

    def change(p: Plant) -> Plant:
        scaled = {name: factor * getattr(p.cylinder, name) for name, factor in factors.items()}
        return p._replace(cylinder=p.cylinder._replace(**scaled))

    return Rerun(lambda taken, _: taken.with_plants(change))


def _other_seeds(taken: Alternative, _: Mapping[str, Any]) -> Alternative:
    seeds = seed_sets(taken.study, 2)[1]
    return taken._replace(study=taken.study.changed(lambda e: e.with_seed(seeds[e.cylinder])))


def _taken_from(dimension: str, sources: Mapping[str, str]) -> Callable[[xr.Dataset], xr.Dataset]:
    """Mistake that gives each key of `sources` (a model, experiment or chamber) the errors of its value."""

    def change(grid: xr.Dataset) -> xr.Dataset:
        names = grid[dimension].values.tolist()
        others = grid.sel({dimension: [sources.get(name, name) for name in names]})
        return others.assign_coords({dimension: names})

    return change


def _models(**sources: str) -> Callable[[xr.Dataset], xr.Dataset]:
    return _taken_from("model", sources)


def _within_k_0(*order: int) -> Callable[[xr.Dataset], xr.Dataset]:
    """Mistake that permutes the errors of the four experiments of each k_0.

    `order` has, for D open, D closed, E open and E closed, the position of the one whose errors it gets.
    """
    fours = [EXPERIMENTS[first : first + 4] for first in range(0, len(EXPERIMENTS), 4)]
    sources = {name: four[i] for four in fours for name, i in zip(four, order, strict=True)}
    return _taken_from("experiment", sources)


def _scaled(factor: float) -> Callable[[xr.Dataset], xr.Dataset]:
    """Multiply every mean square error."""
    root = math.sqrt(factor)
    return lambda grid: grid.assign(mean_error=root * grid["mean_error"], mse=factor * grid["mse"])


def _sigma_scaled(factor: float) -> Callable[[xr.Dataset], xr.Dataset]:
    """Multiply the standard deviation of every run's error; its mean stays."""

    def change(grid: xr.Dataset) -> xr.Dataset:
        square = grid["mean_error"] ** 2
        return grid.assign(mse=square + factor**2 * (grid["mse"] - square))

    return change


def _shifted(offset: float) -> Callable[[xr.Dataset], xr.Dataset]:
    """Add a number of pascals to every error."""

    def change(grid: xr.Dataset) -> xr.Dataset:
        mse = grid["mse"] + 2 * offset * grid["mean_error"] + offset**2
        return grid.assign(mean_error=grid["mean_error"] + offset, mse=mse)

    return change


def _n_shifted(steps: int) -> Callable[[xr.Dataset], xr.Dataset]:
    """Give each n the errors of the n some steps above it; beyond the ends, those of the last one."""

    def change(grid: xr.Dataset) -> xr.Dataset:
        last = grid.sizes["n"] - 1
        moved_to = [min(max(i + steps, 0), last) for i in range(last + 1)]
        return grid.isel(n=moved_to).assign_coords(n=grid["n"])

    return change


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
    "n shifted by 0.05": _n_shifted(1),
    "n shifted by -0.05": _n_shifted(-1),
    "sign of errors": lambda grid: grid.assign(mean_error=-grid["mean_error"]),
    "MSE x 1.08": _scaled(1.08),
    "MSE x 1.05": _scaled(1.05),
    "MSE x 1.02": _scaled(1.02),
    "sigma x 1.05": _sigma_scaled(1.05),
    "mu + 50 Pa": _shifted(50.0),
    "A and B exchanged": _taken_from("chamber", {"A": "B", "B": "A"}),
    "D and E exchanged": _within_k_0(2, 3, 0, 1),
    "loops exchanged": _within_k_0(1, 0, 3, 2),
    "experiments of a level cycled": _within_k_0(1, 2, 3, 0),
    "E05 and E07 exchanged": _taken_from("experiment", {"E05": "E07", "E07": "E05"}),
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

    Returns `agrees`, 1 where the item is exact or close, by (mistake, item), and `number`, the numbers of
    `numbers_of_tables`, by (mistake, of). Errors are read from the folder `results`; for mistakes that need
    it, the study is run again from `configuration`, from which `study` was made.
    """
    grid = open_grid(results / PUBLISHED).sel(experiment=list(study.experiments))[list(ERRORS)].load()
    agreeing = np.zeros((len(MISTAKES), len(claims.items)), dtype=np.int8)
    numbers: list[np.ndarray] = []
    for i, (name, mistake) in enumerate(MISTAKES.items()):
        if isinstance(mistake, Rerun):
            mistaken = rerun_results(results, mistake.change(Alternative(study), configuration), threads)
        else:
            mistaken = ComputedResults(study, PUBLISHED, mistake(grid), folder=results)
        agreeing[i] = [agrees(claim, claims, mistaken) for claim in claims.items.values()]
        numbers.append(mistaken.numbers)
        print(f"{name}: {agreeing[i].sum()} of {len(claims.items)} items agree", flush=True)
    coords = {"mistake": list(MISTAKES), "item": list(claims.items), "of": printed_numbers().index.tolist()}
    variables = {"agrees": (("mistake", "item"), agreeing), "number": (("mistake", "of"), np.stack(numbers))}
    return described(xr.Dataset(variables, coords), LONG_NAMES)
