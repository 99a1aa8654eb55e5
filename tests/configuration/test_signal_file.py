"""Columns of CSV files: what is read, and one line for what cannot be."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneumo.configuration.text_file import read_column
from pneumo.errors import ConfigurationError


@pytest.mark.parametrize("text", ["t,u\n0,1.5\n1,-2\n", "t;u\n0;1.5\n\n1;-2", "\ufefft\t u \n0\t1.5\n1\t-2"])
def test_column_with_any_delimiter(tmp_path, text):
    file = tmp_path / "a.csv"
    file.write_text(text, encoding="utf-8")
    assert read_column(file, "u", "here") == (1.5, -2.0)


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1))
def test_numbers_come_back_exactly(tmp_path_factory, values):
    file = tmp_path_factory.mktemp("csv") / "a.csv"
    file.write_text("u\n" + "".join(f"{value!r}\n" for value in values))
    assert read_column(file, "u", "here") == tuple(values)


@pytest.mark.parametrize(
    ("content", "line"),
    [
        (None, "/a.csv'"),  # where it was looked for
        (b"\xff\xfe", "cannot be read"),
        (b"", "has the columns (none)"),
        (b"t,v\n0,1\n", "here.column = 'u': "),
        (b"t,u\n", "has no rows"),
        (b"t,u\n0,1\n1,x\n", "line 3: must be a finite number"),
        (b"t,u\n0,nan\n", "line 2: must be a finite number"),
        (b"t,u\n0\n", "line 2: must be a finite number"),
        (b"t;u\n0;1,5\n", "line 2: must be a finite number"),
        (b"u,u\n0,1\n", "two columns of that name"),
        (b"u\n1e999\n", "line 2: must be a finite number"),
    ],
)
def test_bad_files(tmp_path, content, line):
    file = tmp_path / "a.csv"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(ConfigurationError) as error:
        read_column(file, "u", "here")
    assert line in str(error.value) and str(error.value).isprintable()
