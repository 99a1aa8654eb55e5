"""Regimes in which each refinement pays: models compared in pairs on random cylinders.

Runs of one cylinder are correlated, so every interval is over cylinders: Wilson's for a fraction of them,
the bootstrap's (percentiles) for anything else.
"""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from pneumo.evidence.random_cylinders.cylinder_runs import LOOPS
from pneumo.evidence.random_cylinders.dimensionless_groups import KNOWN_GROUPS
from pneumo.physics.models import MODELS
from pneumo.statistics.intervals import FEWEST, fraction_interval, quotient_interval, student_interval
from pneumo.statistics.model_pairs import CRITERIA, MODEL_PAIRS, REFINED_MODELS
from pneumo.statistics.ranking import MATERIAL, cost

CHEAPEST_FIRST = sorted(REFINED_MODELS, key=lambda name: (cost(MODELS[name]), REFINED_MODELS.index(name)))
ENOUGH = "M6 enough"  # within MATERIAL of the best of REFINED_MODELS
LOOPS_AND_BOTH = (*LOOPS, "both")
CONTINUOUS_GROUPS = [name for name in KNOWN_GROUPS if name != "closed"]
INTERVAL = ("value", "low", "high")
MAP_GROUPS, MAP_BINS = ("thermal", "exchange"), 8  # axes of the map, parts of each
MAPPED_PAIRS = ("M8/M7", "M10/M8")


def with_answers(cells: xr.Dataset, compared: int) -> xr.Dataset:
    """Add the lowest errors of each run, the cheapest good model, and whether the run counts.

    `cells` are from `pneumo.evidence.random_cylinders.cylinder_runs.cylinder_cells`, by cylinder; those from
    `compared` on are held out. Added are `lowest`, Pa^2, by (cylinder, loop, model), each at its best n;
    `counts`, whether full-order run and M5 to M10 succeeded; `answer`, the cheapest of these models within
    10 % of the best, "" where the run does not count; `held_out` by cylinder.
    """
    lowest = cells["mse"].min("n")
    good = lowest.sel(model=list(REFINED_MODELS))
    counts = (cells["run_status"] == 0) & good.notnull().all("model")
    within = lowest.sel(model=CHEAPEST_FIRST) <= (1 + MATERIAL) * good.min("model")
    answer = np.array(CHEAPEST_FIRST)[within.transpose("cylinder", "loop", "model").values.argmax(axis=-1)]
    runs = cells.assign(
        lowest=lowest,
        counts=counts.astype(np.int8),
        answer=(("cylinder", "loop"), np.where(counts.transpose("cylinder", "loop"), answer, "")),
    )
    runs["held_out"] = ("cylinder", (np.arange(cells.sizes["cylinder"]) >= compared).astype(np.int8))
    return runs


def compare_pairs(runs: xr.Dataset) -> xr.Dataset:
    """Compare models in pairs over the cylinders that are not held out.

    By (loop, bound): `ratio` of scores by (pair, criterion), below 1 where the first is better; `share`, the
    fraction of cylinders by statement: the first is better (by the geometric mean over its runs), or M6 is
    enough (in every run); `cylinders`, the number that counts.
    """
    from scipy.stats import rankdata  # 0.3 s of import, which `pneumo study` does not need

    runs = runs.sel(cylinder=runs["held_out"] == 0)
    ratio = np.full((len(LOOPS_AND_BOTH), len(MODEL_PAIRS), len(CRITERIA), 3), np.nan)
    share = np.full((len(LOOPS_AND_BOTH), len(MODEL_PAIRS) + 1, 3), np.nan)
    number = np.zeros(len(LOOPS_AND_BOTH), dtype=int)
    for i, loop in enumerate(LOOPS_AND_BOTH):
        part, names = (runs if loop == "both" else runs.sel(loop=[loop])), runs["model"].values
        mse = part["lowest"].where(part["counts"] == 1).transpose("cylinder", "loop", "model").values
        mse = mse[np.isfinite(mse).any(axis=(1, 2))]
        number[i] = len(mse)
        m6 = mse[..., int(np.flatnonzero(names == "M6")[0])]
        ran = np.isfinite(m6)
        ranks = np.where(ran[..., None], rankdata(np.nan_to_num(mse, nan=np.inf), axis=2), np.nan)
        best = np.min(mse[..., np.isin(names, REFINED_MODELS)], axis=2)
        for j, pair in enumerate(MODEL_PAIRS.values()):
            a, b = (int(np.flatnonzero(names == name)[0]) for name in (pair.model, pair.other))
            logs = np.nansum(np.log(mse[..., a] / mse[..., b]), axis=1)
            for k, score in ((0, mse), (2, ranks)):
                ratio[i, j, k] = quotient_interval(*(np.nansum(score[..., m], axis=1) for m in (a, b)))
            ratio[i, j, 1] = np.exp(quotient_interval(logs, ran.sum(axis=1)))
            share[i, j] = fraction_interval(int((logs < 0).sum()), len(mse), "wilson")
        enough = (m6 <= (1 + MATERIAL) * best) | ~ran
        share[i, -1] = fraction_interval(int(enough.all(axis=1).sum()), len(mse), "wilson")
    of_ratio = {"units": "1", "long_name": "ratio of the models' scores, with its 95 per cent interval"}
    of_share = {"units": "1", "long_name": "share of cylinders for which it holds, with its interval"}
    variables = {
        "ratio": (("loop_of", "pair", "criterion", "bound"), ratio, of_ratio),
        "share": (("loop_of", "statement", "bound"), share, of_share),
        "cylinders": ("loop_of", number, {"long_name": "cylinders that count"}),
    }
    coords = {"loop_of": list(LOOPS_AND_BOTH), "pair": list(MODEL_PAIRS), "criterion": list(CRITERIA)}
    coords |= {"statement": [*(f"{pair} < 1" for pair in MODEL_PAIRS), ENOUGH], "bound": list(INTERVAL)}
    return xr.Dataset(variables, coords)


