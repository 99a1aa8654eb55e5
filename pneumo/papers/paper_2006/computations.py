"""What the results say about a claim: small named computations, each from results to a `Finding`."""

import itertools
import math
from collections.abc import Sequence

import numpy as np
import xarray as xr

from pneumo.physics.models import MODELS
from pneumo.statistics.averages import OVERALL
from pneumo.verdict.published import STATISTICS, read_table
from pneumo.verdict.sources import Absent, Finding, Results, computation


def _at(values: xr.DataArray, **labels: str) -> float:
    """One number of an array; absent if the label is or the number is NaN."""
    try:
        value = values.sel(labels).item()
    except KeyError:
        raise Absent(f"this study has no {', '.join(labels.values())}") from None
    if not math.isfinite(value):
        raise Absent(f"no number for {', '.join(labels.values())}")
    return value


def _mse(results: Results, level: str) -> dict[str, float]:
    """Average mean square error of every model at a level, Pa^2."""
    return {model: _at(results.statistics["mse"], level=level, model=model) for model in MODELS}


# Cells of the tables


@computation
def statistic(results: Results, level: str, model: str, column: str) -> Finding:
    """Mean, standard deviation (Pa) or mean square (Pa^2) of a model's error: Tables 7 and 9."""
    name = STATISTICS[column][0]
    return Finding(_at(results.statistics[name], level=level, model=model))


@computation
def best_index(results: Results, experiment: str, model: str) -> Finding:
    """Return the n of the lowest mean square error: Table 8."""
    return Finding(_at(results.statistics["best_n"], experiment=experiment, model=model))


@computation
def constant_index(results: Results, model: str, level: str) -> Finding:
    """Return the n that is best for a whole level."""
    if "constant_n" not in results.statistics:
        raise Absent("the paper prints no constant n")
    return Finding(_at(results.statistics["constant_n"], level=level, model=model))


@computation
def settling_time(results: Results, experiment: str, quantity: str) -> Finding:
    """Settling time, s: Table 5."""
    return Finding(_at(results.settling_times, experiment=experiment, quantity=quantity))


@computation
def ten_settling_times(results: Results, experiment: str) -> Finding:
    """Whether Table 6's duration is at least ten of the longest settling times."""
    cells = read_table(6)
    duration = float(cells.loc[cells["row"] == experiment, "printed"].item())
    longest = results.settling_times.max("quantity")
    ratio = duration / _at(longest, experiment=experiment)
    return Finding(holds=ratio >= 10, shown=f"{duration:g} s are {ratio:.1f} settling times")


# Statements about models


def _percent(value: float) -> str:
    return f"{100 * value:.1f} %"


@computation
def quotient(
    results: Results, of: Sequence[str], over: Sequence[str], levels: Sequence[str], pick: str
) -> Finding:
    """Mean square error of models over that of the best of others: the highest or the lowest quotient."""
    shares: dict[tuple[str, str], float] = {}
    for level in levels:
        mse = _mse(results, level)
        best = min(mse[model] for model in over)
        shares |= {(model, level): mse[model] / best for model in of}
    choose = max if pick == "highest" else min
    words = []
    for model in of:
        level = choose(levels, key=lambda level: shares[model, level])
        words.append(f"{model} {_percent(shares[model, level])}" + (f" ({level})" if len(levels) > 1 else ""))
    return Finding(choose(shares.values()), shown=", ".join(words) if len(shares) > 1 else "")


def _decades(above: float, below: float) -> float:
    return math.log10(above / below)


@computation
def gap(results: Results, above: Sequence[str], below: Sequence[str], levels: Sequence[str]) -> Finding:
    """Decades of mean square error between the best of some models and the worst of others."""
    gaps, words = [], []
    for level in levels:
        mse = _mse(results, level)
        low, high = max(below, key=lambda m: mse[m]), min(above, key=lambda m: mse[m])
        gaps.append(_decades(mse[high], mse[low]))
        words.append(f"{high} over {low}: {mse[high] / mse[low]:.2f}")
    return Finding(min(gaps), shown="; ".join(words))


@computation
def smallest_gap(results: Results, groups: Sequence[Sequence[str]], levels: Sequence[str]) -> Finding:
    """Smallest gap between neighbouring groups of models, decades."""
    found = [gap(results, above, below, levels) for above, below in itertools.pairwise(groups)]
    values = [finding.value for finding in found if finding.value is not None]
    return Finding(min(values), shown="; ".join(finding.shown for finding in found))


