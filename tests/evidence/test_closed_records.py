"""Kept records of closed chambers."""

from pathlib import Path

import xarray as xr

from paper.study.closed_records import is_still, read_closed_record

DATA = Path(__file__).parents[2] / "data" / "mbari"


def test_records_travel_with_units_licence_and_provenance():
    files = sorted(DATA.glob("*.nc"))
    assert len(files) == 4
    assert sum(file.stat().st_size for file in files) <= 3_000_000
    assert "Apache License" in (DATA / "LICENSE").read_text()
    for file in files:
        with xr.open_dataset(file, decode_times=False) as data:
            assert [data[name].attrs["units"] for name in ("t", "x", "P_A", "P_B")] == ["s", "m", "Pa", "Pa"]
            assert "Apache-2.0" in data.attrs["license"] and "osrf/mbari_wec_gz" in data.attrs["source"]
    still = [is_still(read_closed_record(file)) for file in files]
    assert still == ["vented" in file.stem for file in files]
