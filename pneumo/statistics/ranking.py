"""Which model to take: all ten ranked over repeated runs, the gain of each refinement, and a recommendation.

The criterion is the mean square error, averaged over both chambers, the experiments and the runs, of each
model at the one n that makes it least. Intervals are Student's, at 95 %, over runs that differ in their seed;
two models are compared run by run, by the logarithm of the ratio of their errors.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.physics.models import MODELS, Model
from pneumo.statistics.averages import best_n

CONFIDENCE = 0.95
MATERIAL = (
    0.10  # a model whose mean square error is this share above the best one's is as good for an engineer
)
TIME_CONSTANTS = 10.0  # thermal time constants that a run should last: section 4's rule

REFINEMENTS = (  # what is added, model without it, model with it
    ("temperature law, eq (6)", "M2", "M5"),
    ("mixing, without wall heat", "M5", "M6"),
    ("mixing, with wall heat", "M7", "M8"),
    ("wall heat, without mixing", "M5", "M7"),
    ("wall heat, with mixing", "M6", "M8"),
    ("wall area A_q(x)", "M8", "M9"),
    ("conductance with the root of PT", "M9", "M10"),
)


class Interval(NamedTuple):
    """An estimate with the ends of its interval; NaN where one run alone leaves no interval."""

    value: float
    low: float
    high: float

    @property
    def known(self) -> bool:
        """Whether there is an interval."""
        return bool(np.isfinite(self.low) and np.isfinite(self.high))


class Row(NamedTuple):
    """One model in the ranking.

    Attributes
    ----------
    place : int
        From 1; models that failed come last.
    model : str
    n : float
        Best constant n; NaN where it plays no role or every n failed.
    mse : Interval
        Mean square error, Pa^2.
    rms : tuple of float
        Root mean square error, Pa, of chambers A and B.
    over_best : Interval
        Its mean square error over that of the best model: geometric mean over paired runs.
    geometric_place : int
        Place by the geometric mean over all runs, in which no violent run outweighs the others.
    wins : int
        Runs of an experiment in which it is best.
    failed : int
        Runs of an experiment in which it has no error at its n.
    """

    place: int
    model: str
    n: float
    mse: Interval
    rms: tuple[float, float]
    over_best: Interval
    geometric_place: int
    wins: int
    failed: int


class Gain(NamedTuple):
    """What a refinement takes from the mean square error, per cent; negative where it adds to it."""

    refinement: str
    without: str
    refined: str
    percent: Interval


class WrongConductance(NamedTuple):
    """The models when their k_0 is `factor` times the cylinder's: RMS error, Pa, and place of each."""

    factor: float
    rms: dict[str, float]
    place: dict[str, int]


class Ranking(NamedTuple):
    """What a study says about one cylinder.

    Attributes
    ----------
    cylinder : str
    experiments : tuple of str
    runs : int
        Runs of each experiment that count.
    left_out : tuple of str
        Why others do not.
    rows : tuple of Row
        Best first; empty if no full-order run succeeded.
    gains : tuple of Gain
    wrong_k_0 : tuple of WrongConductance
    by_experiment : dict
        RMS error, Pa, by experiment and model, each at its n.
    recommended : str
        The cheapest model that is not materially worse than the best, or nothing.
    reason : str
    advice : tuple of str
        What would decide better.
    """

    cylinder: str
    experiments: tuple[str, ...]
    runs: int
    left_out: tuple[str, ...]
    rows: tuple[Row, ...]
    gains: tuple[Gain, ...]
    wrong_k_0: tuple[WrongConductance, ...]
    by_experiment: dict[str, dict[str, float]]
    recommended: str
    reason: str
    advice: tuple[str, ...]

    def row(self, model: str) -> Row:
        """Return the row of a model."""
        return next(row for row in self.rows if row.model == model)


def cost(model: Model) -> tuple[int, int, int, int]:
    """What a model costs, for comparison: k_0 to be measured first, then powers and terms to be computed."""
    walls = ("none", "k_0", "lambda_0 A_q", "lambda A_q")
    return (
        walls.index(model.wall),
        int(model.temperature == "polytropic"),
        int(model.has_n),
        int(model.mixing),
    )


def interval(samples: np.ndarray) -> Interval:
    """Mean of independent samples with its interval by Student's t."""
    from scipy.stats import t  # half a second, for this alone

    mean, count = float(np.mean(samples)), len(samples)
    if count < 2:
        return Interval(mean, np.nan, np.nan)
    half = float(t.ppf((1 + CONFIDENCE) / 2, count - 1) * np.std(samples, ddof=1) / count**0.5)
    return Interval(mean, mean - half, mean + half)


def ratio(upper: np.ndarray, lower: np.ndarray) -> Interval:
    """Ratio of paired samples: geometric mean with its interval."""
    return Interval(*(float(np.exp(value)) for value in interval(np.log(upper / lower))))


