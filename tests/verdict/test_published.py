"""The published tables against themselves, each other and the paper's formulas: needs no result of ours."""

import re

import numpy as np
import pandas as pd
import pytest

from pneumo.papers.paper_2006 import setup_checks
from pneumo.papers.paper_2006.setup_checks import rows_within
from pneumo.verdict import PaperError, published

EPS = np.finfo(float).eps
CELLS = {1: 40, 2: 8, 3: 20, 4: 8, 5: 64, 6: 16, 7: 30, 8: 96, 9: 90}
EXPERIMENTS = [f"E{j:02d}" for j in range(1, 17)]
MODELS = [f"M{i}" for i in range(1, 11)]
WITHOUT_N = ["M1", "M3", "M4"]


# The files


@pytest.mark.parametrize("number", CELLS)
def test_every_cell_is_there_once(number):
    cells = pd.DataFrame(published.read_table(number))
    assert list(cells.columns[:4]) == ["row", "column", "printed", "note"]
    assert len(cells) == CELLS[number]
    assert not cells.drop(columns=["printed", "note"]).duplicated().any()
    assert (cells["printed"] != "").all()


@pytest.mark.parametrize("number", range(1, 10))
def test_notes_begin_with_a_known_word(number):
    notes = [cell["note"] for cell in published.read_table(number)]
    assert all(re.fullmatch(r"|(unreadable|misprint|suspect|blank): .+", note) for note in notes)


@pytest.mark.parametrize("number", [5, 6, 8])
def test_experiments_are_coded_as_in_the_paper(number):
    for cell in published.read_table(number):
        j = int(cell["row"].removeprefix("E"))
        type_and_cylinder = [("open", "D"), ("closed", "D"), ("open", "E"), ("closed", "E")][(j - 1) % 4]
        assert (cell["type"], cell["cylinder"]) == type_and_cylinder
        assert cell["k_0"] == ["0.02", "0.1", "0.5", "2.5"][(j - 1) // 4]


def test_a_table_the_paper_does_not_have():
    with pytest.raises(PaperError, match="number = 10: the paper has Tables 1 to 9"):
        published.read_table(10)


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(PaperError, match=rf"{tmp_path}/published/table5.csv: no such file"):
        published.read_table(5, folder=tmp_path)


def test_an_incomplete_table_names_the_cell():
    cells = published.read_table(8)
    del cells[7]
    with pytest.raises(ValueError, match=r"\('E02', 'M6'\)"):
        published._array(cells, {"experiment": "row", "model": "column"})


# Half units


@pytest.mark.parametrize(
    ("text", "digits", "expected"),
    [
        ("1.02e4", None, 50.0),
        ("140", None, 0.5),
        ("-0.047", None, 0.0005),
        ("4.96e8", None, 5e5),
        ("1.571e-6", None, 5e-10),
        ("26.280", None, 0.0005),
        ("3000", 2, 50.0),
        ("-110", 2, 5.0),
        ("46.0", 2, 0.5),
        ("2.37", 2, 0.005),
        ("-0.860", 2, 0.005),
        ("18", 2, 0.5),
        ("0", 2, 0.5),
    ],
)
def test_half_unit(text, digits, expected):
    assert published.half_unit(text, digits) == expected


@pytest.mark.parametrize("text", ["—", "", "nan", "n"])
def test_half_unit_of_no_number(text):
    with pytest.raises(ValueError, match="printed = "):
        published.half_unit(text)


# Shapes and units of the readers


def test_shapes_and_labels():
    assert published.table5().sizes == {"experiment": 16, "quantity": 4}
    assert published.table6().sizes == {"experiment": 16}
    assert published.table7().sizes == {"model": 10}
    assert published.table8().sizes == {"experiment": 16, "model": 6}
    assert published.table9().sizes == {"level": 3, "model": 10}
    for table in (published.table5(), published.table6(), published.table8()):
        assert table["experiment"].values.tolist() == EXPERIMENTS
    for table in (published.table7(), published.table9()):
        assert table["model"].values.tolist() == MODELS
    assert published.table5()["quantity"].values.tolist() == ["P_A", "P_B", "T_A", "T_B"]


def test_values_are_in_SI():
    cell = published.table9().sel(level="typical", model="M9")
    assert cell["mean_error"].item() == pytest.approx(-4.7, rel=4 * EPS)
    assert cell["mean_error_half_unit"].item() == pytest.approx(0.05, rel=4 * EPS)
    assert cell["mean_error_printed"].item() == "-0.047"
    assert cell["std"].item() == pytest.approx(2400, rel=4 * EPS)
    assert cell["mse"].item() == pytest.approx(5.6e6, rel=4 * EPS)
    assert published.table7()["mse"].sel(model="M4").item() == pytest.approx(2.84e9, rel=4 * EPS)
    assert published.table8().sel(experiment="E07", model="M7").item() == 1.35


# Tables 5 and 6: times


def test_unreadable_cells_of_table_5():
    times = published.table5()
    unreadable = times.isnull().stack(cell=["experiment", "quantity"])
    assert set(unreadable["cell"].values[unreadable]) == {("E04", "P_B"), ("E04", "T_A"), ("E08", "T_A")}
    assert (times["half_unit"].isnull() == times.isnull()).all()
    assert times["printed"].sel(experiment="E08", quantity="T_A").item() == "11.338"  # kept as scanned
    assert (times["half_unit"].values[times.notnull()] == 0.0005).all()


def test_open_loop_settling_time_falls_as_conductance_grows():
    # With the valve shut the walls set the pace: temperatures settle in a time near proportional to 1/k_0.
    times = published.table5()
    for cylinder in ("D", "E"):
        open_loop = times[(times.cylinder == cylinder) & (times.type == "open")].sortby("k_0")
        assert (open_loop.diff("experiment") < 0).all()
        pace = (open_loop * open_loop.k_0).sel(quantity=["T_A", "T_B"])
        assert pace.max() < 1.3 * pace.min()


# Tables 7 and 9


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


def test_levels():
    levels = published.table9()
    assert levels["level"].values.tolist() == ["adiabatic", "typical", "isothermal"]
    k_0 = [0.02, 0.1, 0.5, 2.5]
    assert levels["k_0_low"].values.tolist() == k_0[:3]
    assert levels["k_0_high"].values.tolist() == k_0[1:]
    for low, high in zip(levels["k_0_low"], levels["k_0_high"], strict=True):
        assert published.table6()["k_0"].isin([low, high]).sum() == 8


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


def test_one_n_for_a_level_is_never_better_than_the_best_n_of_each_experiment():
    overall = published.table7()
    halves, half_unit = adiabatic_and_isothermal("mse")
    assert (halves + half_unit >= overall["mse"] - overall["mse_half_unit"]).all()


@pytest.mark.parametrize("model", WITHOUT_N)
def test_typical_level_lies_within_the_other_two_where_there_is_no_n(model):
    # It takes half of each, and squared errors are not negative.
    mse, half_unit = (published.table9()[name].sel(model=model) for name in ("mse", "mse_half_unit"))
    assert mse.sel(level="typical") <= (mse + half_unit).sel(level=["adiabatic", "isothermal"]).sum()


# Table 8


def test_best_n_is_on_the_grid():
    grid = [float(f"{1 + 0.05 * i:.2f}") for i in range(9)]  # the nine decimal literals 1.0, 1.05 ... 1.4
    best = published.table8()
    assert best.isin(grid).all()
    assert best["model"].values.tolist() == MODELS[4:]
