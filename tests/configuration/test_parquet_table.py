"""Tables of cylinders in Parquet files: the same study as from CSV, the same messages, a bounded size."""

import sys
from pathlib import Path

import pytest

from pneumo.configuration import cylinder_table
from pneumo.configuration.parameters import load, study
from pneumo.errors import ConfigurationError
from pneumo.selection.cylinder_template import write_table_template


@pytest.fixture
def written(tmp_path, monkeypatch):
    """Write the table to begin with as Parquet, with the columns and rows that SQL chooses."""
    duckdb = pytest.importorskip("duckdb", reason="DuckDB is not installed")
    monkeypatch.chdir(tmp_path)
    write_table_template(Path("fleet.yaml"))

    def write(columns="*", rows="", name="fleet.parquet"):
        duckdb.sql(f"COPY (SELECT {columns} FROM 'fleet.csv' {rows}) TO 'new' (FORMAT parquet)")
        Path("new").replace(name)
        text = Path("fleet.yaml").read_text(encoding="utf-8")
        Path("parquet.yaml").write_text(text.replace("fleet.csv", name), encoding="utf-8")

    return write


def refusal():
    with pytest.raises(ConfigurationError) as error:
        load("parquet.yaml")
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize(
    "columns",
    [
        "*",
        "* REPLACE (bore_mm::FLOAT AS bore_mm, mass_kg::DECIMAL(9, 3) AS mass_kg, seed::UTINYINT AS seed)",
        "* REPLACE (seed::DOUBLE AS seed)",  # as pandas writes whole numbers where one is missing
        "* REPLACE (sample_time_s::FLOAT AS sample_time_s)",  # 0.05 is no number in four bytes
        "* REPLACE (bore_mm::VARCHAR AS bore_mm)",
        "*, NULL::DOUBLE AS dead_volume_m3, NULL::VARCHAR AS duration_s",
    ],
)
def test_the_same_fleet_is_the_same_study(written, columns):
    written(columns)
    assert study(load("parquet.yaml")) == study(load("fleet.yaml"))


def test_a_null_leaves_a_key_out_as_an_empty_cell_does(written):
    written("*, CASE name WHEN 'first' THEN 'catalogue' WHEN 'second' THEN '0.5' END AS k_0_W_per_K")
    found = study(load("parquet.yaml")).experiments
    assert found["first-open"].plant.k_0 != found["second-open"].plant.k_0 == 0.5
    written("* REPLACE (CASE name WHEN 'second' THEN rod_mm END AS rod_mm)")
    found = study(load("parquet.yaml")).experiments
    without, rodded = found["first-open"].plant.cylinder, found["second-open"].plant.cylinder
    assert without.A_A == without.A_B == rodded.A_A > rodded.A_B


@pytest.mark.parametrize("name", ["fleet[1]*.parquet", "FLEET.PARQUET", "k=1/fleet.parquet"])
def test_a_path_is_a_path_and_no_pattern(written, name):
    Path("k=1").mkdir()
    written(name=name)
    assert list(load("parquet.yaml").cylinders) == ["first", "second"]


SECOND = "CASE name WHEN 'second' THEN"


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        (f"* REPLACE ({SECOND} -1.0 ELSE 40.0 END AS bore_mm)", "row 3, column bore_mm = -1.0: must be"),
        (f"* REPLACE ({SECOND} NULL ELSE 40.0 END AS bore_mm)", "row 3, column bore_mm: missing; must be"),
        ("* REPLACE ('nan'::DOUBLE AS bore_mm)", "row 2, column bore_mm = nan: must be a number"),
        ("* REPLACE ('wide' AS bore_mm)", "row 2, column bore_mm = 'wide': must be a number"),
        ("* REPLACE (true AS bore_mm)", "row 2, column bore_mm = 'true': must be a number"),
        ("* REPLACE (DATE '2026-01-01' AS bore_mm)", "column bore_mm = '2026-01-01': must be a number"),
        ("* REPLACE ([25.0] AS bore_mm)", "column bore_mm = '[25.0]': must be a number"),
        ("* REPLACE (seed + 0.5 AS seed)", "row 2, column seed = 1.5: must be"),
        (
            "* REPLACE (stroke_mm AS name)",
            "row 2, column name = '160': the name must be text of at most 40 letters",
        ),
        ("* REPLACE ('a' AS name)", "row 3, column name = 'a': is row 2 already"),
        (f"* REPLACE ({SECOND} name END AS name)", "row 2, column name = ''"),
        ("* EXCLUDE (name)", "row 1: no column name"),
        ("*, 4 AS bore_cm", "row 1, column 'bore_cm': unknown; columns are keys of config/README.md"),
        ("*, {'b': 0.3} AS valve", "row 1, column 'valve': unknown"),
    ],
)
def test_a_mistake_is_one_line_with_row_and_column(written, columns, words):
    written(columns)
    assert refusal().startswith("fleet.parquet: ")
    assert words in refusal()


def test_a_table_without_rows(written):
    written(rows="WHERE name = 'third'")
    assert refusal() == "fleet.parquet: has no rows below the names of its columns"


def test_a_file_that_cannot_be_read(written):
    written()
    whole = Path("fleet.parquet").read_bytes()
    for content in (b"", b"name\nfirst\n", whole[:-9], whole[:40] + bytes(40) + whole[80:]):
        Path("fleet.parquet").write_bytes(content)
        assert "parquet.yaml: cylinders = 'fleet.parquet': cannot be read: " in refusal()
    Path("fleet.parquet").unlink()
    assert "cylinders = 'fleet.parquet': cannot be read: [Errno 2] No such file" in refusal()
    Path("fleet.parquet").mkdir()  # with tables in it, which DuckDB would read
    written(name="fleet.parquet/one.parquet")
    Path("parquet.yaml").write_text(Path("fleet.yaml").read_text().replace("fleet.csv", "fleet.parquet"))
    assert "cannot be read: [Errno 21] Is a directory" in refusal()


def test_a_table_that_is_larger_than_its_file_is_refused_while_it_is_read(written, monkeypatch):
    written("* EXCLUDE (range)", "CROSS JOIN range(100000) WHERE name = 'first'")
    assert Path("fleet.parquet").stat().st_size < 50_000  # each value once, and how often
    monkeypatch.setattr(cylinder_table, "_add_row", lambda *_: None)
    monkeypatch.setattr(cylinder_table, "LARGEST_TABLE", 1_000_000)
    assert refusal() == "parquet.yaml: cylinders = 'fleet.parquet': must have at most 1000000 bytes as text"


def test_without_duckdb_one_line_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "duckdb", None)
    write_table_template(Path("fleet.yaml"))
    text = Path("fleet.yaml").read_text(encoding="utf-8")
    Path("parquet.yaml").write_text(text.replace("fleet.csv", "fleet.parquet"), encoding="utf-8")
    what = "a Parquet file is read with DuckDB, which is not installed; pip install duckdb"
    assert refusal() == f"parquet.yaml: cylinders = 'fleet.parquet': {what}"