def _places(values: dict[str, float]) -> dict[str, int]:
    """Places from 1, lowest value first; NaN last."""
    order = sorted(values, key=lambda name: (not np.isfinite(values[name]), values[name]))
    return {name: place for place, name in enumerate(order, start=1)}


def _stories(cells: xr.Dataset) -> tuple[str, ...]:
    """Full-order runs that failed, each with its time."""
    found = []
    meanings = cells["run_status"].attrs["flag_meanings"].split()
    for name in cells["experiment"].values:
        part = cells.sel(experiment=name)
        for run in np.flatnonzero(part["run_status"].values):
            at, what = part["run_failure_time"].values[run], meanings[int(part["run_status"].values[run])]
            found.append(
                f"{name}, seed {int(part['seed'].values[run])}: {what.replace('_', ' ')} at {at:g} s"
            )
    return tuple(found)


def ranked(cells: xr.Dataset, cylinder: str) -> Ranking:
    """Rank the models on one cylinder.

    Parameters
    ----------
    cells : xarray.Dataset
        From `pneumo.engineer.own_study.repeated`.
    cylinder : str
        Its experiments count.
    """
    own = cells.sel(experiment=cells["cylinder"] == cylinder)
    left_out = _stories(own)
    if not own["random"].any():
        own = own.isel(run=[0])  # the others are this one again
    ran = (own["run_status"] == 0).all("experiment")
    kept = own.sel(run=ran)
    names, runs = tuple(own["experiment"].values.tolist()), kept.sizes["run"]
    if not runs:
        return Ranking(cylinder, names, 0, left_out, (), (), (), {}, "", "no full-order run succeeded", ())

    mse = kept["mse"].mean("chamber", skipna=False)
    n = best_n(mse.mean(("experiment", "run"), skipna=False))
    at_best = {
        name: mse.sel(model=name, n=_n_of(n, name, kept["mse"])) for name in MODELS
    }  # (experiment, run) each
    series = {name: value.mean("experiment", skipna=False).values for name, value in at_best.items()}
    place = _places({name: float(np.mean(value)) for name, value in series.items()})
    logs = {name: float(np.log(value.values).mean()) for name, value in at_best.items()}
    geometric = _places(logs)
    stacked = np.stack([value.values for value in at_best.values()])
    winner = np.where(np.isfinite(stacked), stacked, np.inf).argmin(axis=0)
    best = min(place, key=lambda name: place[name])
    rows = []
    for i, name in enumerate(MODELS):
        chambers = (
            kept["mse"]
            .sel(model=name, n=_n_of(n, name, kept["mse"]))
            .mean(("experiment", "run"), skipna=False)
            .values
        )
        played = MODELS[name].has_n and bool(np.isfinite(n.sel(model=name)))
        rows.append(
            Row(
                place[name],
                name,
                float(n.sel(model=name)) if played else np.nan,
                interval(series[name]),
                (float(chambers[0] ** 0.5), float(chambers[1] ** 0.5)),
                ratio(series[name], series[best]),
                geometric[name],
                int((winner == i).sum()),
                int(np.isnan(stacked[i]).sum()),
            )
        )
    rows.sort(key=lambda row: row.place)
    gains = tuple(_gain(*refinement, series) for refinement in REFINEMENTS)
    wrong = tuple(_wrong(kept, n, float(factor), series) for factor in kept["k_0_factor"].values)
    by_experiment = {
        name: {model: float(value.sel(experiment=name).mean() ** 0.5) for model, value in at_best.items()}
        for name in names
    }
    result = Ranking(cylinder, names, runs, left_out, tuple(rows), gains, wrong, by_experiment, "", "", ())
    return _recommended(result, series, kept)


def _n_of(n: xr.DataArray, model: str, mse: xr.DataArray) -> float:
    """Give the n of a model; any where it plays no role or where all failed, since the cell is the same."""
    value = float(n.sel(model=model))
    return value if np.isfinite(value) else float(mse["n"][0])


def _gain(refinement: str, without: str, refined: str, series: dict[str, np.ndarray]) -> Gain:
    r = ratio(series[refined], series[without])
    return Gain(
        refinement, without, refined, Interval(*(100 * (1 - value) for value in (r.value, r.high, r.low)))
    )


def _wrong(
    kept: xr.Dataset, n: xr.DataArray, factor: float, series: dict[str, np.ndarray]
) -> WrongConductance:
    """The models at their n, with a wrong k_0 in those that have one."""
    cells = (
        kept["mse_of_wrong_k_0"].sel(k_0_factor=factor).mean(("experiment", "run", "chamber"), skipna=False)
    )
    mse = {
        name: float(np.mean(series[name]))
        if model.wall == "none"
        else float(cells.sel(model=name, n=_n_of(n, name, kept["mse"])))
        for name, model in MODELS.items()
    }
    return WrongConductance(factor, {name: value**0.5 for name, value in mse.items()}, _places(mse))


