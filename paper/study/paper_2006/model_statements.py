"""Statements about models: rankings and quotients of mean square errors, from the statistics or the cells."""

import itertools
import math
from collections.abc import Mapping, Sequence

from paper.study.averages import OVERALL
from paper.study.paper_2006.paper_models import PAPER_MODELS, processes
from paper.study.paper_2006.results import StudyResults
from paper.study.paper_2006.table_cells import number_at
from paper_verdict.findings import Finding


def _mse_by_model(results: StudyResults, level: str) -> dict[str, float]:
    """Average mean square error of every model of the paper at a level, Pa^2."""
    return {model: number_at(results.statistics["mse"], level=level, model=model) for model in PAPER_MODELS}


def _decades(mse: Mapping[str, float], above: str, below: str) -> float:
    """Logarithm of one model's mean square error over another's, decades."""
    return math.log10(mse[above] / mse[below])


def _quotients(mse: Mapping[str, float], pairs: Sequence[tuple[str, str]]) -> str:
    """Quotients of the mean square errors of pairs of models, in words."""
    return "; ".join(f"{above} over {below}: {mse[above] / mse[below]:.2f}" for above, below in pairs)


def quotient(
    results: StudyResults, of: Sequence[str], over: Sequence[str], levels: Sequence[str], pick: str
) -> Finding:
    """Highest or lowest ratio of a model's mean square error to the lowest one of other models."""
    mse = {level: _mse_by_model(results, level) for level in levels}
    choose = max if pick == "highest" else min
    ratios: list[float] = []
    words: list[str] = []
    for model in of:
        ratio, level = choose((mse[at][model] / min(mse[at][name] for name in over), at) for at in levels)
        ratios.append(ratio)
        words.append(f"{model} {100 * ratio:.1f} %" + (f" ({level})" if len(levels) > 1 else ""))
    return Finding(choose(ratios), shown=", ".join(words) if len(of) * len(levels) > 1 else "")


def smallest_gap(results: StudyResults, groups: Sequence[Sequence[str]], level: str) -> Finding:
    """Smallest gap between neighbouring groups, decades: best error of one group over worst of the next."""
    mse = _mse_by_model(results, level)
    error = mse.__getitem__
    pairs = [(min(above, key=error), max(below, key=error)) for above, below in itertools.pairwise(groups)]
    return Finding(min(_decades(mse, *pair) for pair in pairs), shown=_quotients(mse, pairs))


def gap(results: StudyResults, above: Sequence[str], below: Sequence[str], level: str) -> Finding:
    """Decades of mean square error between the best of some models and the worst of others."""
    return smallest_gap(results, [above, below], level)


def spread(results: StudyResults, models: Sequence[str], level: str) -> Finding:
    """Decades of mean square error between the best and the worst of some models."""
    mse = _mse_by_model(results, level)
    pair = max(models, key=mse.__getitem__), min(models, key=mse.__getitem__)
    return Finding(_decades(mse, *pair), shown=_quotients(mse, [pair]))


def gain(results: StudyResults, better: Sequence[str], than: str, level: str) -> Finding:
    """Largest reduction of the mean square error of `than` by one of `better`, decades."""
    mse = _mse_by_model(results, level)
    largest = max(_decades(mse, than, model) for model in better)
    return Finding(largest, shown=_quotients(mse, [(model, than) for model in better]))


def best_models(results: StudyResults, models: Sequence[str], level: str) -> Finding:
    """Whether each of the given models has a lower mean square error than every other at this level."""
    mse = _mse_by_model(results, level)
    order = sorted(mse, key=mse.__getitem__)
    others = min(mse[model] for model in mse if model not in models)
    margin = math.log10(others / max(mse[model] for model in models))
    return Finding(holds=margin > 0, shown=" < ".join(order), margin=margin)


def next_best(results: StudyResults, after: Sequence[str], claimed: str, level: str) -> Finding:
    """Whether `claimed` has the lowest mean square error of all models that are not in `after`."""
    mse = _mse_by_model(results, level)
    order = sorted(mse.keys() - after, key=mse.__getitem__)
    margin = min(_decades(mse, model, claimed) for model in order if model != claimed)
    return Finding(holds=order[0] == claimed, shown=" < ".join(order), margin=margin)


