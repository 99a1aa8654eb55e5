"""Direct rule for the choice of a model, fitted on half of the random cylinders and judged on the others.

Below a threshold of the thermal time constant over the time between reversals it takes one model, above it
another: paper/decisions/0057.
"""

import numpy as np
import xarray as xr

from pneumo.evidence.random_cylinders.regimes import INTERVAL
from pneumo.statistics.intervals import quotient_interval
from pneumo.statistics.model_pairs import REFINED_MODELS
from pneumo.storage.layout import described

GROUP = "thermal"
ALWAYS = "M8"
PERCENTILES = np.arange(1, 100)


def _halves(runs: xr.Dataset) -> list[tuple[np.ndarray, np.ndarray]]:
    """Group and ln(error over the best model's) of the fitted runs, then of the held-out runs.

    Shapes (cylinder, loop) and (cylinder, loop, model); NaN where a run does not count.
    """
    good = runs["lowest"].sel(model=list(REFINED_MODELS)).where(runs["counts"] == 1)
    over_best = good / good.min("model")
    logs = np.log(over_best.transpose("cylinder", "loop", "model").values)
    group = runs[GROUP].transpose("cylinder", "loop").values
    return [(group[held_out], logs[held_out]) for held_out in (runs["held_out"].values == i for i in (0, 1))]


def direct_rule(runs: xr.Dataset) -> xr.Dataset:
    """Fit the rule on one half of the cylinders, and judge it on the half held out.

    `runs` are from `pneumo.evidence.random_cylinders.regimes.with_answers`. Returns `rule_threshold`, of the
    group; `rule_model`, the models below and from the threshold on; `rule_error` by (choice, bound), the
    geometric mean of the error over the best model's on the half held out; and `rule_quotient`, the rule's
    error over that of always taking M8.
    """
    (group, logs), (held_group, held_logs) = _halves(runs)
    counts = np.isfinite(logs[..., 0])
    best = (np.inf, np.nan, 0, 0)
    for threshold in np.percentile(group[counts], PERCENTILES):
        below, above = counts & (group < threshold), counts & (group >= threshold)
        sums = [logs[side].sum(axis=0) for side in (below, above)]
        best = min(best, (sum(s.min() for s in sums), threshold, *(int(s.argmin()) for s in sums)))
    _, threshold, X, Y = best
    rule = np.where(held_group < threshold, held_logs[..., X], held_logs[..., Y])
    always = held_logs[..., REFINED_MODELS.index(ALWAYS)]
    number = np.isfinite(always).sum(axis=1)

    def mean(values: np.ndarray) -> np.ndarray:
        return np.exp(quotient_interval(np.nansum(values, axis=1), number))

    dataset = xr.Dataset(
        {
            "rule_threshold": ((), threshold),
            "rule_model": ("side", [REFINED_MODELS[X], REFINED_MODELS[Y]]),
            "rule_error": (("choice", "bound"), [mean(rule), mean(always)]),
            "rule_quotient": ("bound", mean(rule - always)),
        },
        {"side": ["below", "above"], "choice": ["rule", ALWAYS], "bound": list(INTERVAL)},
    )
    words = "geometric mean over the runs held out of the mean square error over the best model's"
    about = {"rule_threshold": ("1", f"of the group {GROUP}"), "rule_error": ("1", words)}
    about["rule_quotient"] = "1", f"the rule's error over that of always {ALWAYS}"
    return described(dataset, about)
