"""Statements about models on errors chosen by hand: what is found, and how far it is from turning over."""

import math
from pathlib import Path

import pytest
import xarray as xr
from paper_study import STUDY

from paper.study.paper_2006 import model_statements as s
from paper.study.paper_2006.paper_models import PAPER_MODELS
from paper.study.paper_2006.printed_tables import read_table
from paper.study.paper_2006.results import StudyResults
from paper.study.paper_2006.table_cells import best_index, ten_settling_times

MODELS = list(PAPER_MODELS)
MSE = dict(zip(MODELS, [500.0, 60.0, 120.0, 2800.0, 24.0, 21.0, 13.0, 11.6, 11.2, 11.3], strict=True))


FOUR = ["M7", "M8", "M9", "M10"]


def results(**changes) -> StudyResults:
    """Results whose mean square errors are the same at every level, but for changes."""
    study_results = StudyResults(Path(), "published")
    mse = [list((MSE | changes).values())] * 2
    coords = {"level": ["overall", "typical"], "model": MODELS}
    study_results.statistics = xr.DataArray(mse, coords).to_dataset(name="mse")
    return study_results


def test_wall_heat_and_mixing_by_what_they_save():
    """Wall heat: from M6 to the worst of M7 to M10, 8; mixing: from M5 to M6, 3."""
    finding = s.walls_before_mixing(results(), "overall")
    assert finding.holds and finding.margin == pytest.approx(math.log10(2 * 21 / (24 + 13)))
    close = s.walls_before_mixing(results(M10=18.5), "overall")  # the worst counts, not the best
    assert not close.holds and close.margin < 0
    assert s.walls_before_mixing(results(M7=18.0, M5=24.0), "overall").margin == pytest.approx(0.0)


def test_gaps_are_from_the_best_above_to_the_worst_below():
    finding = s.gap(results(), ["M1", "M2", "M3"], ["M5", "M6"], "overall")
    assert finding.value == pytest.approx(math.log10(60 / 24))
    finding = s.smallest_gap(results(), [["M1", "M2", "M3"], ["M5", "M6"], FOUR], "overall")
    assert finding.value == pytest.approx(math.log10(21 / 13))
    assert s.spread(results(), ["M7", "M8", "M9"], "overall").value == pytest.approx(math.log10(13 / 11.2))
    assert s.gain(results(), ["M9", "M10"], "M8", "overall").value == pytest.approx(math.log10(11.6 / 11.2))


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
    ],
)
def test_orders_and_how_far_they_are_from_turning_over(finding, holds, margin):
    assert finding.holds is holds
    assert finding.margin == pytest.approx(margin)


def test_the_simplest_of_the_best():
    """M9 is the best; within 0.1 decades are M7 and M8 with fewer processes, M7 with the fewest."""
    finding = s.simplest_of_the_best(results(), "M7", "overall", 0.1)
    assert finding.holds and finding.margin == pytest.approx(0.1 - math.log10(13 / 11.2))
    refuted = s.simplest_of_the_best(results(M7=15.0), "M7", "overall", 0.1)
    assert not refuted.holds and refuted.margin == pytest.approx(0.1 - math.log10(15 / 11.2))
    assert not s.simplest_of_the_best(results(), "M8", "overall", 0.1).holds


@pytest.mark.parametrize(("share", "holds"), [(0.99, True), (1.0, True), (1.01, False), (5.0, False)])
def test_runs_last_ten_settling_times(share, holds):
    """The longest of four settling times is a tenth of Table 6's duration, times a share."""
    (duration,) = (cell["printed"] for cell in read_table(6) if cell["row"] == "E05")
    times = [1.0, 0.5, 0.2, share * float(duration) / 10]
    study_results = StudyResults(Path(), "published")
    coords = {"experiment": ["E05"], "quantity": ["P_A", "P_B", "T_A", "T_B"]}
    study_results.settling_times = xr.DataArray([times], coords)
    assert ten_settling_times(study_results, "E05").holds is holds


def test_a_best_n_has_the_cost_of_the_printed_one():
    study_results = StudyResults(Path(), "published")
    study_results.study = STUDY
    coords = {"experiment": ["E07"], "model": ["M8"], "n": [1.3, 1.35, 1.4]}
    study_results.cells = xr.Dataset({"mse": xr.DataArray([[[12.0, 10.0, 11.0]]], coords)})
    best = xr.DataArray([[1.35]], {"experiment": ["E07"], "model": ["M8"]})
    study_results.statistics = xr.Dataset({"best_n": best})
    index = best_index(study_results, "E07", "M8", "1.40")
    assert index.value == 1.35
    assert index.margin == pytest.approx(math.log(1.1)) and index.varies == pytest.approx(math.log(10.0))
    assert best_index(study_results, "E07", "M8", "1.35").margin == 0
