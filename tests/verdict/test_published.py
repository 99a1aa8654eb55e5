"""The published tables against themselves, each other and the paper's formulas: needs no result of ours."""

import numpy as np
import pandas as pd
import pytest

from paper.study.paper_2006 import printed_tables as published
from paper.study.paper_2006 import setup_checks
from paper.study.paper_2006.paper_models import PAPER_MODELS
from paper.study.paper_2006.setup_checks import rows_within
from pneumo.verdict import PaperError

EPS = np.finfo(float).eps
CELLS = {1: 40, 2: 8, 3: 20, 4: 8, 5: 64, 6: 16, 7: 30, 8: 96, 9: 90}
EXPERIMENTS = [f"E{j:02d}" for j in range(1, 17)]
MODELS = list(PAPER_MODELS)
WITHOUT_N = ["M1", "M3", "M4"]


@pytest.mark.parametrize("number", CELLS)
def test_every_cell_is_there_once_and_notes_begin_with_a_known_word(number):
    cells = pd.DataFrame(published.read_table(number))
    assert list(cells.columns[:4]) == ["row", "column", "printed", "note"]
    assert len(cells) == CELLS[number]
    assert not cells.drop(columns=["printed", "note"]).duplicated().any()
    assert (cells["printed"] != "").all()
    assert cells["note"].str.fullmatch(r"|(misprint|suspect|blank): .+").all()


