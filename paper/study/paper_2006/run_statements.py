"""Statements about runs: excursions, air in the chambers, settling runs."""

import numpy as np

from paper.study.paper_2006.printed_tables import PAPER_FOLDER
from paper.study.paper_2006.results import StudyResults
from paper_verdict.files import read_cells
from paper_verdict.findings import Finding, MissingEvidence


def swing(results: StudyResults, quantity: str, side: str) -> Finding:
    """Range, over closed-loop experiments of cylinder D, of the largest excursion from equilibrium.

    Over both chambers: of P, Pa, from P_0 or T, K, from T_amb; `side`: ``up`` or down.
    """
    excursions: dict[str, float] = {}
    for name, experiment in results.experiments("D", closed_loop=True).items():
        values = results.run("datum", name, quantity)[quantity].values
        conditions = experiment.plant.conditions
        rest = conditions.P_0 if quantity == "P" else conditions.T_amb
        excursions[name] = float(values.max() - rest if side == "up" else rest - values.min())
    words = ", ".join(f"{name} {value:.3g}" for name, value in excursions.items())
    return Finding(low=min(excursions.values()), high=max(excursions.values()), shown=words)


def piston_stays_off_the_ends(results: StudyResults) -> Finding:
    """Whether the open-loop piston never reaches the ends of the stroke."""
    reach, name = max(
        (float(np.abs(results.run("datum", name, "x")["x"]).max()) / experiment.plant.cylinder.x_max, name)
        for name, experiment in results.experiments(closed_loop=False).items()
    )
    return Finding(holds=reach < 1, shown=f"{100 * reach:.1f} % of the half-stroke at most ({name})")


def value_after_release(
    results: StudyResults, experiment: str, quantity: str, chamber: str, after: float
) -> Finding:
    """Value in a settling run `after` s from release; as swing, the largest distance from it until then."""
    run = results.run("settling", experiment)
    start = float(run["release_time"])
    free = run[quantity].sel(chamber=chamber, t=slice(start, start + after + float(run["t"][1]) / 2))
    last = float(free[-1])
    return Finding(last, swing=float(np.abs(free - last).max()))


def turning_points(values: np.ndarray, least: float) -> list[int]:
    """Indices of the maxima and minima, in turn, after which a series turns by more than `least`."""
    turns: list[int] = []
    direction = high = low = 0  # rising, falling or not known; highest and lowest value since the last turn
    for i, value in enumerate(values):
        high, low = (i if value > values[high] else high), (i if value < values[low] else low)
        turn = high if direction >= 0 and values[high] - value > least else None
        turn = low if direction <= 0 and value - values[low] > least else turn
        if turn is not None:
            turns += [turn] if direction else []
            direction = -1 if turn == high else 1
            high = low = i
    return turns


def extremum(results: StudyResults, experiment: str, quantity: str, order: str, column: str) -> Finding:
    """Value, or time since release, s, of the `order`-th extremum (from 1) in a settling run: Fig. 7."""
    run = results.run("settling", experiment)
    free = run.sel(t=slice(float(run["release_time"]), None))
    name, _, chamber = quantity.partition("_")
    values = free[name].sel(chamber=chamber) if chamber else free[name]
    readings = [
        float(c["sigma"])
        for c in read_cells("figure7", PAPER_FOLDER)
        if (c["row"], c["column"]) == (quantity, "value")
    ]
    turns = turning_points(values.values, 2 * min(readings))
    if len(turns) < int(order):
        raise MissingEvidence(f"{quantity} has only {len(turns)} extrema")
    at = values[turns[int(order) - 1]]
    return Finding(float(at["t"] - run["release_time"]) if column == "time" else float(at))