def _spoken(r: Interval) -> str:
    """Write a ratio with its interval."""
    return f"{r.value:.2f} ({r.low:.2f} to {r.high:.2f})" if r.known else f"{r.value:.2f}"


def _recommended(ranking: Ranking, series: dict[str, np.ndarray], kept: xr.Dataset) -> Ranking:
    """Fill recommendation, reason and advice in."""
    best = ranking.rows[0]
    if not np.isfinite(best.mse.value):
        return ranking._replace(reason="every model failed in a run")
    order = sorted(MODELS, key=lambda name: (cost(MODELS[name]), list(MODELS).index(name)))
    good = [name for name in order if ranking.row(name).over_best.value <= 1 + MATERIAL]
    chosen = ranking.row(good[0])
    cheaper = [ranking.row(name) for name in order[: order.index(chosen.model)]]
    limit = f"{100 * MATERIAL:.0f} %"
    needs = "needs no k_0" if MODELS[chosen.model].wall == "none" else "needs k_0"
    if chosen.model == best.model:
        reason = f"{chosen.model} has the lowest mean square error"
    else:
        reason = (
            f"{chosen.model} is the cheapest model within {limit} of the lowest mean square error: it"
            f" {needs} and has {_spoken(chosen.over_best)} times the MSE of {best.model}"
        )
    if cheaper:
        rival = min(cheaper, key=lambda row: row.place)
        over = ratio(series[rival.model], series[chosen.model])
        reason += f"; {rival.model}, the best of the cheaper ones, has {_spoken(over)} times its MSE"
    advice = tuple(_advice(ranking, chosen, best, cheaper, kept))
    return ranking._replace(recommended=chosen.model, reason=reason, advice=advice)


def _advice(ranking: Ranking, chosen: Row, best: Row, cheaper: list[Row], kept: xr.Dataset) -> list[str]:
    """What would make the recommendation firmer."""
    found, limit = [], 1 + MATERIAL
    for row in [chosen, *cheaper]:
        if row.over_best.known and row.over_best.low <= limit <= row.over_best.high:
            found.append(
                f"More seeds: {row.model} has {_spoken(row.over_best)} times the MSE of {best.model},"
                f" an interval that holds the limit of {limit:g}."
            )
    if ranking.runs < 2:
        found.append("Repeat with several seeds of a random signal: one run has no error bars.")
    found += _about_k_0(ranking, chosen, best)
    short = kept["duration"].values < TIME_CONSTANTS * kept["time_constant"].values
    for name, time_constant in zip(
        kept["experiment"].values[short], kept["time_constant"].values[short], strict=True
    ):
        found.append(
            f"Longer runs: {name} lasts less than ten thermal time constants, {time_constant:.3g} s each."
        )
    edges = {float(kept["n"].min()), float(kept["n"].max())}
    on_edge = [row.model for row in (chosen, *([best] if best != chosen else [])) if row.n in edges]
    if on_edge:
        found.append(
            f"A wider grid: the best n of {' and '.join(on_edge)} is the first or last of the list n."
        )
    found += _about_runs(ranking, best)
    return found


def _about_runs(ranking: Ranking, best: Row) -> list[str]:
    """Whether the experiments, or another average over them, have another winner."""
    leaders = {
        name: min(rms, key=lambda model: np.nan_to_num(rms[model], nan=np.inf))
        for name, rms in ranking.by_experiment.items()
    }
    geometric = min(ranking.rows, key=lambda row: row.geometric_place).model
    if {*leaders.values(), geometric} == {best.model}:
        return []
    told = ", ".join(f"{model} in {name}" for name, model in leaders.items())
    return [
        f"Runs like those of your machine: best are {told}, and {geometric} by the geometric mean over"
        " all runs; the arithmetic mean is ruled by the most violent runs."
    ]


def _about_k_0(ranking: Ranking, chosen: Row, best: Row) -> list[str]:
    """What a wrong k_0 does to the models that need it."""
    walled = chosen if MODELS[chosen.model].wall != "none" else best
    if MODELS[walled.model].wall == "none":
        return []
    right = walled.mse.value**0.5
    parts, worst = [], walled.place
    for wrong in ranking.wrong_k_0:
        what = (
            "half" if wrong.factor == 0.5 else "twice" if wrong.factor == 2.0 else f"{wrong.factor:g} times"
        )
        parts.append(
            f"{wrong.rms[walled.model] / 1e3:.2f} kPa, place {wrong.place[walled.model]}, with {what} k_0"
        )
        worst = max(worst, wrong.place[walled.model])
    told = f"{walled.model} has {right / 1e3:.2f} kPa RMS at the right k_0; {'; '.join(parts)}."
    if walled != chosen:
        return [f"k_0, if {best.model} is to be used: {told}"]
    if worst > walled.place:
        return [f"Measure k_0, above all: {told}"]
    return [f"k_0 within a factor of two is enough for the order: {told}"]