@computation
def spread(results: Results, models: Sequence[str], levels: Sequence[str]) -> Finding:
    """Decades of mean square error between the best and the worst of some models."""
    spreads, words = [], []
    for level in levels:
        mse = _mse(results, level)
        low, high = min(models, key=lambda m: mse[m]), max(models, key=lambda m: mse[m])
        spreads.append(_decades(mse[high], mse[low]))
        words.append(f"{high} over {low}: {mse[high] / mse[low]:.2f}")
    return Finding(max(spreads), shown="; ".join(words))


@computation
def gain(results: Results, better: Sequence[str], than: str, levels: Sequence[str]) -> Finding:
    """Largest reduction of mean square error against one model, decades."""
    gains, words = [], []
    for level in levels:
        mse = _mse(results, level)
        gains += [_decades(mse[than], mse[model]) for model in better]
        words += [f"{model} over {than}: {mse[model] / mse[than]:.2f}" for model in better]
    return Finding(max(gains), shown="; ".join(words))


@computation
def best_models(results: Results, models: Sequence[str], level: str) -> Finding:
    """Whether the given models have the lowest mean square errors."""
    mse = _mse(results, level)
    order = sorted(mse, key=lambda m: mse[m])
    return Finding(holds=set(order[: len(models)]) == set(models), shown=" < ".join(order))


@computation
def next_best(results: Results, after: Sequence[str], claimed: str, level: str) -> Finding:
    """Whether a model is the best of those left when some are taken away."""
    mse = _mse(results, level)
    order = sorted((m for m in mse if m not in after), key=lambda m: mse[m])
    return Finding(holds=order[0] == claimed, shown=" < ".join(order))


@computation
def in_order(results: Results, models: Sequence[str], levels: Sequence[str]) -> Finding:
    """Whether mean square errors rise in the order of the models, at every level."""
    words = []
    for level in levels:
        mse = _mse(results, level)
        order = sorted(models, key=lambda m: mse[m])
        words.append(f"{level}: {' < '.join(order)}")
    return Finding(holds=all(word.endswith(" < ".join(models)) for word in words), shown="; ".join(words))


@computation
def same_order(results: Results, levels: Sequence[str], apart: float) -> Finding:
    """Whether models told apart overall keep their order at every level."""
    overall = _mse(results, OVERALL)
    swapped = []
    for level in levels:
        mse = _mse(results, level)
        swapped += [
            f"{a} above {b} ({level})"
            for a in mse
            for b in mse
            if _decades(overall[b], overall[a]) > apart and mse[a] >= mse[b]
        ]
    return Finding(holds=not swapped, shown="; ".join(swapped) or "no pair changes places")


@computation
def walls_before_mixing(results: Results, level: str) -> Finding:
    """Whether wall heat (M6 to the worst of M7-M10) saves more error than mixing (M5 to M6)."""
    mse = _mse(results, level)
    walls = mse["M6"] - max(mse[m] for m in ("M7", "M8", "M9", "M10"))
    mixing = mse["M5"] - mse["M6"]
    return Finding(
        holds=walls > mixing, shown=f"wall heat saves {walls / 1e6:.2f}, mixing {mixing / 1e6:.2f} x 1e6 Pa^2"
    )


@computation
def simplest_of_the_best(results: Results, claimed: str, level: str, apart: float) -> Finding:
    """Whether a model is the simplest one whose error cannot be told apart from the lowest."""
    mse = _mse(results, level)
    lowest = min(mse.values())
    alike = [m for m in mse if _decades(mse[m], lowest) <= apart]
    choice = min(alike, key=lambda m: (features(m), mse[m]))
    return Finding(
        holds=choice == claimed,
        shown=f"{choice}; {claimed} has {mse[claimed] / lowest:.2f} times the lowest mean square error",
    )


def features(model: str) -> int:
    """How many processes a model carries: changing temperature, mixing, and three steps of wall heat."""
    row = MODELS[model]
    walls = ("none", "k_0", "lambda_0 A_q", "lambda A_q").index(row.wall)
    return (row.temperature == "polytropic") + row.mixing + walls


