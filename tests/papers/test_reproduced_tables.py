"""The full study against the paper, with bounds that were set before it ran; tables from the files alone.

The bounds are those of the reproduction's specification. Those of Tables 7 to 9 hold for the setup that was
identified from these tables (decisions 34, 35 and 62).
"""

import runpy

import numpy as np
import pytest
import xarray as xr
from checkout import ROOT
from paper_study import STUDY

from paper.study import settling_run
from paper.study.paper_2006.printed_tables import table5, table7, table8, table9
from paper.study.settling_run import QUANTITIES, settle
from pneumo.storage.files import open_grid

RECOMPUTE = runpy.run_path(str(ROOT / "docs/recompute_tables.py"))  # imports xarray and NumPy alone


@pytest.fixture(scope="module")
def published(results) -> xr.Dataset:
    return xr.load_dataset(results / "published/statistics.nc")


@pytest.mark.results
@pytest.mark.parametrize("transport", ["published", "exact"])
def test_every_cell_of_the_grid_is_there_and_none_failed(results, transport):
    grid = open_grid(results / transport)
    assert grid.sizes == {"experiment": 16, "model": 10, "n": 9, "chamber": 2}
    assert int(grid["status"].sum()) == 0
    assert bool(np.isfinite(grid["mse"]).all())
    # Rounding of one subtraction of numbers of the size of the MSE.
    np.testing.assert_allclose(grid["mean_error"] ** 2 + grid["variance"], grid["mse"], rtol=1e-14)


@pytest.mark.results
@pytest.mark.parametrize(("table", "level", "cells"), [(table7(), "overall", 10), (table9(), None, 30)])
def test_mean_square_errors_of_tables_7_and_9_and_signs_of_mean_errors_above_1_kPa(
    published, table, level, cells
):
    ours = published.sel(level=level) if level else published
    ratio = ours["mse"] / table["mse"]
    assert ratio.size == cells
    assert float(np.abs(ratio - 1).max()) <= 0.10
    assert float(np.sqrt(np.mean(np.log(ratio) ** 2))) <= 0.035
    large = np.abs(table["mean_error"]) > 1000
    same = np.sign(ours["mean_error"]) == np.sign(table["mean_error"])
    assert large.sum() >= 3 and bool(same.where(large, True).all())


@pytest.mark.results
def test_best_n_of_table_8_and_settling_times_of_table_5(results, published):
    steps = (np.abs(published["best_n"].sel(model=table8()["model"]) - table8()) / 0.05).round().astype(int)
    assert steps.size == 96 and int((steps == 0).sum()) >= 80 and int(steps.max()) <= 1
    settling = xr.load_dataset(results / "settling.nc")
    off = np.abs(settling["settling_time"] / table5() - 1)
    off = off.where((off["experiment"] != "E04") | (off["quantity"] != "P_B"))  # a misprint
    assert int((off <= 0.005).sum()) >= 52 and int((off <= 0.025).sum()) >= 60
    temperatures = off.sel(experiment=off["cylinder"] == "D", quantity=["T_A", "T_B"])
    assert float(temperatures.max()) <= 0.002
    assert float(settling["duration_per_settling_time"].min()) >= 10


@pytest.mark.results
def test_exact_signals_lift_the_floor_under_the_ranking(results):
    mse = xr.load_dataset(results / "exact/statistics.nc")["mse"]
    gain = mse.sel(model="M8", drop=True) / mse.sel(model="M7", drop=True)
    assert 0.15 <= float(gain.sel(level="adiabatic")) <= 0.22
    assert 0.45 <= float(gain.sel(level="typical")) <= 0.60


@pytest.mark.results
def test_tables_follow_from_the_files(results, published):
    recomputed = RECOMPUTE["recomputed"](results)
    table_5 = xr.load_dataset(results / "settling.nc")["settling_time"]
    assert recomputed["Table 5"].shape == (16, 4)
    np.testing.assert_allclose(recomputed["Table 5"], table_5, rtol=1e-12)
    np.testing.assert_array_equal(recomputed["Table 8"], published["best_n"])
    for level in published["level"].values:
        rows = recomputed["Table 7" if level == "overall" else f"Table 9, {level}"]
        for column, name in {"mu": "mean_error", "sigma": "std", "mse": "mse"}.items():
            np.testing.assert_allclose(rows[column], published[name].sel(level=level), rtol=1e-9)


@pytest.mark.results
@pytest.mark.parametrize(("name", "numbers"), [("Table 7", 30), ("Table 8", 96), ("Table 9, typical", 30)])
def test_recomputed_tables_have_the_printed_numbers_beside_them(results, name, numbers):
    both = RECOMPUTE["beside"](
        RECOMPUTE["recomputed"](results)[name], RECOMPUTE["printed"](name, ROOT / "paper/2006/published")
    )
    here, printed = (both.xs(source, axis=1, level=1) for source in ("here", "printed"))
    assert printed.notna().to_numpy().sum() == numbers
    assert here.shape == printed.shape


@pytest.mark.parametrize("longest", [100, 1000])
def test_settling_times_follow_from_a_thinned_trace(monkeypatch, longest):
    monkeypatch.setattr(settling_run, "LONGEST_TRACE", longest)
    run = settle(STUDY.experiments["E14"])
    stored = settling_run.settling_dataset(STUDY.experiments["E14"], run)
    assert stored.sizes["t"] < longest + 13 and len(run.states) > 2000
    times = [RECOMPUTE["settling_time"](stored, quantity) for quantity in QUANTITIES]
    np.testing.assert_allclose(times, run.times, rtol=1e-12)
