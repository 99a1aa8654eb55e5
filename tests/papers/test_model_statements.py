"""Statements about models on errors chosen by hand, and computations whose answer is known otherwise."""

import math
from pathlib import Path

import pytest
import xarray as xr
from paper_study import STUDY

from paper.study.paper_2006 import model_statements as s
from paper.study.paper_2006.equation_checks import largest_flow
from paper.study.paper_2006.paper_models import PAPER_MODELS, table_1_row
from paper.study.paper_2006.printed_tables import read_table
from paper.study.paper_2006.results import StudyResults
from paper.study.paper_2006.table_cells import best_index
from pneumo.physics.valve import choked_flow

MODELS = list(PAPER_MODELS)
MSE = dict(zip(MODELS, [500.0, 60.0, 120.0, 2800.0, 24.0, 21.0, 13.0, 11.6, 11.2, 11.3], strict=True))
FOUR = ["M7", "M8", "M9", "M10"]


def results(**changes) -> StudyResults:
    """Results whose mean square errors are the same at every level, but for changes."""
    study_results = StudyResults(Path(), "published")
    mse = [list((MSE | changes).values())] * 2
    coords = {"level": ["overall", "typical"], "model": MODELS}
    study_results.statistics = xr.DataArray(mse, coords).to_dataset(name="mse")
    study_results.study = STUDY
    return study_results


@pytest.mark.parametrize(
    ("finding", "value"),
    [  # from the best above to the worst below
        (s.gap(results(), ["M1", "M2", "M3"], ["M5", "M6"], "overall"), 60 / 24),
        (s.smallest_gap(results(), [["M1", "M2", "M3"], ["M5", "M6"], FOUR], "overall"), 21 / 13),
        (s.spread(results(), ["M7", "M8", "M9"], "overall"), 13 / 11.2),
        (s.gain(results(), ["M9", "M10"], "M8", "overall"), 11.6 / 11.2),
    ],
)
def test_distances_between_models(finding, value):
    assert finding.value == pytest.approx(math.log10(value))


@pytest.mark.parametrize(
    ("finding", "holds", "margin"),
    [
        (s.best_models(results(), FOUR, "overall"), True, math.log10(21 / 13)),
        (s.best_models(results(M7=22.0), FOUR, "overall"), False, math.log10(21 / 22)),
        (s.next_best(results(), FOUR, "M6", "overall"), True, math.log10(24 / 21)),
        (s.next_best(results(), FOUR, "M5", "overall"), False, math.log10(21 / 24)),
        (s.in_order(results(), ["M7", "M5", "M2"], ["overall", "typical"]), True, math.log10(24 / 13)),
        (s.in_order(results(), ["M5", "M6"], ["typical"]), False, math.log10(21 / 24)),
        (s.same_order(results(), ["typical"], 0.5), True, math.log10(500 / 120)),
        # Wall heat saves from M6 to the worst of M7 to M10, mixing from M5 to M6.
        (s.walls_before_mixing(results(), "overall"), True, math.log10(2 * 21 / (24 + 13))),
        (s.walls_before_mixing(results(M10=18.5), "overall"), False, math.log10(2 * 21 / (24 + 18.5))),
        # M9 is the best; within 0.1 decades are M7 and M8 with fewer processes, M7 with the fewest.
        (s.simplest_of_the_best(results(), "M7", "overall", 0.1), True, 0.1 - math.log10(13 / 11.2)),
        (s.simplest_of_the_best(results(M7=15.0), "M7", "overall", 0.1), False, 0.1 - math.log10(15 / 11.2)),
        (s.simplest_of_the_best(results(), "M8", "overall", 0.1), False, math.log10(13 / 11.2) - 0.1),
    ],
)
def test_statements_and_how_far_they_are_from_turning_over(finding, holds, margin):
    assert finding.holds is holds
    assert finding.margin == pytest.approx(margin)


def test_a_best_n_has_the_cost_of_the_printed_one():
    study_results = results()
    coords = {"experiment": ["E07"], "model": ["M8"], "n": [1.3, 1.35, 1.4]}
    study_results.cells = xr.Dataset({"mse": xr.DataArray([[[12.0, 10.0, 11.0]]], coords)})
    best = xr.DataArray([[1.35]], {"experiment": ["E07"], "model": ["M8"]})
    study_results.statistics = xr.Dataset({"best_n": best})
    index = best_index(study_results, "E07", "M8", "1.40")
    assert index.value == 1.35
    assert index.margin == pytest.approx(math.log(1.1))
    assert best_index(study_results, "E07", "M8", "1.35").margin == 0


def test_table_1_follows_from_the_models_and_the_largest_flow_is_in_standard_litres():
    rows = {name: table_1_row(model) for name, model in PAPER_MODELS.items()}
    derived = [(name, column, cell) for name, row in rows.items() for column, cell in row.items()]
    assert derived == [(cell["row"], cell["column"], cell["printed"]) for cell in read_table(1)]
    plant = STUDY.experiments["E01"].plant
    kg_per_s = choked_flow(plant.valve.k_xu * plant.valve.u_max, 7e5, 293.0, plant.gas)
    litre = 101325 * 1e-3 / (287.0 * 293.15)  # kg
    assert largest_flow(results(), "D").value == pytest.approx(kg_per_s / litre * 60, rel=1e-12)
