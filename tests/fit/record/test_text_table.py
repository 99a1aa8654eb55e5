"""Tables of text files, cell by cell."""

from pathlib import Path

import numpy as np
import pytest

from pneumo.errors import InputError
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
