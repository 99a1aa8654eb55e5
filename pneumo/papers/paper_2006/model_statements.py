"""Statements about models: rankings and quotients of mean square errors, from the statistics or the cells."""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from pneumo.papers.paper_2006.table1 import PAPER_MODELS, processes
from pneumo.papers.paper_2006.table_cells import number_at
from pneumo.statistics.averages import OVERALL
from pneumo.verdict.sources import Finding, StudyResults


def _mse_by_model(results: StudyResults, level: str) -> dict[str, float]:
    """Average mean square error of every model of the paper at a level, Pa^2."""
    return {model: number_at(results.statistics["mse"], level=level, model=model) for model in PAPER_MODELS}


def _order(mse: Mapping[str, float]) -> list[str]:
    """Models by rising mean square error."""
    return sorted(mse, key=lambda model: mse[model])


def _decades(above: float, below: float) -> float:
    return math.log10(above / below)


def _compare(
    results: StudyResults,
    levels: Sequence[str],
    pairs: Callable[[Mapping[str, float]], Sequence[tuple[str, str]]],
) -> tuple[list[float], str]:
    """Decades of mean square error between the models of each pair, at each level, and in words."""
    decades: list[float] = []
    words: list[str] = []
    for level in levels:
        mse = _mse_by_model(results, level)
        for above, below in pairs(mse):
            decades.append(_decades(mse[above], mse[below]))
            words.append(f"{above} over {below}: {mse[above] / mse[below]:.2f}")
    return decades, "; ".join(words)


def quotient(
    results: StudyResults, of: Sequence[str], over: Sequence[str], levels: Sequence[str], pick: str
) -> Finding:
    """Highest or lowest quotient of some models' mean square error over that of the best of others."""
    shares: dict[tuple[str, str], float] = {}
    for level in levels:
        mse = _mse_by_model(results, level)
        best = min(mse[model] for model in over)
        shares |= {(model, level): mse[model] / best for model in of}
    choose = max if pick == "highest" else min
    words: list[str] = []
    for model in of:
        level = choose(levels, key=lambda level: shares[model, level])
        share = f"{model} {100 * shares[model, level]:.1f} %"
        words.append(f"{share} ({level})" if len(levels) > 1 else share)
    return Finding(choose(shares.values()), shown=", ".join(words) if len(shares) > 1 else "")


def gap(results: StudyResults, above: Sequence[str], below: Sequence[str], levels: Sequence[str]) -> Finding:
    """Decades of mean square error between the best of some models and the worst of others."""
    decades, words = _compare(
        results, levels, lambda mse: [(min(above, key=mse.__getitem__), max(below, key=mse.__getitem__))]
    )
    return Finding(min(decades), shown=words)


def smallest_gap(results: StudyResults, groups: Sequence[Sequence[str]], levels: Sequence[str]) -> Finding:
    """Smallest gap between neighbouring groups of models, decades."""
    gaps = [gap(results, above, below, levels) for above, below in itertools.pairwise(groups)]
    smallest = min(finding.value for finding in gaps if finding.value is not None)
    return Finding(smallest, shown="; ".join(finding.shown for finding in gaps))


def spread(results: StudyResults, models: Sequence[str], levels: Sequence[str]) -> Finding:
    """Decades of mean square error between the best and the worst of some models."""
    decades, words = _compare(
        results, levels, lambda mse: [(max(models, key=mse.__getitem__), min(models, key=mse.__getitem__))]
    )
    return Finding(max(decades), shown=words)


def gain(results: StudyResults, better: Sequence[str], than: str, levels: Sequence[str]) -> Finding:
    """Largest reduction of mean square error against one model, decades."""
    decades, _ = _compare(results, levels, lambda _: [(than, model) for model in better])
    _, words = _compare(results, levels, lambda _: [(model, than) for model in better])
    return Finding(max(decades), shown=words)


def best_models(results: StudyResults, models: Sequence[str], level: str) -> Finding:
    """Whether the given models have the lowest mean square errors."""
    order = _order(_mse_by_model(results, level))
    return Finding(holds=set(order[: len(models)]) == set(models), shown=" < ".join(order))


