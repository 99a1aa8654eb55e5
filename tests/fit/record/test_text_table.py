"""Tables of text files, cell by cell."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from pneumo.errors import InputError
from pneumo.fit.record.table import limit
from pneumo.fit.record.text_table import text_table

LVM = (
    "LabVIEW Measurement\t\nX_Columns\tOne\nMulti_Headings\tNo\nY_Unit_Label\tV\tmm\nX0\t0.5\t0.5\n"
    "Delta_X\t0.002\t0.002\n***End_of_Header***\t\t\nX_Value\tu\tx\n"
)


def test_columns_without_a_name_are_counted_from_one():
    table = text_table(Path("a.csv"), b"t_s,,u_V,u_V\n0,1,2,3\n1,4,5,6\n", set())
    assert list(table.columns) == ["t_s", "column 2", "u_V", "u_V.4"]


def test_labview_s_time_begins_at_X0_and_goes_on_by_Delta_X():
    table = text_table(Path("a.lvm"), (LVM + "\t1\t10\n\t2\t20\n\t3\t30\n").encode(), set())
    np.testing.assert_allclose(table.columns["X_Value"].astype(float), [0.5, 0.502, 0.504], rtol=1e-15)
    assert table.units == {"X_Value": "s", "u": "V", "x": "mm"}


def test_labview_s_own_times_are_kept_and_samples_have_the_files_lines():
    rows = "0.5\t1\t10\n0.6\t2\t20\n0.9\t3\t30\n"
    table = text_table(Path("a.lvm"), (LVM + rows).encode(), set())
    assert table.columns["X_Value"].tolist() == ["0.5", "0.6", "0.9"]
    assert table.first_line == len(LVM.splitlines()) + 1
    assert text_table(Path("a.csv"), b"t_s,u_V\n0,1\n1,4\n", set()).first_line == 2


def test_a_single_row_above_the_numbers_has_names_even_if_they_are_units():
    table = text_table(Path("a.csv"), b"s,V,mm\n0,1,2\n1,4,5\n", {"s", "V", "mm"})
    assert list(table.columns) == ["s", "V", "mm"] and table.units == {}


def test_the_first_sample_is_looked_for_within_200_lines():
    def content(lines):
        return ("# a bench\n" * (lines - 2) + "t_s,u_V\n0,1\n1,4\n").encode()

    assert text_table(Path("a.csv"), content(200), set()).first_line == 200
    with pytest.raises(InputError, match="no numbers in columns within the first 200 lines"):
        text_table(Path("a.csv"), content(201), set())


def of(text, known=("s", "V", "mm", "bar"), name="a.csv"):
    return text_table(Path(name), text.encode(), set(known))


@pytest.mark.parametrize(
    ("below", "has_units"),
    [
        ("s,V,ok,ok", True),  # half of them are units
        ("s,V,,ok", True),
        ("s,,ok,ok", False),  # a third
        ("s,ok,ok,ok", False),
    ],
)
def test_a_row_has_units_if_half_of_its_fields_are(below, has_units):
    table = of(f"bench,of,12,May\nt,u,x,y\n{below}\n0,1,2,3\n1,4,5,6\n")
    if has_units:
        assert list(table.columns) == ["t", "u", "x", "y"] and table.units["u"] == "V"
    else:
        assert table.columns.columns[0] == "s" and table.units == {}


@pytest.mark.parametrize(
    ("above", "numbers", "names"),
    [
        ("Zeit [s];U, soll [V]\n", "0;1", ["Zeit [s]", "U, soll [V]"]),  # the numbers' separator comes first
        ("Time [s]\tu [V]\n", "0 1", ["Time [s]", "u [V]"]),  # tabs above columns aligned by spaces
        ("t_s,u_V\nsecond run\n", "0,1", ["t_s", "u_V"]),  # words are no columns
        ("t_s, u_V\n", "0 1", ["t_s", "u_V"]),  # commas and spaces between names, spaces between numbers
    ],
)
def test_names_are_read_with_their_own_separator(above, numbers, names):
    table = of(f"{above}{numbers}\n{numbers}\n")
    assert list(table.columns) == names
    assert table.columns.iloc[0].tolist() == ["0", "1"]


@pytest.mark.parametrize(
    ("first", "numbers"),
    [
        ('"0,001","1,3"', ["0.001", "1.3"]),
        ('0,"1,3"', ["0", "1.3"]),
        ('"0,001",1', ["0.001", "1"]),
        ("0,1", ["0", "1"]),
    ],
)
def test_numbers_with_decimal_commas_may_be_in_quotes_between_commas(first, numbers):
    table = of(f't_s,u_V\n{first}\n"0,002","-1,5e-3"\n')
    assert table.columns.iloc[0].tolist() == numbers
    assert table.columns.iloc[1].tolist() == ["0.002", "-1.5e-3"]


def test_commas_in_quotes_beside_a_decimal_point_part_thousands():
    table = of('t_s,u_V,P_A_Pa\n0.001,1.3,"101,325"\n')
    assert table.columns.iloc[0].tolist() == ["0.001", "1.3", "101,325"]  # refused later: no number


def test_decimal_commas_between_commas_are_asked_about():
    with pytest.raises(InputError) as error:
        of("t_s,u_V,x_mm\n0,001,1,3,10,5\n0,002,1,4,10,6\n")
    remedy = "one has 3: decimal commas and commas between columns? export with semicolons"
    assert str(error.value) == f"a.csv: no row of 6 names above the numbers: {remedy}"
    with pytest.raises(InputError, match="such as P_A_kPa"):
        of("t_s,u_V,x_mm\n0,1,2,3,4\n1,2,3,4,5\n")
    with pytest.raises(InputError, match="such as P_A_kPa"):  # between tabs they are not asked about
        of("t_s\tu_V\n0\t1\t2\t3\n1\t2\t3\t4\n")


def test_a_row_of_two_more_fields_than_numbers_has_no_names():
    with pytest.raises(InputError, match="no row of 2 names"):
        of("a,b,c,d\n0,1\n1,4\n")


def test_the_table_begins_where_half_of_the_fields_are_numbers():
    table = of("a,b,c,d,e,f\n0,1,2,on,ok,up\n1,2,3,on,ok,up\n")
    assert table.columns["f"].tolist() == ["up", "up"] and table.first_line == 2


def test_blank_lines_are_left_out_at_the_end_alone_and_no_word_is_taken_for_an_empty_field():
    table = of("t_s,u_V\n0,1\n\n2,#N/A\n3,4\n\n\n\n")
    # An error in the row after a blank line names the line that an editor shows.
    assert table.columns["t_s"].tolist() == ["0", "", "2", "3"]
    assert table.columns["u_V"].tolist() == ["1", "", "#N/A", "4"]


def test_separators_at_the_ends_of_lines_add_no_column_and_no_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        table = of("t_s,u_V\n0,1,\n1,4,\n")
    assert table.columns.to_numpy().tolist() == [["0", "1"], ["1", "4"]]


def test_labview_s_time_begins_at_zero_where_the_header_has_no_X0_and_may_lack_other_entries():
    short = "".join(line for line in LVM.splitlines(True) if line.split("\t")[0] not in ("X0", "X_Columns"))
    table = of(short + "\t1\t10\n\t2\t20\n")
    np.testing.assert_allclose(table.columns["X_Value"].astype(float), [0.0, 0.002], atol=1e-15)


def test_labview_s_headings_between_the_rows_are_refused():
    with pytest.raises(InputError, match="headings between the rows"):
        of(LVM.replace("Multi_Headings\tNo", "Multi_Headings\tYes") + "\t1\t10\n\t2\t20\n")


def test_a_file_may_have_as_much_as_the_limit():
    limit(Path("a.csv"), 200, 200, "columns")
    with pytest.raises(InputError, match="201 columns: must be at most 200"):
        limit(Path("a.csv"), 201, 200, "columns")