def in_order(results: StudyResults, models: Sequence[str], levels: Sequence[str]) -> Finding:
    """Whether mean square errors rise in the order of the models, at every level."""
    by_level = {level: _mse_by_model(results, level) for level in levels}
    orders = {level: sorted(models, key=mse.__getitem__) for level, mse in by_level.items()}
    words = "; ".join(f"{level}: {' < '.join(order)}" for level, order in orders.items())
    margin = min(_decades(mse, b, a) for mse in by_level.values() for a, b in itertools.pairwise(models))
    return Finding(holds=margin > 0, shown=words, margin=margin)


def same_order(results: StudyResults, levels: Sequence[str], apart: float) -> Finding:
    """Whether models whose overall errors differ by over `apart` decades keep their order at every level."""
    overall = _mse_by_model(results, OVERALL)
    by_level = {level: _mse_by_model(results, level) for level in levels}
    distances = {
        f"{a} above {b} ({level})": _decades(mse, b, a)
        for level, mse in by_level.items()
        for a, b in itertools.permutations(mse, 2)
        if _decades(overall, b, a) > apart
    }
    swapped = "; ".join(words for words, distance in distances.items() if distance <= 0)
    margin = min(distances.values(), default=0.0)
    return Finding(holds=not swapped, shown=swapped or "no pair changes places", margin=margin)


def walls_before_mixing(results: StudyResults, level: str) -> Finding:
    """Whether wall heat (M6 to the worst of M7-M10) saves more error than mixing (M5 to M6)."""
    mse = _mse_by_model(results, level)
    walls = mse["M6"] - max(mse[m] for m in ("M7", "M8", "M9", "M10"))
    mixing = mse["M5"] - mse["M6"]
    words = f"wall heat saves {walls / 1e6:.2f}, mixing {mixing / 1e6:.2f} x 1e6 Pa^2"
    margin = math.log10(2 * mse["M6"] / (mse["M6"] - walls + mse["M5"]))
    return Finding(holds=walls > mixing, shown=words, margin=margin)


def simplest_of_the_best(results: StudyResults, claimed: str, level: str, apart: float) -> Finding:
    """Whether `claimed` has the fewest processes of the models within `apart` decades of the lowest MSE."""
    mse = _mse_by_model(results, level)
    best = min(mse, key=mse.__getitem__)
    alike = [model for model in mse if _decades(mse, model, best) <= apart]
    choice = min(alike, key=lambda model: (processes(model), mse[model]))
    words = f"{choice}; {claimed} has {mse[claimed] / mse[best]:.2f} times the lowest mean square error"
    distances = [apart - _decades(mse, claimed, best)]
    for model in mse.keys() - {claimed}:
        if processes(model) < processes(claimed):
            distances.append(_decades(mse, model, best) - apart)
        elif processes(model) == processes(claimed):
            distances.append(_decades(mse, model, claimed))
    return Finding(holds=choice == claimed, shown=words, margin=min(distances))


def best_n_varies(results: StudyResults) -> Finding:
    """Whether each of the six best models has more than one best n over the experiments."""
    best = results.statistics["best_n"]
    six = list(PAPER_MODELS)[4:]
    spans = {m: (float(best.sel(model=m).min()), float(best.sel(model=m).max())) for m in six}
    words = ", ".join(f"{m} {low:g}-{high:g}" for m, (low, high) in spans.items())
    return Finding(holds=all(low < high for low, high in spans.values()), shown=words)


def no_single_best(results: StudyResults) -> Finding:
    """Whether different experiments have different best models, each at its best n."""
    mse = results.cells["mse"].sel(model=list(PAPER_MODELS))
    winners = mse.min("n").idxmin("model").values.tolist()
    words = [f"{model} best in {winners.count(model)}" for model in PAPER_MODELS if model in winners]
    return Finding(holds=len(words) > 1, shown=", ".join(words))
