"""Statements about models whose answer turns with another limit, without one experiment, or like for like.

Statements are judged as in `findings`, with exact signals over all sets of seeds.
"""

from collections.abc import Callable
from math import log10

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Study
from pneumo.evidence.seeds.findings import over_seed_sets
from pneumo.papers.paper_2006.results import ComputedResults
from pneumo.simulation.signals import EXACT
from pneumo.statistics.intervals import fraction_interval
from pneumo.verdict.claims import Claims
from pneumo.verdict.sources import MissingEvidence

OTHER_LIMITS = (1.15, 1.41)  # of a quotient of mean square errors, beside that of the class "decade"
LIKE_FOR_LIKE = "S4.walls_before_mixing"  # compares the worst of four models; M6 with M7 is like for like


def _results(study: Study, cells: xr.Dataset) -> list[ComputedResults]:
    return [ComputedResults(study, EXACT, cells.sel(seeds=seeds)) for seeds in cells["seeds"].values]


def _without(study: Study, name: str) -> Study:
    return study._replace(experiments={key: e for key, e in study.experiments.items() if key != name})


def _like_for_like(results: list[ComputedResults], level: str) -> bool | None:
    """Whether wall heat reduces the error more than mixing, both added to the same model: M6 above M7.

    None if the interval over seed sets contains one half.
    """
    by_model = [result.statistics["mse"].sel(level=level) for result in results]
    holds = sum(bool(mse.sel(model="M6") > mse.sel(model="M7")) for mse in by_model)
    share = fraction_interval(holds, len(results))
    return True if share.low > 0.5 else False if share.high < 0.5 else None


def dependences(
    study: Study,
    cells: xr.Dataset,
    claims: Claims,
    progress: Callable[[str], None] = lambda _text: None,
) -> dict[str, list[str]]:
    """Changes that turn the answer of each statement: another limit, one experiment left out, like for like.

    `cells` are the sets of seeds with exact signals. A statement that nothing turns has an empty list.
    """
    about = [claim for claim in claims.items.values() if claim.about_models]
    every = _results(study, cells)
    stands, turned = dict[str, bool | None](), dict[str, list[str]]()
    for claim in about:
        try:
            stands[claim.id] = over_seed_sets(claim, claims, every).stands
        except MissingEvidence:  # in a part of the study
            continue
        turned[claim.id] = []
    about = [claim for claim in about if claim.id in stands]
    for limit in OTHER_LIMITS:
        decade = claims.classes["decade"].model_copy(update={"limit": log10(limit)})
        other = claims._replace(classes={**claims.classes, "decade": decade})
        for claim in about:
            if claim.tolerance == "decade" and over_seed_sets(claim, other, every).stands != stands[claim.id]:
                turned[claim.id].append(f"a limit of {limit:g}")
    for claim in about:
        if claim.id == LIKE_FOR_LIKE and _like_for_like(every, claim.arguments["level"]) != stands[claim.id]:
            turned[claim.id].append("like for like")
    for name in study.experiments:
        rest = _without(study, name)
        if not rest.experiments:
            continue
        left = _results(rest, cells.sel(experiment=np.setdiff1d(cells["experiment"].values, [name])))
        for claim in about:
            try:
                other_stands = over_seed_sets(claim, claims, left).stands
            except (MissingEvidence, KeyError):  # a level that only this experiment has
                continue
            if other_stands != stands[claim.id]:
                turned[claim.id].append(f"{name} left out")
        progress(f"{name} left out: done")
    return turned
