"""Of a long record the beginning is fitted, and that is said."""

import numpy as np
import pytest

from benchmarks.bench_rig import bench_record, purpose_rig
from benchmarks.fit_bench import believed_plant
from pneumo.fitting.estimate import split_of
from pneumo.fitting.measurement_fit import fit_measurement
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.stage_signals import stage_signals


def test_the_part_fitted_has_a_largest_size(tmp_path, monkeypatch):
    monkeypatch.setattr("pneumo.fitting.estimate.MOST_STEPS", 1500)
    rig = purpose_rig()
    c = bench_record(rig, np.random.default_rng(3), 4.0)
    plant, P = believed_plant(rig, tmp_path), np.array([c["P_A"], c["P_B"]])
    record = stage_signals(1e-3, c["u"], c["x"], P, plant)
    assert split_of(record) * record.stride <= 1500
    told = []
    found = fit_measurement(Measurement("m", 1e-3, c["u"], c["x"], P), plant, [], progress=told.append)
    fitted = 1e-3 * split_of(record)
    assert found.held_out_from == pytest.approx(fitted)
    note = f"a long record: the first {fitted:.4g} s are fitted, the other {4 - fitted:.4g} s held out"
    assert note in found.notes and told[0] == f"note: {note}"
    # The beginning is enough: the rest is followed to the noise of the sensors.
    assert found.data["rms_held_out"].sel(model="full").values.max() < 1.3e3
