"""Tables of cylinders in Parquet files: the same study as from CSV, the same messages, a bounded size."""

import sys
from decimal import Decimal
from pathlib import Path

import pandas as pd
import pytest

from pneumo.configuration.parameters import load, study
from pneumo.errors import ConfigurationError
from pneumo.selection.cylinder_template import write_table_template


@pytest.fixture
def written(tmp_path, monkeypatch):
    """Write the template table as Parquet, with changed columns, and a configuration."""
    pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    monkeypatch.chdir(tmp_path)
    write_table_template(Path("fleet.yaml"))

    def write(file="fleet.parquet", rows=slice(None), **columns):
        table = pd.read_csv("fleet.csv").iloc[rows].assign(**columns)
        table.to_parquet(file, index=False)
        name_it(file)

    return write


def name_it(file="fleet.parquet"):
    text = Path("fleet.yaml").read_text(encoding="utf-8")
    Path("parquet.yaml").write_text(text.replace("fleet.csv", file), encoding="utf-8")


def refusal():
    with pytest.raises(ConfigurationError) as error:
        load("parquet.yaml")
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize(
    "columns",
    [
        {},
        {
            "bore_mm": lambda t: t.bore_mm.astype("float32"),
            "mass_kg": lambda t: [Decimal(str(mass)) for mass in t.mass_kg],
            "seed": lambda t: t.seed.astype("uint8"),
        },
        {"seed": lambda t: t.seed.astype(float)},  # as pandas writes whole numbers where one is missing
        {"sample_time_s": lambda t: t.sample_time_s.astype("float32")},  # 0.05 is no number in four bytes
        {"bore_mm": lambda t: t.bore_mm.astype(str)},
        {"name": lambda t: t.name.astype("category")},
        {"dead_volume_m3": float("nan"), "duration_s": pd.Series([None, None], dtype="str")},
    ],
)
def test_the_same_fleet_is_the_same_study(written, columns):
    written(**columns)
    assert study(load("parquet.yaml")) == study(load("fleet.yaml"))


def test_a_file_that_cannot_be_read(written):
    written()
    whole = Path("fleet.parquet").read_bytes()
    for content in (b"", b"name\nfirst\n", whole[:-9], whole[:4] + bytes(80) + whole[84:]):
        Path("fleet.parquet").write_bytes(content)
        assert "parquet.yaml: cylinders = 'fleet.parquet': cannot be read: " in refusal()
    Path("fleet.parquet").unlink()
    assert "cylinders = 'fleet.parquet': cannot be read: [Errno 2] No such file" in refusal()
    Path("fleet.parquet").mkdir()  # with tables in it, which pandas would read
    written("fleet.parquet/one.parquet")
    name_it()
    assert "cannot be read: [Errno 21] Is a directory" in refusal()


def test_without_pyarrow_one_line_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    write_table_template(Path("fleet.yaml"))
    name_it("fleet.parquet")
    Path("fleet.parquet").touch()
    problem = "a Parquet file needs pyarrow; pip install pyarrow"
    assert refusal() == f"parquet.yaml: cylinders = 'fleet.parquet': {problem}"
