"""Records in data/: licence, source, size, and numbers as they were measured."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

DATA = Path(__file__).parents[1] / "data"
FILES = sorted(DATA.rglob("*.nc"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: f"{file.parent.name}/{file.stem}")
def test_a_record_names_its_source_and_licence(file):
    with xr.open_dataset(file, decode_times=False) as data:
        kind = data.attrs["license"].split(";")[0]
        assert "github.com" in data.attrs["source"] and "commit" in data.attrs["source"]
        assert np.isfinite(data.to_array()).all()
    licence = (file.parent / "LICENSE").read_text(encoding="utf-8")
    assert kind.removesuffix("-2.0") in licence
    row = next(r for r in (DATA / "README.md").read_text().splitlines() if f"`{file.parent.name}/`" in r)
    assert kind in row and (file.parent / "convert.py").exists()