def compare_by_thirds(runs: xr.Dataset, names: Sequence[str]) -> xr.Dataset:
    """Compare pairs of models in each third of the runs, sorted by each of the named dimensionless groups.

    By (group, third): `third_from` and `third_to`; by (group, third, pair, bound): `third_ratio`, geometric
    mean over runs, and `third_share`, the fraction of runs with a ratio below 1; intervals over cylinders.
    """
    runs = runs.sel(cylinder=runs["held_out"] == 0)
    counts = runs["counts"].transpose("cylinder", "loop").values == 1
    edges = np.full((len(names), 4), np.nan)
    ratio = np.full((len(names), 3, len(MODEL_PAIRS), 3), np.nan)
    share = np.full_like(ratio, np.nan)
    for i, name in enumerate(names):
        values = runs[name].transpose("cylinder", "loop").values
        edges[i] = np.quantile(values[counts], [0, 1 / 3, 2 / 3, 1])
        for third in range(3):
            inside = counts & (values >= edges[i, third]) & (values <= edges[i, third + 1])
            for j, pair in enumerate(MODEL_PAIRS.values()):
                logs = np.log(pair.ratio(runs["lowest"]).transpose("cylinder", "loop").values)
                sums = np.where(inside, logs, 0.0).sum(axis=1)
                ratio[i, third, j] = np.exp(quotient_interval(sums, inside.sum(axis=1)))
                share[i, third, j] = quotient_interval((inside & (logs < 0)).sum(axis=1), inside.sum(axis=1))
    dims = ("group", "third", "pair", "bound")
    words = "of the models' errors in a third of the runs"
    variables = {
        "third_from": (("group", "third"), edges[:, :-1], {"units": "1", "long_name": "lower edge"}),
        "third_to": (("group", "third"), edges[:, 1:], {"units": "1", "long_name": "upper edge"}),
        "third_ratio": (dims, ratio, {"units": "1", "long_name": f"geometric mean ratio {words}"}),
        "third_share": (dims, share, {"units": "1", "long_name": f"share of ratios {words} below 1"}),
    }
    thirds = ["lowest", "middle", "highest"]
    values = list(names), thirds, list(MODEL_PAIRS), list(INTERVAL)
    return xr.Dataset(variables, dict(zip(dims, values, strict=True)))


def map_of_ratios(runs: xr.Dataset) -> xr.Dataset:
    """Geometric mean ratios of errors on a map of two dimensionless groups, from cylinders not held out.

    By (map_ratio_of, loop, thermal_bin, exchange_bin, bound): `map_ratio`, with Student's interval; NaN where
    fewer than `FEWEST` runs fall. `thermal_edge` and `exchange_edge` are the bins' ends.
    """
    runs = runs.sel(cylinder=runs["held_out"] == 0)
    counts, values = runs["counts"] == 1, {}
    for name in MAP_GROUPS:
        inside = runs[name].values[counts.values]
        values[f"{name}_edge"] = (f"{name}_end", np.geomspace(inside.min(), inside.max(), MAP_BINS + 1))
    lowest = runs["lowest"]
    quotients = {name: MODEL_PAIRS[name].ratio(lowest) for name in MAPPED_PAIRS}
    quotients["M6/best"] = lowest.sel(model="M6") / lowest.sel(model=list(REFINED_MODELS)).min("model")
    ratio = np.full((len(quotients), len(LOOPS), MAP_BINS, MAP_BINS, 3), np.nan)
    for i, quotient in enumerate(quotients.values()):
        for j, loop in enumerate(LOOPS):
            good = counts.sel(loop=loop).values
            places = [
                np.searchsorted(values[f"{name}_edge"][1][1:-1], runs[name].sel(loop=loop).values[good])
                for name in MAP_GROUPS
            ]
            logs = np.log(quotient.sel(loop=loop).values[good])
            for place in np.ndindex(MAP_BINS, MAP_BINS):
                in_bin = logs[(places[0] == place[0]) & (places[1] == place[1])]
                if len(in_bin) >= FEWEST:
                    ratio[i, j, *place] = np.exp(student_interval(in_bin))
    dims = ("map_ratio_of", "loop", *(f"{name}_bin" for name in MAP_GROUPS), "bound")
    words = {"units": "1", "long_name": "geometric mean ratio of the models' errors in a part of the map"}
    coords = {"map_ratio_of": list(quotients), "loop": list(LOOPS), "bound": list(INTERVAL)}
    return xr.Dataset({"map_ratio": (dims, ratio, words), **values}, coords)


def regime_statistics(runs: xr.Dataset) -> xr.Dataset:
    """Join all statistics of the random cylinders in one dataset; the errors at every n are dropped."""
    kept = runs.drop_vars(["mse", "n"])
    kept["lowest"].attrs = {"units": "Pa2", "long_name": "mean square error at the run's best n"}
    kept["counts"].attrs = {"long_name": "1 where the full-order run and M5 to M10 succeeded"}
    kept["answer"].attrs = {"long_name": "cheapest model within 10 per cent of the best"}
    kept["held_out"].attrs = {"long_name": "1 where the cylinder is held out"}
    kept = kept.merge(compare_pairs(runs)).merge(map_of_ratios(runs))
    return kept.merge(compare_by_thirds(runs, CONTINUOUS_GROUPS), compat="no_conflicts")