@pytest.mark.parametrize("number", [5, 6, 8])
def test_experiments_are_coded_as_in_the_paper(number):
    for cell in published.read_table(number):
        j = int(cell["row"].removeprefix("E"))
        type_and_cylinder = [("open", "D"), ("closed", "D"), ("open", "E"), ("closed", "E")][(j - 1) % 4]
        assert (cell["type"], cell["cylinder"]) == type_and_cylinder
        assert cell["k_0"] == ["0.02", "0.1", "0.5", "2.5"][(j - 1) // 4]


def test_tables_that_are_not_there_or_incomplete_are_named(tmp_path):
    with pytest.raises(PaperError, match="number = 10: the paper has Tables 1 to 9"):
        published.read_table(10)
    with pytest.raises(PaperError, match=rf"{tmp_path}/published/table5.csv: no such file"):
        published.read_table(5, folder=tmp_path)
    cells = published.read_table(8)
    del cells[7]
    with pytest.raises(ValueError, match=r"\('E02', 'M6'\)"):
        published._array(cells, {"experiment": "row", "model": "column"})


@pytest.mark.parametrize(
    ("text", "digits", "expected"),
    [
        *(("1.02e4", None, 50.0), ("140", None, 0.5), ("-0.047", None, 0.0005), ("4.96e8", None, 5e5)),
        *(("1.571e-6", None, 5e-10), ("26.280", None, 0.0005), ("3000", 2, 50.0), ("-110", 2, 5.0)),
        *(("46.0", 2, 0.5), ("2.37", 2, 0.005), ("-0.860", 2, 0.005), ("18", 2, 0.5), ("0", 2, 0.5)),
    ],
)
def test_half_unit(text, digits, expected):
    assert published.half_unit(text, digits) == expected


@pytest.mark.parametrize("text", ["—", "", "nan", "n"])
def test_half_unit_of_no_number(text):
    with pytest.raises(ValueError, match="printed = "):
        published.half_unit(text)


def test_shapes_labels_and_SI_units():
    labels = {"experiment": EXPERIMENTS, "quantity": ["P_A", "P_B", "T_A", "T_B"], "model": MODELS}
    labels["level"] = ["adiabatic", "typical", "isothermal"]
    for table, dims in (
        (published.table5(), ["experiment", "quantity"]),
        (published.table7(), ["model"]),
        (published.table9(), ["level", "model"]),
    ):
        assert {dim: table[dim].values.tolist() for dim in table.sizes} == {dim: labels[dim] for dim in dims}
    best = published.table8()
    assert best["experiment"].values.tolist() == EXPERIMENTS and best["model"].values.tolist() == MODELS[4:]
    grid = [float(f"{1 + 0.05 * i:.2f}") for i in range(9)]  # the nine decimal literals 1.0, 1.05 ... 1.4
    assert best.isin(grid).all()
    cell = published.table9().sel(level="typical", model="M9")
    values = {"mean_error": -4.7, "mean_error_half_unit": 0.05, "std": 2400, "mse": 5.6e6}
    assert {name: cell[name].item() for name in values} == pytest.approx(values, rel=4 * EPS)
    assert cell["mean_error_printed"].item() == "-0.047"
    assert published.table7()["mse"].sel(model="M4").item() == pytest.approx(2.84e9, rel=4 * EPS)
    assert published.table8().sel(experiment="E07", model="M7").item() == 1.35


def test_odd_cells_of_table_5_and_its_underlined_longest_times():
    times = published.table5()
    assert " ".join(times["printed"].sel(experiment="E04").values) == "88.676 0.43324 35.950 110.460"
    assert times["printed"].sel(experiment="E08", quantity="T_A").item() == "11.338"
    assert (times["half_unit"].where(times["printed"] != "0.43324", 0.0005) == 0.0005).all()
    longest = published.table5().idxmax("quantity").to_series().to_dict()
    underlined = [(c["row"], c["column"]) for c in published.read_table(5) if c["underlined"] == "yes"]
    assert underlined == list(longest.items())


def test_open_loop_settling_time_falls_as_conductance_grows():
    # With the valve shut the walls set the pace: temperatures settle in a time near proportional to 1/k_0.
    times = published.table5()
    for cylinder in ("D", "E"):
        open_loop = times[(times.cylinder == cylinder) & (times.type == "open")].sortby("k_0")
        assert (open_loop.diff("experiment") < 0).all()
        pace = (open_loop * open_loop.k_0).sel(quantity=["T_A", "T_B"])
        assert pace.max() < 1.3 * pace.min()


def test_rows_are_what_eq_16_gives_with_the_sample_variance_only():
    assert rows_within(divisor_is_N=False) == (40, 40)
    assert rows_within(divisor_is_N=True) == (31, 40)  # the print of these is too coarse to tell


@pytest.mark.parametrize("factor", [0.7, 1.3])
def test_a_wrong_mean_square_error_would_be_noticed_in_every_row(monkeypatch, factor):
    for name in ("table7", "table9"):
        table = getattr(published, name)()
        wrong = table.assign(mse=factor * table["mse"])
        monkeypatch.setattr(setup_checks, name, lambda wrong=wrong: wrong)
    assert rows_within(divisor_is_N=False) == (0, 40)


def test_levels_and_one_n_that_is_never_better_than_the_best_of_each_experiment():
    levels = published.table9()
    k_0 = [0.02, 0.1, 0.5, 2.5]
    assert levels["k_0_low"].values.tolist() == k_0[:3]
    assert levels["k_0_high"].values.tolist() == k_0[1:]
    for low, high in zip(levels["k_0_low"], levels["k_0_high"], strict=True):
        assert published.table5()["k_0"].isin([low, high]).sum() == 8
    overall = published.table7()
    halves, half_unit = adiabatic_and_isothermal("mse")
    assert (halves + half_unit >= overall["mse"] - overall["mse_half_unit"]).all()


def adiabatic_and_isothermal(name):
    """Table 9 averaged over these two levels, which make up the sixteen experiments, and its half unit."""
    halves = published.table9().sel(level=["adiabatic", "isothermal"])
    return halves[name].mean("level"), halves[f"{name}_half_unit"].mean("level")


@pytest.mark.parametrize("name", ["mean_error", "mse"])
@pytest.mark.parametrize("model", WITHOUT_N)
def test_levels_average_to_table_7_where_there_is_no_n(model, name):
    overall = published.table7().sel(model=model)
    halves, half_unit = adiabatic_and_isothermal(name)
    tolerance = half_unit.sel(model=model) + overall[f"{name}_half_unit"]
    assert abs(halves.sel(model=model) - overall[name]) <= tolerance


@pytest.mark.parametrize("model", WITHOUT_N)
def test_typical_level_lies_within_the_other_two_where_there_is_no_n(model):
    # It takes half of each, and squared errors are not negative.
    mse, half_unit = (published.table9()[name].sel(model=model) for name in ("mse", "mse_half_unit"))
    assert mse.sel(level="typical") <= (mse + half_unit).sel(level=["adiabatic", "isothermal"]).sum()


@pytest.mark.parametrize("number", [9, 10, 11])
def test_averages_of_a_figure_are_those_of_its_table(number):
    # Read less one constant per panel: only the scatter about it could be off.
    printed = {"overall": published.table7()["mse"]}
    printed |= {str(level): mse for level, mse in published.table9()["mse"].groupby("level", squeeze=False)}
    for cell in published.read_cells(f"figure{number}", published.PAPER_FOLDER):
        if cell["column"] == "average":
            value, mse = float(cell["printed"]), printed[cell["level"]].sel(model=cell["row"]).item()
            assert abs(value - (mse if number == 10 else np.log10(mse))) <= 2.5 * float(cell["sigma"]), cell


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


FIGURE_7 = published.read_cells("figure7", published.PAPER_FOLDER)
EXTREMA = {(c["row"], int(c["order"]), c["column"]): c for c in FIGURE_7}


@pytest.mark.parametrize("panel", ["x", "P_A", "P_B", "T_A", "T_B"])
def test_extrema_of_fig_7_lie_on_its_curves_and_count_from_their_release(panel):
    t, low, high = published.traces_of_fig_7()[panel]
    sigma = float(EXTREMA[panel, 2, "value"]["sigma"])
    start = np.flatnonzero(t > -0.3)[0]
    change = np.maximum(abs(low - low[start]), abs(high - high[start]))
    moved = start + np.argmax(change[start:] > 2 * sigma)
    # A column also shows its neighbours: the release lies from the last flat one to after the first other.
    assert t[moved - 1] <= 0.0 <= t[moved] + 0.0063
    previous = 0.0
    for order in range(1, 9):
        value, time = (EXTREMA[panel, order, column] for column in ("value", "time"))
        at = float(time["printed"])
        near = abs(t - at) <= 0.0125
        tip = high[near].max() if value["kind"] == "max" else low[near].min()
        assert abs(tip - float(value["printed"])) <= float(value["sigma"]), (panel, order)
        assert previous < at, (panel, order)
        assert value["kind"] == ("max" if (order % 2 == 1) == (panel in ("x", "P_B", "T_B")) else "min")
        previous = at
