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
    monkeypatch.chdir(tmp_path)
    write_table_template(Path("fleet.yaml"))
    text = Path("fleet.yaml").read_text(encoding="utf-8")
    Path("parquet.yaml").write_text(text.replace("fleet.csv", "fleet.parquet"), encoding="utf-8")

    def write(**columns):
        pytest.importorskip("pyarrow", reason="pyarrow is not installed")
        pd.read_csv("fleet.csv").assign(**columns).to_parquet("fleet.parquet", index=False)

    return write


def refusal():
    with pytest.raises(ConfigurationError) as error:
        load("parquet.yaml")
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize(
    "columns",
    [
        {
            "bore_mm": lambda t: t.bore_mm.astype("float32"),
            "mass_kg": lambda t: [Decimal(str(mass)) for mass in t.mass_kg],
            "seed": lambda t: t.seed.astype(float),  # as pandas writes whole numbers where one is missing
            "sample_time_s": lambda t: t.sample_time_s.astype("float32"),  # 0.05 is no number in four bytes
        },
        {"bore_mm": lambda t: t.bore_mm.astype(str), "name": lambda t: t.name.astype("category")},
        {"dead_volume_m3": float("nan"), "duration_s": pd.Series([None, None], dtype="str")},
    ],
)
def test_the_same_fleet_is_the_same_study(written, columns):
    written(**columns)
    assert study(load("parquet.yaml")) == study(load("fleet.yaml"))


def test_a_file_that_cannot_be_read(written, monkeypatch):
    assert "cylinders = 'fleet.parquet': cannot be read: [Errno 2] No such file" in refusal()
    written()
    whole = Path("fleet.parquet").read_bytes()
    for content in (b"", b"name\nfirst\n", whole[:-9], whole[:4] + bytes(80) + whole[84:]):
        Path("fleet.parquet").write_bytes(content)
        assert "parquet.yaml: cylinders = 'fleet.parquet': cannot be read: " in refusal()
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert refusal().endswith("a Parquet file needs pyarrow; pip install pyarrow")
