"""Tables 5, 7, 8 and 9 follow from the stored files by xarray and NumPy alone: docs/recompute_tables.py."""

import runpy

import numpy as np
import pytest
import xarray as xr
from checkout import ROOT
from paper_study import STUDY

from paper.study import settling_run
from paper.study.settling_run import QUANTITIES, settle

RECOMPUTE = runpy.run_path(str(ROOT / "docs/recompute_tables.py"))


@pytest.mark.results
def test_tables_of_the_study(results):
    found = RECOMPUTE["tables"](results)
    table_5 = xr.load_dataset(results / "settling.nc")["settling_time"]
    for name, times in found["table 5"].items():
        np.testing.assert_allclose(times, table_5.sel(experiment=name), rtol=1e-12)
    assert len(found["table 5"]) == 16
    statistics = xr.load_dataset(results / "published/statistics.nc")
    np.testing.assert_array_equal(found["table 8"], statistics["best_n"])
    for level, rows in found["tables 7 and 9"].items():
        for column, name in {"mu": "mean_error", "sigma": "std", "mse": "mse"}.items():
            np.testing.assert_allclose(rows[column], statistics[name].sel(level=level), rtol=1e-9)


@pytest.mark.parametrize("longest", [100, 1000])
def test_settling_times_follow_from_a_thinned_trace(monkeypatch, longest):
    monkeypatch.setattr(settling_run, "LONGEST_TRACE", longest)
    run = settle(STUDY.experiments["E14"])
    stored = settling_run.settling_dataset(STUDY.experiments["E14"], run)
    assert stored.sizes["t"] < longest + 13 and len(run.states) > 2000
    times = [RECOMPUTE["settling_time"](stored, quantity) for quantity in QUANTITIES]
    np.testing.assert_allclose(times, run.times, rtol=1e-12)
