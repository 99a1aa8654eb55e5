"""The published tables against themselves, each other and the paper's formulas: needs no result of ours."""

import numpy as np
import pandas as pd
import pytest

from paper.study.paper_2006 import printed_tables as published
from paper.study.paper_2006.setup_checks import rows_within

CELLS = {1: 40, 2: 8, 3: 20, 4: 8, 5: 64, 6: 16, 7: 30, 8: 96, 9: 90}
WITHOUT_N = ["M1", "M3", "M4"]
SEVEN, NINE = published.table7(), published.table9()


@pytest.mark.parametrize("number", CELLS)
def test_every_cell_is_there_once_and_experiments_are_coded_as_in_the_paper(number):
    cells = pd.DataFrame(published.read_table(number))
    assert list(cells.columns[:4]) == ["row", "column", "printed", "note"]
    assert len(cells) == CELLS[number]
    assert not cells.drop(columns=["printed", "note"]).duplicated().any()
    assert (cells["printed"] != "").all()
    assert cells["note"].str.fullmatch(r"|(misprint|suspect|blank): .+").all()
    for _, cell in cells.iterrows() if number in (5, 6, 8) else ():
        j = int(cell["row"].removeprefix("E"))
        type_and_cylinder = [("open", "D"), ("closed", "D"), ("open", "E"), ("closed", "E")][(j - 1) % 4]
        assert (cell["type"], cell["cylinder"]) == type_and_cylinder
        assert cell["k_0"] == ["0.02", "0.1", "0.5", "2.5"][(j - 1) // 4]


def test_cells_are_in_SI_units_at_their_labels():
    cell = NINE.sel(level="typical", model="M9")
    values = {"mean_error": -4.7, "mean_error_half_unit": 0.05, "std": 2400, "mse": 5.6e6}
    assert {name: cell[name].item() for name in values} == pytest.approx(values)
    assert cell["mean_error_printed"].item() == "-0.047"
    assert SEVEN["mse"].sel(model="M4").item() == pytest.approx(2.84e9)
    assert published.table8().sel(experiment="E07", model="M7").item() == 1.35
    grid = [float(f"{1 + 0.05 * i:.2f}") for i in range(9)]  # the nine decimal literals 1.0, 1.05 ... 1.4
    assert published.table8().isin(grid).all()


def test_odd_cells_of_table_5_and_its_underlined_longest_times():
    times = published.table5()
    assert " ".join(times["printed"].sel(experiment="E04").values) == "88.676 0.43324 35.950 110.460"
    assert times["printed"].sel(experiment="E08", quantity="T_A").item() == "11.338"
    longest = times.idxmax("quantity").to_series().to_dict()
    underlined = [(c["row"], c["column"]) for c in published.read_table(5) if c["underlined"] == "yes"]
    assert underlined == list(longest.items())


def test_rows_are_what_eq_16_gives_with_the_sample_variance_only():
    assert rows_within(divisor_is_N=False) == (40, 40)
    assert rows_within(divisor_is_N=True) == (31, 40)  # the print of these is too coarse to tell


@pytest.mark.parametrize("name", ["mean_error", "mse"])
def test_levels_average_to_table_7_where_there_is_no_n_and_to_no_less_elsewhere(name):
    halves = NINE.sel(level=["adiabatic", "isothermal"])  # which make up the sixteen experiments
    off = halves[name].mean("level") - SEVEN[name]
    tolerance = halves[f"{name}_half_unit"].mean("level") + SEVEN[f"{name}_half_unit"]
    assert (abs(off) <= tolerance).sel(model=WITHOUT_N).all()
    assert name != "mse" or (off >= -tolerance).all()  # one n is never better than the best of each
    # The typical level takes half of each of the others, and squared errors are not negative.
    mse = NINE["mse"] + NINE["mse_half_unit"]
    ends = mse.sel(level=["adiabatic", "isothermal"]).sum("level")
    assert (NINE["mse"].sel(level="typical", drop=True) <= ends).sel(model=WITHOUT_N).all()


def test_percentiles_of_the_figures_agree_and_constant_n_lie_on_the_grid():
    nine, ten = published.percentiles(9), published.percentiles(10)
    apart = abs(np.log10(ten["p90"] / nine["p90"]))
    assert apart.sizes == {"level": 1, "model": 6} and (apart <= 0.011).all()
    assert (abs(ten["p10"] - nine["p10"]) <= 1.3e5).all()
    for number in (9, 10, 11):
        values = published.percentiles(number)
        assert (values["p10"] < values["p90"]).all()
    assert values["constant_n"].sizes == {"level": 3, "model": 9}
    assert values["constant_n"].isin([1.0, 1.2, 1.25, 1.3, 1.35, 1.4]).all()


@pytest.mark.parametrize("panel", ["x", "P_A", "P_B", "T_A", "T_B"])
def test_extrema_of_fig_7_lie_on_its_curves_and_count_from_their_release(panel):
    cells = published.read_cells("figure7", published.PAPER_FOLDER)
    extrema = {(int(c["order"]), c["column"]): c for c in cells if c["row"] == panel}
    t, low, high = published.traces_of_fig_7()[panel]
    sigma = float(extrema[2, "value"]["sigma"])
    start = np.flatnonzero(t > -0.3)[0]
    change = np.maximum(abs(low - low[start]), abs(high - high[start]))
    moved = start + np.argmax(change[start:] > 2 * sigma)
    # A column also shows its neighbours: the release lies from the last flat one to after the first other.
    assert t[moved - 1] <= 0.0 <= t[moved] + 0.0063
    previous = 0.0
    for order in range(1, 9):
        value, time = (extrema[order, column] for column in ("value", "time"))
        at = float(time["printed"])
        near = abs(t - at) <= 0.0125
        tip = high[near].max() if value["kind"] == "max" else low[near].min()
        assert abs(tip - float(value["printed"])) <= float(value["sigma"]), (panel, order)
        assert previous < at, (panel, order)
        assert value["kind"] == ("max" if (order % 2 == 1) == (panel in ("x", "P_B", "T_B")) else "min")
        previous = at
