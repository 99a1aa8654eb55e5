"""Copies of evidence, and how far results made anew are from them."""

import json
import os
import sys

import numpy as np
import pytest
import xarray as xr
from checkout import ROOT

from pneumo.storage.files import read_json, write, write_json

sys.path.insert(0, str(ROOT / "workflow"))
import kept

MADE = {"title": "t", "config_sha256": "a" * 64, "code_sha256": "c" * 64}
DAY = 1_700_000_000  # 2023-11-14


@pytest.fixture
def floor(tmp_path, monkeypatch):
    """Results of a floor, of which a copy is kept."""
    monkeypatch.setattr(kept, "RESULTS", tmp_path / "results")
    monkeypatch.setattr(kept, "KEPT", tmp_path / "kept")
    monkeypatch.setitem(kept.COPIES, "floor.nc", kept.Copy(4, ("measured",)))
    values = np.random.default_rng(1).uniform(1, 2, (3, 4))
    dataset = xr.Dataset({"measured": (("a", "b"), values), "unread": ("a", [1, 2, 3])})
    write(dataset, tmp_path / "results/floor.nc", MADE)
    os.utime(tmp_path / "results/floor.nc", (DAY, DAY))
    assert kept.main("keep", ["floor.nc"]) == 0
    return dataset


def test_a_copy_has_what_is_read_to_its_digits_and_says_what_made_it(floor, tmp_path):
    with xr.open_dataset(tmp_path / "kept/floor.nc") as copy:
        assert list(copy.data_vars) == ["measured"] and copy["measured"].encoding["dtype"] == np.float32
        np.testing.assert_allclose(copy["measured"], floor["measured"], rtol=1e-4)
        assert copy.attrs["date_created"] == "2023-11-14"
        assert {name: copy.attrs[name] for name in MADE} == MADE
    assert (tmp_path / "kept/SHA256SUMS").read_text().endswith("  floor.nc\n")


@pytest.mark.parametrize(("factor", "code"), [(1.0, 0), (1 + 1e-5, 0), (1.01, 1), (np.nan, 1)])
def test_what_is_made_anew_is_compared(floor, tmp_path, capsys, factor, code):
    write(floor.assign(measured=floor["measured"] * [1, 1, factor, 1]), tmp_path / "results/floor.nc", MADE)
    assert kept.main("compare", []) == code  # all that is kept
    assert capsys.readouterr().out.endswith(", too much\n") == bool(code)


def test_findings_are_compared_by_value(floor, tmp_path):
    for folder, answer in (("results", "yes"), ("kept", "no")):
        text = json.dumps(MADE | {"claims": [{"stands": answer}]})
        write_json(text, tmp_path / folder / "findings.json")
    assert kept.main("compare", ["findings.json"]) == 1
    kept.keep("findings.json")
    assert kept.main("compare", ["findings.json"]) == 0
    assert json.loads(read_json(tmp_path / "kept/findings.json"))["code_sha256"] == MADE["code_sha256"]


@pytest.mark.parametrize(("off", "code"), [(5e-11, 0), (5e-10, 1)])
def test_where_all_digits_are_kept_another_order_of_sums_is_allowed(floor, tmp_path, monkeypatch, off, code):
    monkeypatch.setitem(kept.COPIES, "floor.nc", kept.Copy(digits=None))
    kept.keep("floor.nc")
    write(floor.assign(measured=floor["measured"] * (1 + off)), tmp_path / "results/floor.nc", MADE)
    assert kept.main("compare", ["floor.nc"]) == code
