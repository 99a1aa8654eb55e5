"""Recommended model for a cylinder, with the reason and advice, as text."""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from pneumo.physics.models import MODELS
from pneumo.statistics.ranking import RankedModel, Ranking, cost
from pneumo.statistics.robust_choice import RobustModel, UnknownConductance

MATERIAL = 0.10  # a mean square error at most this fraction above the lowest is as good in practice
LONG_RUN = 10.0  # thermal time constants that a run should last: section 4's rule


def recommend(ranking: Ranking, cells: xr.Dataset) -> Ranking:
    """Copy of a ranking with recommendation, reason and advice filled in, from the `cells` it was made of.

    Recommended is the cheapest model whose worst case over the range of k_0 is not materially worse than the
    lowest worst case; none if no run succeeded. The advice lists what would make the choice more certain.
    """
    robust = ranking.unknown_k_0
    if robust is None:
        return ranking._replace(reason="no full-order run succeeded")
    best = robust.models[0]
    if not np.isfinite(best.worst):
        return ranking._replace(reason="every model failed in a run")
    order = sorted(MODELS, key=lambda name: (cost(MODELS[name]), list(MODELS).index(name)))
    limit = (1 + MATERIAL) ** 0.5 * best.worst
    choice = robust.model(next(name for name in order if robust.model(name).worst <= limit))
    cheaper = [robust.model(name) for name in order[: order.index(choice.model)]]
    needs = "needs no k_0" if MODELS[choice.model].wall == "none" else "needs k_0"
    reason = f"{_named(choice)} has at most {_kpa(choice.worst)} RMS error {_range(robust)}"
    if choice == best:
        reason += ", the lowest worst case of all reduced models"
    else:
        reason += (
            f"; it {needs} and is the cheapest model within {100 * MATERIAL:.0f} % of the lowest worst mean"
            f" square error, that of {best.model} ({_kpa(best.worst)} RMS)"
        )
    rivals = [row for row in cheaper if np.isfinite(row.worst)]
    if rivals:
        rival = min(rivals, key=lambda row: row.worst)
        reason += f"; {rival.model}, the best of the cheaper ones, has at most {_kpa(rival.worst)}"
    cells = cells.sel(experiment=list(ranking.experiments))
    first = ranking.rows[0]
    advice = [
        *_more_seeds(ranking, [ranking.row(row.model) for row in (choice, *cheaper)]),
        _about_k_0(robust, choice),
        *_about_full_order(robust, choice),
        *_longer_runs(cells),
        *_wider_grid(cells, {choice.model: choice.n} | {first.model: first.n}),
        *_other_winners(ranking),
    ]
    return ranking._replace(recommended=choice.model, reason=reason, advice=tuple(advice))


def _named(row: RobustModel) -> str:
    """Name of a model, with its n if it has one."""
    return f"{row.model} at n = {row.n:g}" if np.isfinite(row.n) else row.model


def _kpa(rms: float) -> str:
    return f"{rms / 1e3:.3g} kPa"


def _range(robust: UnknownConductance) -> str:
    """Range in which k_0 is known, as a phrase."""
    if robust.factor == 1:
        return "at the given k_0"
    if not np.isfinite(robust.k_0):
        return f"where k_0 is known within a factor of {robust.factor:.2g}"
    low, high = robust.k_0 / robust.factor, robust.k_0 * robust.factor
    around = f"a factor of {robust.factor:.2g} around {robust.k_0:.2g}"
    return f"for k_0 from {low:.2g} to {high:.2g} W/K ({around})"


def _more_seeds(ranking: Ranking, rows: Sequence[RankedModel]) -> list[str]:
    """Advice to run more seeds, where the runs do not decide whether a model is materially worse."""
    limit, over = 1 + MATERIAL, {row.model: row.over_best for row in rows}
    unsure = [model for model, ratio in over.items() if ratio.known and ratio.low <= limit <= ratio.high]
    lines: list[str] = []
    if unsure:
        names = ", ".join(unsure)
        lines.append(f"More seeds for {names}: the interval of MSE / best contains the limit of {limit:g}.")
    if ranking.runs < 2:
        lines.append("Repeat with several seeds of a random signal: one run has no error bars.")
    return lines


def _about_k_0(robust: UnknownConductance, choice: RobustModel) -> str:
    """Sentence that says what the worst error would be with k_0 known exactly, and whether to measure k_0."""
    known = (
        f"with k_0 known exactly, and model and n chosen for it, the worst case is {_kpa(robust.known)} RMS"
        f" instead of {_kpa(choice.worst)}."
    )
    pays = choice.worst**2 > (1 + MATERIAL) * robust.known**2
    return f"{'Measure k_0, above all' if pays else 'k_0 is known well enough'}: {known}"


def _about_full_order(robust: UnknownConductance, choice: RobustModel) -> list[str]:
    """Advice to take the full order, if it was tried and its worst case is materially better."""
    full = robust.full_order
    if full is None or not full.worst**2 * (1 + MATERIAL) < choice.worst**2:
        return []
    return [
        f"Or take the full order: with the same k_0 it has at most {_kpa(full.worst)} RMS, and a step costs"
        " about as much (docs/export.md); but these runs are its own equations, and only a measured cylinder"
        " can confirm them (docs/fit.md)."
    ]


def _longer_runs(cells: xr.Dataset) -> list[str]:
    """Advice to run longer, for each experiment of less than ten thermal time constants of its cylinder."""
    columns = (cells[name].values for name in ("experiment", "duration", "time_constant"))
    return [
        f"Longer runs: {name} lasts less than ten thermal time constants, {time_constant:.3g} s each."
        for name, duration, time_constant in zip(*columns, strict=True)
        if duration < LONG_RUN * time_constant
    ]


def _wider_grid(cells: xr.Dataset, best_n: Mapping[str, float]) -> list[str]:
    """Advice to try more values of n, if a model's best n is the lowest or highest that was tried."""
    edges = {float(cells["n"].min()), float(cells["n"].max())}
    models = " and ".join(model for model, n in best_n.items() if n in edges)
    return [f"A wider grid: the best n of {models} is the first or last of the list n."] if models else []


def _other_winners(ranking: Ranking) -> list[str]:
    """Advice if the model ranked first is not the best in every experiment and by the geometric mean too."""
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
        " all runs; the largest errors dominate the arithmetic mean."
    ]
