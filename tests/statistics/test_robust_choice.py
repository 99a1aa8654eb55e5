"""Worst cases of a cylinder that is not known exactly, against errors written down."""

import numpy as np
import pytest
import xarray as xr
from invented_cells import cells_of

from pneumo.physics.models import MODELS
from pneumo.statistics.robust_choice import FULL_ORDER, robust_choice

N = [1.0, 1.2]
LABELS = {"experiment": ["E"], "run": [0], "model": list(MODELS), "n": N, "chamber": ["A", "B"]}
LARGER = 10.0  # rms of every other model, Pa


def invented(rms, off_plant=()):
    """Cells with errors of M8 by case and n, Pa, over two chambers whose mean squares differ."""

    def squares(values):
        mean = np.full((1, 1, len(MODELS), len(N)), LARGER**2)
        mean[..., LABELS["model"].index("M8"), :] = np.square(values)
        return np.stack([0.5 * mean, 1.5 * mean], -1)

    low, assumed, high = rms
    cells = cells_of(squares(assumed), LABELS)
    ends = (*LABELS, "k_0_end")
    wrong = np.stack([squares(low), squares(high)], -1)
    cells = cells.assign(mse_of_wrong_k_0=(ends, wrong), mse_of_right_k_0=(ends, wrong))
    cells = cells.assign_coords(k_0_end=["low", "high"]).assign(k_0_factor=2.0, k_0=0.6)
    full = np.broadcast_to([[0.5, 2.0], [1.5, 6.0]], (1, 1, 2, 2))  # by chamber and end: means 1 and 4
    cells["mse_of_full_order"] = ("experiment", "run", "chamber", "k_0_end"), full
    if off_plant:
        off = np.stack([squares(each) for each in off_plant], -1)
        cells = cells.assign_coords(off_plant=["valve low", "valve high"])
        cells["mse_of_off_plant"] = (*LABELS, "off_plant"), off
        full = np.broadcast_to(np.array([4.0, 9.0]), (1, 1, 2, 2))
        cells["mse_of_full_order_off_plant"] = ("experiment", "run", "chamber", "off_plant"), full
        cells = cells.assign(valve_within=0.03)
    return cells


def test_n_is_that_of_the_lowest_worst_case_over_k_0():
    found = robust_choice(invented([(1.0, 3.0), (2.0, 2.5), (8.0, 4.0)]))
    row = found.model("M8")
    assert row.n == 1.2 and row.rms == pytest.approx((3.0, 2.5, 4.0)) and row.off_plant == ()
    assert row.worst == pytest.approx(4.0) and found.models[0] is row and found.known == pytest.approx(4.0)
    assert (found.factor, found.k_0, found.valve, found.dead_volumes) == (2.0, 0.6, 0.0, 0.0)
    assert found.full_order.rms == pytest.approx((1.0, 0.0, 2.0)) and found.rows[0].model == FULL_ORDER


def test_a_valve_that_is_off_counts_as_a_case_of_its_own():
    found = robust_choice(invented([(1.0, 3.0), (2.0, 2.5), (5.0, 4.0)], [(1.0, 9.0), (6.0, 2.0)]))
    row = found.model("M8")
    assert row.n == 1.0 and row.off_plant == pytest.approx((1.0, 6.0)) and row.worst == pytest.approx(6.0)
    assert found.valve == 0.03 and found.full_order.off_plant == pytest.approx((2.0, 3.0))


def test_a_case_that_failed_is_the_worst():
    cells = invented([(1.0, 1.0), (1.0, 1.0), (1.0, 1.0)])
    cells["mse_of_wrong_k_0"].loc[{"model": "M8", "n": 1.0, "chamber": "B", "k_0_end": "low"}] = np.nan
    assert robust_choice(cells).model("M8").n == 1.2
    cells["mse_of_wrong_k_0"] = xr.where(cells["model"] == "M8", np.nan, cells["mse_of_wrong_k_0"])
    assert robust_choice(cells).model("M8").worst == np.inf