def next_best(results: StudyResults, after: Sequence[str], claimed: str, level: str) -> Finding:
    """Whether a model is the best of those left when some are taken away."""
    order = [model for model in _order(_mse_by_model(results, level)) if model not in after]
    return Finding(holds=order[0] == claimed, shown=" < ".join(order))


def in_order(results: StudyResults, models: Sequence[str], levels: Sequence[str]) -> Finding:
    """Whether mean square errors rise in the order of the models, at every level."""
    orders: dict[str, list[str]] = {}
    for level in levels:
        mse = _mse_by_model(results, level)
        orders[level] = _order({model: mse[model] for model in models})
    return Finding(
        holds=all(order == list(models) for order in orders.values()),
        shown="; ".join(f"{level}: {' < '.join(order)}" for level, order in orders.items()),
    )


def same_order(results: StudyResults, levels: Sequence[str], apart: float) -> Finding:
    """Whether models that lie more than `apart` decades apart overall keep their order at every level."""
    overall = _mse_by_model(results, OVERALL)
    swapped: list[str] = []
    for level in levels:
        mse = _mse_by_model(results, level)
        swapped += [
            f"{a} above {b} ({level})"
            for a in mse
            for b in mse
            if _decades(overall[b], overall[a]) > apart and mse[a] >= mse[b]
        ]
    return Finding(holds=not swapped, shown="; ".join(swapped) or "no pair changes places")


def walls_before_mixing(results: StudyResults, level: str) -> Finding:
    """Whether wall heat (M6 to the worst of M7-M10) saves more error than mixing (M5 to M6)."""
    mse = _mse_by_model(results, level)
    walls = mse["M6"] - max(mse[m] for m in ("M7", "M8", "M9", "M10"))
    mixing = mse["M5"] - mse["M6"]
    return Finding(
        holds=walls > mixing, shown=f"wall heat saves {walls / 1e6:.2f}, mixing {mixing / 1e6:.2f} x 1e6 Pa^2"
    )


def simplest_of_the_best(results: StudyResults, claimed: str, level: str, apart: float) -> Finding:
    """Whether a model is the simplest of those within `apart` decades of the lowest error."""
    mse = _mse_by_model(results, level)
    lowest = min(mse.values())
    alike = [model for model in mse if _decades(mse[model], lowest) <= apart]
    choice = min(alike, key=lambda model: (processes(model), mse[model]))
    return Finding(
        holds=choice == claimed,
        shown=f"{choice}; {claimed} has {mse[claimed] / lowest:.2f} times the lowest mean square error",
    )


def best_n_varies(results: StudyResults) -> Finding:
    """Whether each of the six best models has more than one best n over the experiments."""
    best = results.statistics["best_n"]
    six = list(PAPER_MODELS)[4:]
    spans = {m: (float(best.sel(model=m).min()), float(best.sel(model=m).max())) for m in six}
    return Finding(
        holds=all(low < high for low, high in spans.values()),
        shown=", ".join(f"{m} {low:g}-{high:g}" for m, (low, high) in spans.items()),
    )


def no_single_best(results: StudyResults) -> Finding:
    """Whether different experiments have different best models, each at its best n."""
    mse = results.cells["mse"].sel(model=list(PAPER_MODELS))
    winners = mse.min("n").idxmin("model").values.tolist()
    count = {model: winners.count(model) for model in PAPER_MODELS if model in winners}
    shown = ", ".join(f"{model} best in {times}" for model, times in count.items())
    return Finding(holds=len(count) > 1, shown=shown)


def same_cells(results: StudyResults, one: str, other: str, n: float) -> Finding:
    """Whether two models have the same errors in every experiment at one n."""
    pair = [results.cells["mse"].sel(model=model, n=n).values for model in (one, other)]
    worst = float(np.nanmax(np.abs(pair[0] / pair[1] - 1)))
    # Wall heat is a zero times k_0 there, and rounding of mu^2 + sigma^2 is all that can differ.
    return Finding(
        holds=worst <= 1e-12, shown=f"largest relative difference of mean square errors {worst:.1g}"
    )
