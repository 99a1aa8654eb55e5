"""A tree that says which model to take, grown on some random cylinders and judged on others."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from pneumo.evidence.dimensionless import GROUPS, MEASURED
from pneumo.evidence.random_cylinders import SIZES
from pneumo.evidence.regimes import (
    CHEAPEST_FIRST,
    CRITERIA,
    GOOD,
    LOOPS,
    RATIOS,
    comparisons,
    of_quotient,
    thirds,
)
from pneumo.evidence.tree import grown, leaves, places
from pneumo.statistics.ranking import MATERIAL


class Cases:
    """Runs that count, one after another, of some cylinders.

    Attributes
    ----------
    groups : dict of str to numpy.ndarray
        Each of shape (cases,).
    logs : numpy.ndarray
        Natural logarithm of the error over the best model's, shape (cases, model of GOOD, n).
    answer, cylinder : numpy.ndarray
        Shape (cases,).
    """

    def __init__(self, runs: xr.Dataset, names: Mapping[str, str]):
        flat: Any = runs.stack(case=("cylinder", "loop"))
        flat = flat.isel(case=np.flatnonzero(flat["counts"].values == 1))
        self.groups = {name: flat[name].values.astype(float) for name in names}
        mse = flat["mse"].sel(model=list(GOOD)).transpose("case", "model", "n").values
        self.logs = np.log(mse) - np.log(np.nanmin(mse, axis=(1, 2)))[:, None, None]
        self.answer = flat["answer"].values.astype(str)
        self.cylinder = flat["cylinder"].values
        self.n = flat["n"].values

    def best_n(self, model: str, cases: np.ndarray) -> float:
        """The n of the lowest geometric mean error over some cases; one at which a case failed never."""
        logs = self.logs[cases, GOOD.index(model)].sum(axis=0)
        return float(self.n[np.nan_to_num(logs, nan=np.inf).argmin()])

    def leaf(self, cases: np.ndarray) -> dict[str, Any]:
        """Make a leaf of some cases: most frequent answer, its n, and how the answers are spread."""
        counted = {name: int((self.answer[cases] == name).sum()) for name in CHEAPEST_FIRST}
        model = max(counted, key=lambda name: counted[name])
        return {"model": model, "n": self.best_n(model, cases), "runs": len(cases), "answers": counted}

    def loss(self, model: str, n: float) -> np.ndarray:
        """Logarithm of a model's error at one n over the best model's at its own, by case."""
        return self.logs[:, GOOD.index(model), int(np.abs(self.n - n).argmin())]

    def loss_at_best_n(self, model: str) -> np.ndarray:
        """The same with the model at its own best n too."""
        return np.nanmin(self.logs[:, GOOD.index(model)], axis=1)

    def over_cylinders(self, values: np.ndarray) -> tuple[float, float, float]:
        """Mean over cases with its interval over cylinders."""
        _, number = np.unique(self.cylinder, return_inverse=True)
        return of_quotient(np.bincount(number, values), np.bincount(number))


def rounded(values: Sequence[float] | np.ndarray, digits: int = 3) -> list[float]:
    """Value and interval as they are printed."""
    return [float(f"{value:.{digits}g}") for value in values]


def score(cases: Cases, models: np.ndarray, n: np.ndarray) -> dict[str, list[float]]:
    """How good answers are: share that is right, and what they cost.

    Returns
    -------
    dict
        ``right``, share; ``cost``, geometric mean of the error at the given n over the best model's at its
        own; ``cost_at_best_n``, the same where n is chosen in hindsight too; with intervals over cylinders.
    """
    loss, fitted = np.empty((2, len(cases.answer)))
    for model, value in {*zip(models.tolist(), n.tolist(), strict=True)}:
        chosen = (models == model) & (n == value)
        loss[chosen] = cases.loss(model, value)[chosen]
        fitted[chosen] = cases.loss_at_best_n(model)[chosen]
    right = cases.over_cylinders((cases.answer == models).astype(float))
    return {
        "right": rounded(right),
        "cost": rounded(np.exp(cases.over_cylinders(loss))),
        "cost_at_best_n": rounded(np.exp(cases.over_cylinders(fitted))),
    }


def scored_tree(tree: Mapping[str, Any], cases: Cases) -> dict[str, list[float]]:
    """`score` of a tree's answers."""
    place, ends = places(tree, cases.groups), [leaf for _, leaf in leaves(tree)]
    answers, n = (np.array([end[key] for end in ends])[place] for key in ("model", "n"))
    return score(cases, answers, n)