@computation
def best_n_varies(results: Results) -> Finding:
    """Whether each of the six best models has more than one best n over the experiments."""
    best = results.statistics["best_n"]
    spans = {m: (float(best.sel(model=m).min()), float(best.sel(model=m).max())) for m in list(MODELS)[4:]}
    return Finding(
        holds=all(low < high for low, high in spans.values()),
        shown=", ".join(f"{m} {low:g}-{high:g}" for m, (low, high) in spans.items()),
    )


@computation
def no_single_best(results: Results) -> Finding:
    """Whether different experiments have different best models, each at its best n."""
    mse = results.cells["mse"]
    winners = mse.min("n").idxmin("model").values.tolist()
    count = {model: winners.count(model) for model in MODELS if model in winners}
    shown = ", ".join(f"{model} best in {times}" for model, times in count.items())
    return Finding(holds=len(count) > 1, shown=shown)


@computation
def same_cells(results: Results, one: str, other: str, n: float) -> Finding:
    """Whether two models have the same errors in every experiment at one n."""
    pair = [results.cells["mse"].sel(model=model, n=n).values for model in (one, other)]
    worst = float(np.nanmax(np.abs(pair[0] / pair[1] - 1)))
    # Wall heat is a zero times k_0 there, and rounding of mu^2 + sigma^2 is all that can differ.
    return Finding(
        holds=worst <= 1e-12, shown=f"largest relative difference of mean square errors {worst:.1g}"
    )


# Runs


@computation
def swing(results: Results, quantity: str, side: str) -> Finding:
    """Largest excursion from equilibrium over both chambers, in each closed-loop experiment of cylinder D."""
    found = {}
    for name, experiment in results.experiments("D", closed_loop=True).items():
        values = results.datum(name, quantity)[quantity].values
        conditions = experiment.plant.conditions
        rest = conditions.P_0 if quantity == "P" else conditions.T_amb
        found[name] = float(values.max() - rest if side == "up" else rest - values.min())
    words = ", ".join(f"{name} {value:.3g}" for name, value in found.items())
    return Finding(low=min(found.values()), high=max(found.values()), shown=words)


@computation
def number_of_states(results: Results) -> Finding:
    """Count position, velocity and the pressures and temperatures of the chambers."""
    datum = results.datum(next(iter(results.study.experiments)), "x", "v", "P", "T")
    return Finding(sum(datum[name].sizes.get("chamber", 1) for name in ("x", "v", "P", "T")))


@computation
def air_is_kept(results: Results) -> Finding:
    """Whether the mass of air in both chambers stays, from release on, in every open-loop settling run."""
    worst = 0.0
    for name, experiment in results.experiments(closed_loop=False).items():
        run = results.settling(name)
        run = run.sel(t=slice(float(run["release_time"]), None))
        c = experiment.plant.cylinder
        outward = run["x"] * xr.DataArray([1.0, -1.0], {"chamber": ["A", "B"]})
        volume = c.V_d + c.A_A * (c.stroke / 2 + outward)
        mass = run["P"] * volume / (experiment.plant.gas.R * run["T"])
        worst = max(worst, float(np.abs(mass / mass.isel(t=0) - 1).max()))
    # The integrator keeps mass to its own error, not exactly: P and T are its states, not the mass.
    return Finding(holds=worst <= 1e-3, shown=f"mass changes by at most {worst:.1g} of itself")


@computation
def piston_stays_off_the_ends(results: Results) -> Finding:
    """Whether the open-loop piston never reaches the ends of the stroke."""
    reach = {
        name: float(np.abs(results.datum(name, "x")["x"]).max()) / experiment.plant.cylinder.x_max
        for name, experiment in results.experiments(closed_loop=False).items()
    }
    far = max(reach, key=lambda name: reach[name])
    return Finding(holds=reach[far] < 1, shown=f"{_percent(reach[far])} of the half-stroke at most ({far})")


@computation
def number_of_experiments(results: Results) -> Finding:
    """Count the experiments behind the averages of Table 7."""
    return Finding(int(results.statistics["experiments"].sel(level=OVERALL)))


@computation
def release_time(results: Results, experiment: str) -> Finding:
    """Time at which the force is released, s."""
    return Finding(float(results.settling(experiment)["release_time"]))


@computation
def final_value(results: Results, experiment: str, quantity: str, chamber: str) -> Finding:
    """Value at the end of a settling run, and its change since the release."""
    run = results.settling(experiment)
    free = run[quantity].sel(chamber=chamber, t=slice(float(run["release_time"]), None))
    last = float(free[-1])
    return Finding(last, swing=float(np.abs(free - last).max()))
