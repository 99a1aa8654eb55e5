"""Cells of tables and points of Figs 9 and 11: each computation gives one reproduced number, mark or word."""

import math
from collections.abc import Callable

import xarray as xr

from paper.study.paper_2006.equation_checks import GAMMA
from paper.study.paper_2006.paper_models import PAPER_MODELS, table_1_row
from paper.study.paper_2006.printed_tables import STATISTICS, read_table
from paper.study.paper_2006.results import StudyResults
from paper_verdict.findings import Finding, MissingEvidence
from pneumo.physics.cylinder import heat_area
from pneumo.physics.models import lane


def number_at(values: xr.DataArray, **labels: str | float) -> float:
    """One number of an array; `MissingEvidence` if the array lacks a label or the number is NaN."""
    try:
        value = values.sel(labels).item()
    except KeyError:
        raise MissingEvidence(f"this study has no {', '.join(map(str, labels.values()))}") from None
    if not math.isfinite(value):
        raise MissingEvidence(f"no finite result for {', '.join(map(str, labels.values()))}")
    return value


def feature(_: StudyResults, model: str, column: str) -> Finding:
    """One cell of Table 1, derived from the table of models."""
    return Finding(shown=table_1_row(PAPER_MODELS[model])[column])


def geometry(results: StudyResults, cylinder: str, column: str) -> Finding:
    """Dead volume as a tenth of half the stroke, m^3, or heat transfer area in mid-stroke, m^2: Table 2."""
    c = results.plant(cylinder).cylinder
    return Finding(0.1 * c.A_A * c.stroke / 2 if column == "V_d" else heat_area(0.0, c))


def heat_transfer_coefficient(results: StudyResults, cylinder: str, k_0: str) -> Finding:
    """lambda_0 = k_0 / A_q(x_0), W/(m^2 K): eq (12), Table 4."""
    c = results.plant(cylinder).cylinder
    return Finding(float(k_0) / heat_area(0.0, c))


def settling_time(results: StudyResults, experiment: str, quantity: str) -> Finding:
    """Settling time, s: Table 5."""
    return Finding(number_at(results.settling_times, experiment=experiment, quantity=quantity))


def ten_settling_times(results: StudyResults, experiment: str) -> Finding:
    """Whether Table 6's duration is at least ten times the experiment's longest settling time."""
    (duration,) = (float(cell["printed"]) for cell in read_table(6) if cell["row"] == experiment)
    ratio = duration / number_at(results.settling_times.max("quantity"), experiment=experiment)
    return Finding(holds=ratio >= 10, shown=f"{duration:g} s are {ratio:.1f} settling times")


def statistic(results: StudyResults, level: str, model: str, column: str) -> Finding:
    """Mean, standard deviation (Pa) or mean square (Pa^2) of a model's error: Tables 7 and 9."""
    return Finding(number_at(results.statistics[STATISTICS[column][0]], level=level, model=model))


def percentile(results: StudyResults, level: str, model: str, column: str) -> Finding:
    """Percentile of a model's mean square errors over experiments, decades of Pa^2: Figs 9 and 11."""
    return Finding(math.log10(number_at(results.statistics[column], level=level, model=model)))


def best_index(results: StudyResults, experiment: str, model: str, printed: str) -> Finding:
    """The n of the lowest mean square error: Table 8."""
    n = number_at(results.statistics["best_n"], experiment=experiment, model=model)
    return _with_cost(n, results, lambda cells: cells["mse"].sel(experiment=experiment, model=model), printed)


def _with_cost(
    n: float, results: StudyResults, errors: Callable[[xr.Dataset], xr.DataArray], printed: str
) -> Finding:
    """Finding with the best n; its margin is ln(MSE at the printed n / MSE at the best n)."""
    try:
        mse = errors(results.cells)
    except MissingEvidence:  # the printed tables, and runs of which only the tables are kept
        return Finding(n)
    at_printed, at_best = number_at(mse, n=float(printed)), number_at(mse, n=n)
    return Finding(n, margin=math.log(at_printed / at_best))


def constant_index(results: StudyResults, model: str, level: str, printed: str) -> Finding:
    """The n that is best for a whole level, printed beside Fig. 11; for a model without n, its index."""
    if not PAPER_MODELS[model].has_n:
        return Finding(lane(PAPER_MODELS[model], math.nan, GAMMA).n_V)
    n = number_at(results.statistics["constant_n"], level=level, model=model)

    def errors(cells: xr.Dataset) -> xr.DataArray:
        names = list(results.study.experiments_by_level[level])
        return cells["mse"].sel(experiment=names, model=model).mean("experiment")

    return _with_cost(n, results, errors, printed)
