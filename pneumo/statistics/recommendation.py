"""Recommended model for a cylinder, the reason, and advice on what would make it firmer, in words."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from pneumo.physics.models import MODELS
from pneumo.statistics.intervals import Interval, paired_ratio
from pneumo.statistics.ranking import RankedModel, Ranking, cost

MATERIAL = 0.10  # a mean square error that exceeds the lowest by this share or less is as good in practice
LONG_RUN = 10.0  # thermal time constants that a run should last: section 4's rule


def recommend(ranking: Ranking, cells: xr.Dataset) -> Ranking:
    """Fill in recommendation, reason and advice of a ranking of `cells`.

    Recommended is the cheapest model that is not materially worse than the best, none if none ran. The
    advice is what would decide better.
    """
    if not ranking.runs:
        return ranking._replace(reason="no full-order run succeeded")
    best = ranking.rows[0]
    if not np.isfinite(best.mse.value):
        return ranking._replace(reason="every model failed in a run")
    order = sorted(MODELS, key=lambda name: (cost(MODELS[name]), list(MODELS).index(name)))
    good = [name for name in order if ranking.row(name).over_best.value <= 1 + MATERIAL]
    choice = ranking.row(good[0])
    cheaper = [ranking.row(name) for name in order[: order.index(choice.model)]]
    needs = "needs no k_0" if MODELS[choice.model].wall == "none" else "needs k_0"
    if choice.model == best.model:
        reason = f"{choice.model} has the lowest mean square error"
    else:
        reason = (
            f"{choice.model} is the cheapest model within {100 * MATERIAL:.0f} % of the lowest mean square"
            f" error: it {needs} and has {_in_words(choice.over_best)} times the MSE of {best.model}"
        )
    if cheaper:
        rival = min(cheaper, key=lambda row: row.place)
        over = paired_ratio(ranking.mse_by_run[rival.model], ranking.mse_by_run[choice.model])
        reason += f"; {rival.model}, the best of the cheaper ones, has {_in_words(over)} times its MSE"
    cells = cells.sel(experiment=list(ranking.experiments))
    advice = [
        *_more_seeds(ranking, [choice, *cheaper]),
        *_about_k_0(ranking, choice),
        *_longer_runs(cells),
        *_wider_grid(cells, [choice] if best == choice else [choice, best]),
        *_other_winners(ranking),
    ]
    return ranking._replace(recommended=choice.model, reason=reason, advice=tuple(advice))


def _in_words(ratio: Interval) -> str:
    """A ratio with its interval."""
    if not ratio.known:
        return f"{ratio.value:.2f}"
    return f"{ratio.value:.2f} ({ratio.low:.2f} to {ratio.high:.2f})"


def _more_seeds(ranking: Ranking, rows: Sequence[RankedModel]) -> list[str]:
    """Advice to run more seeds, where those there are do not tell whether a model is worse."""
    limit = 1 + MATERIAL
    lines = [
        f"More seeds: {row.model} has {_in_words(row.over_best)} times the MSE of {ranking.rows[0].model},"
        f" an interval that holds the limit of {limit:g}."
        for row in rows
        if row.over_best.known and row.over_best.low <= limit <= row.over_best.high
    ]
    if ranking.runs < 2:
        lines.append("Repeat with several seeds of a random signal: one run has no error bars.")
    return lines


def _about_k_0(ranking: Ranking, choice: RankedModel) -> list[str]:
    """Advice on k_0: what a wrong one does to the chosen model, or to the best if that alone needs k_0."""
    row = choice if MODELS[choice.model].wall != "none" else ranking.rows[0]
    if MODELS[row.model].wall == "none":
        return []
    parts: list[str] = []
    for wrong in ranking.wrong_k_0:
        times = {0.5: "half", 2.0: "twice"}.get(wrong.factor, f"{wrong.factor:g} times")
        rms, place = wrong.rms[row.model] / 1e3, wrong.place[row.model]
        parts.append(f"{rms:.2f} kPa, place {place}, with {times} k_0")
    errors = f"{row.model} has {row.mse.value**0.5 / 1e3:.2f} kPa RMS at the right k_0; {'; '.join(parts)}."
    if row != choice:
        return [f"k_0, if {row.model} is to be used: {errors}"]
    if any(wrong.place[row.model] > row.place for wrong in ranking.wrong_k_0):
        return [f"Measure k_0, above all: {errors}"]
    return [f"k_0 within a factor of two is enough for the order: {errors}"]


def _longer_runs(cells: xr.Dataset) -> list[str]:
    """Advice for each experiment that is short for its cylinder's walls."""
    columns = (cells[name].values for name in ("experiment", "duration", "time_constant"))
    return [
        f"Longer runs: {name} lasts less than ten thermal time constants, {time_constant:.3g} s each."
        for name, duration, time_constant in zip(*columns, strict=True)
        if duration < LONG_RUN * time_constant
    ]


def _wider_grid(cells: xr.Dataset, rows: Sequence[RankedModel]) -> list[str]:
    """Advice where a best n is the first or last of the grid."""
    edges = {float(cells["n"].min()), float(cells["n"].max())}
    models = " and ".join(row.model for row in rows if row.n in edges)
    return [f"A wider grid: the best n of {models} is the first or last of the list n."] if models else []


def _other_winners(ranking: Ranking) -> list[str]:
    """Advice where single experiments, or the geometric mean over runs, have another winner."""
    winners = {
        name: min(rms, key=lambda model: np.nan_to_num(rms[model], nan=np.inf))
        for name, rms in ranking.by_experiment.items()
    }
    geometric = min(ranking.rows, key=lambda row: row.geometric_place).model
    if {*winners.values(), geometric} == {ranking.rows[0].model}:
        return []
    listed = ", ".join(f"{model} in {name}" for name, model in winners.items())
    return [
        f"Runs like those of your machine: best are {listed}, and {geometric} by the geometric mean over"
        " all runs; the arithmetic mean is ruled by the most violent runs."
    ]
