"""Cells of the tables: each computation gives one reproduced number, mark or word."""

import math

import xarray as xr

from pneumo.papers.paper_2006.table1 import PAPER_MODELS, table_1_row
from pneumo.physics.cylinder import heat_area
from pneumo.verdict.published import STATISTICS, read_table
from pneumo.verdict.sources import Finding, MissingEvidence, StudyResults


def number_at(values: xr.DataArray, **labels: str) -> float:
    """One number of an array; `MissingEvidence` if the array lacks a label or the number is NaN."""
    try:
        value = values.sel(labels).item()
    except KeyError:
        raise MissingEvidence(f"this study has no {', '.join(labels.values())}") from None
    if not math.isfinite(value):
        raise MissingEvidence(f"no number for {', '.join(labels.values())}")
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
    """Whether Table 6's duration is at least ten of the longest settling times."""
    (duration,) = (float(cell["printed"]) for cell in read_table(6) if cell["row"] == experiment)
    longest = results.settling_times.max("quantity")
    ratio = duration / number_at(longest, experiment=experiment)
    return Finding(holds=ratio >= 10, shown=f"{duration:g} s are {ratio:.1f} settling times")


def statistic(results: StudyResults, level: str, model: str, column: str) -> Finding:
    """Mean, standard deviation (Pa) or mean square (Pa^2) of a model's error: Tables 7 and 9."""
    name = STATISTICS[column][0]
    return Finding(number_at(results.statistics[name], level=level, model=model))


def best_index(results: StudyResults, experiment: str, model: str) -> Finding:
    """The n of the lowest mean square error: Table 8."""
    return Finding(number_at(results.statistics["best_n"], experiment=experiment, model=model))


def constant_index(results: StudyResults, model: str, level: str) -> Finding:
    """The n that is best for a whole level: section 4 on Table 9."""
    if "constant_n" not in results.statistics:
        raise MissingEvidence("the paper prints no constant n")
    return Finding(number_at(results.statistics["constant_n"], level=level, model=model))
