"""The full study against the paper, with the bounds that were set before it ran.

The bounds are those of the reproduction's specification. Those of Tables 7 to 9 hold for the setup that was
identified from these tables (decisions 34, 35 and 62).
"""

import numpy as np
import pytest
import xarray as xr

from paper.study.paper_2006.printed_tables import table5, table7, table8, table9
from pneumo.storage.files import open_grid

pytestmark = pytest.mark.results


@pytest.fixture(scope="module")
def published(results) -> xr.Dataset:
    return xr.load_dataset(results / "published/statistics.nc")


@pytest.fixture(scope="module")
def exact(results) -> xr.Dataset:
    return xr.load_dataset(results / "exact/statistics.nc")


@pytest.mark.parametrize("transport", ["published", "exact"])
def test_every_cell_of_the_grid_is_there_and_none_failed(results, transport):
    grid = open_grid(results / transport)
    assert grid.sizes == {"experiment": 16, "model": 10, "n": 9, "chamber": 2}
    assert int(grid["status"].sum()) == 0
    assert bool(np.isfinite(grid["mse"]).all())
    # Rounding of one subtraction of numbers of the size of the MSE.
    np.testing.assert_allclose(grid["mean_error"] ** 2 + grid["variance"], grid["mse"], rtol=1e-14)


@pytest.mark.parametrize(("table", "level", "cells"), [(table7(), "overall", 10), (table9(), None, 30)])
def test_mean_square_errors_of_tables_7_and_9(published, table, level, cells):
    mse = published["mse"]
    ratio = (mse.sel(level=level) if level else mse) / table["mse"]
    assert ratio.size == cells
    assert float(np.abs(ratio - 1).max()) <= 0.10
    assert float(np.sqrt(np.mean(np.log(ratio) ** 2))) <= 0.035


def test_signs_of_mean_errors_above_1_kPa_and_table_8_best_n(published):
    levels = {"overall": table7()} | {name: table9().sel(level=name) for name in table9()["level"].values}
    for level, printed in levels.items():
        mu = printed["mean_error"]
        large = np.abs(mu) > 1000
        assert large.sum() >= 3
        signs = np.sign(published["mean_error"].sel(level=level))
        assert bool((signs == np.sign(mu)).where(large, True).all())
    printed = table8()
    steps = np.abs(published["best_n"].sel(model=printed["model"]) - printed) / 0.05
    steps = steps.round().astype(int)
    assert steps.size == 96
    assert int((steps == 0).sum()) >= 80
    assert int(steps.max()) <= 1


def test_table_5_settling_times_and_durations_of_at_least_ten(results):
    ours = xr.load_dataset(results / "settling.nc")["settling_time"]
    ratio = ours / table5()
    off = np.abs(ratio - 1)
    off = off.where((off["experiment"] != "E04") | (off["quantity"] != "P_B"))  # a misprint
    assert int((off <= 0.005).sum()) >= 52
    assert int((off <= 0.025).sum()) >= 60
    temperatures = off.sel(experiment=off["cylinder"] == "D", quantity=["T_A", "T_B"])
    assert float(temperatures.max()) <= 0.002
    ratio = xr.load_dataset(results / "settling.nc")["duration_per_settling_time"]
    assert float(ratio.min()) >= 10


def test_exact_signals_lift_the_floor_under_the_ranking(exact):
    mse = exact["mse"]
    gain = mse.sel(model="M8", drop=True) / mse.sel(model="M7", drop=True)
    assert 0.15 <= float(gain.sel(level="adiabatic")) <= 0.22
    assert 0.45 <= float(gain.sel(level="typical")) <= 0.60


def test_eq_16_uses_the_sample_variance(results, published):
    cells = open_grid(results / "published").mean("chamber")
    n = published["best_n"]
    mu = cells["mean_error"].sel(n=n)
    overall = published.sel(level="overall")
    left = overall["mean_error"] ** 2 + overall["std"] ** 2
    right = overall["mse"] + mu.var("experiment", ddof=1) / 16
    np.testing.assert_allclose(left, right, rtol=1e-12)
