"""Settling times beside the lengths of the runs."""

import numpy as np
import pytest
import xarray as xr
from paper_study import STUDY

from paper.study.paper_2006 import printed_tables as published
from paper.study.settling_times import settling_table


def settling_part(name, times):
    coords = {"quantity": ["P_A", "P_B", "T_A", "T_B"], "experiment": name, "cylinder": "D", "loop": "open"}
    values = {"settling_time": ("quantity", times), "failure_time": np.nan}
    return xr.Dataset(values, coords | {"k_0": 0.1}, {"experiment_parameters": name})


def test_settling_table_the_ten_times_rule_and_durations_of_table_6():
    times = {"E01": [1.0, 2.0, 3.0, 2.5], "E02": [8.0, 1.0, 2.0, 3.0]}
    parts = {name: settling_part(name, values) for name, values in times.items()}
    table = settling_table(parts, {"E02": 60.0, "E01": 30.0})  # in any order
    assert table["settling_time"].sel(experiment="E01").values.tolist() == [1.0, 2.0, 3.0, 2.5]
    assert table["duration"].values.tolist() == [30.0, 60.0]
    assert table["duration_per_settling_time"].values.tolist() == [30.0 / 3.0, 60.0 / 8.0]
    assert table["k_0"].dims == table["cylinder"].dims == ("experiment",)
    assert "experiment_parameters" not in table.attrs  # one run's, and not the table's
    assert table["duration"].attrs["units"] == "s"
    assert table["duration_per_settling_time"].attrs["units"] == "1"
    printed = {cell["row"]: float(cell["printed"]) for cell in published.read_table(6)}
    assert printed == pytest.approx({n: e.duration for n, e in STUDY.experiments.items()}, rel=1e-12)