def scored_leaves(tree: Mapping[str, Any], cases: Cases) -> None:
    """Write into each leaf how it did on cases held out: runs, share right, cost."""
    place = places(tree, cases.groups)
    for number, (_, leaf) in enumerate(leaves(tree)):
        inside = place == number
        loss = cases.loss(leaf["model"], leaf["n"])[inside]
        fitted = cases.loss_at_best_n(leaf["model"])[inside]
        leaf["held_out"] = {
            "runs": int(inside.sum()),
            "right": int((cases.answer[inside] == leaf["model"]).sum()),
            "cost": rounded(np.exp(loss.mean(keepdims=True)))[0] if inside.any() else None,
            "cost_90_percent": rounded(np.exp(np.quantile(loss, [0.9])))[0] if inside.any() else None,
            "cost_at_best_n": rounded(np.exp(fitted.mean(keepdims=True)))[0] if inside.any() else None,
        }


def recommendation(runs: xr.Dataset) -> dict[str, Any]:
    """The tree with everything that is known of it, as plain data.

    Parameters
    ----------
    runs : xarray.Dataset
        From `judged`.
    """
    first, last = (runs.sel(cylinder=runs["held_out"] == held) for held in (0, 1))
    trained, held_out = Cases(first, GROUPS), Cases(last, GROUPS)
    tree = grown(trained.groups, trained.answer, trained.leaf)
    scored_leaves(tree, held_out)
    everything = np.arange(len(trained.answer))
    majority = trained.leaf(everything)
    always = {name: trained.best_n(name, everything) for name in GOOD}

    def constant(model: str) -> dict[str, Any]:
        of = len(held_out.answer)
        return {"n": always[model], **score(held_out, np.full(of, model), np.full(of, always[model]))}

    seen = Cases(first, MEASURED)
    seen_tree = grown(seen.groups, seen.answer, seen.leaf)
    values = {name: runs[name].where(runs["counts"] == 1) for name in GROUPS}
    ends = {name: rounded(np.array([value.min(), value.max()])) for name, value in values.items()}
    sizes = {name: rounded(np.array([runs[name].min(), runs[name].max()])) for name in SIZES}
    return {
        "decision": "paper/decisions/0029-random-cylinders.md",
        "transport": "exact",
        "within": 1 + MATERIAL,
        "cylinders": {"trained": first.sizes["cylinder"], "held_out": last.sizes["cylinder"]},
        "runs": {"trained": len(trained.answer), "held_out": len(held_out.answer)},
        "failed_runs": int((runs["counts"] == 0).sum()),
        "tree": tree,
        "score": {
            "tree": scored_tree(tree, held_out),
            "tree, on its own runs": scored_tree(tree, trained),
            "tree of groups seen in the run": scored_tree(seen_tree, Cases(last, MEASURED)),
            "majority": {"model": majority["model"], **constant(majority["model"])},
            **{f"always {name}": constant(name) for name in GOOD},
        },
        "groups": {name: {"meaning": GROUPS[name], "range": ends[name]} for name in GROUPS},
        "sizes": sizes,
    }


def compared(runs: xr.Dataset) -> dict[str, Any]:
    """Ratios and shares of `comparisons` as plain data: value and interval, by loop."""
    found, result = comparisons(runs), {}
    for loop in LOOPS:
        own = found.sel(loop_of=loop)
        result[loop] = {
            "cylinders": int(own["cylinders"]),
            "ratio": {
                pair: {c: rounded(own["ratio"].sel(pair=pair, criterion=c).values) for c in CRITERIA}
                for pair in RATIOS
            },
            "share": {
                str(name): rounded(own["share"].sel(statement=name).values)
                for name in own["statement"].values
            },
        }
    return result


def by_thirds(runs: xr.Dataset, group: str) -> list[dict[str, Any]]:
    """Geometric mean ratios in the lowest, middle and highest third of a group as plain data."""
    found, result = thirds(runs, [group]).sel(group=group), []
    for third in found["third"].values:
        own = found.sel(third=third)
        result.append(
            {
                "from": rounded([own["third_from"].item()])[0],
                "to": rounded([own["third_to"].item()])[0],
                "ratio": {pair: rounded(own["third_ratio"].sel(pair=pair).values) for pair in RATIOS},
            }
        )
    return result


def recommendation_text(runs: xr.Dataset) -> str:
    """`recommendation`, `compared` and `by_thirds` of the air exchanged as JSON."""
    found = recommendation(runs) | {
        "compared": compared(runs),
        "by_exchange": by_thirds(runs, "exchange"),
    }
    return json.dumps(found, indent=1, allow_nan=False) + "\n"
