"""An end of a sensor's range and a channel that has stopped are named, and a fit does not follow them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from benchmarks.bench_rig import bench_record, purpose_rig
from benchmarks.fit_bench import believed_plant
from pneumo import simulate
from pneumo.fitting import fit_warnings
from pneumo.fitting.fit_problem import Problem, fit
from pneumo.fitting.record.measurement import read_measurement
from pneumo.fitting.record.sensor_faults import at_end_of_range, stopped
from pneumo.fitting.residuals import residuals
from pneumo.fitting.stage_signals import stage_signals
from pneumo.physics.models import FULL

RIG, SECONDS = purpose_rig(), 4.0


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    return believed_plant(RIG, tmp_path_factory.mktemp("rig"))


@pytest.fixture(scope="module")
def bench():
    c = bench_record(RIG, np.random.default_rng(3), SECONDS)
    names = {"t": "t_s", "u": "u_V", "x": "x_m", "P_A": "P_A_Pa", "P_B": "P_B_Pa", "P_s": "P_s_Pa"}
    table = pd.DataFrame(c).rename(columns=names)
    return table.round({"x_m": 6, "P_A_Pa": -1, "P_B_Pa": -1})


def fitted(record, plant, **fixed):
    """Full order fitted to a record, plainly."""
    signals = stage_signals(record, plant)
    problem = Problem(FULL, plant, signals, fixed)
    return problem, fit(problem, tolerance=1e-4)


@pytest.mark.parametrize("step", [10.0, 240.0])  # Pa: a logger of many digits, 12 bits over 10 bar
def test_samples_at_the_end_of_a_range_are_named_and_not_fitted(bench, plant, step):
    end = 615e3 // step * step
    P = bench["P_B_Pa"].to_numpy() // step * step
    assert (end < P).mean() > 0.02  # noise of 1 kPa
    clipped = bench.drop(columns="P_s_Pa").assign(P_B_Pa=np.minimum(P, end))
    record = read_measurement(clipped, plant)
    (note,) = record.notes
    assert note.startswith(f"column P_B: {np.sum(end <= P)} of 4001 samples are exactly {end}")
    assert not record.used[1, end <= P].any() and record.used[0].all() and record.used[1].mean() > 0.8
    problem, found = fitted(record, plant)
    assert problem.values(found.theta)["k_xu"] == pytest.approx(plant.valve.k_xu, rel=0.02)
    assert problem.values(found.theta)["V_d_B"] == pytest.approx(RIG.V_B, rel=0.1)
    assert max(residual.coloured for residual in residuals(problem, found.theta)) < 300.0


@pytest.mark.parametrize("name", ["x_m", "P_A_Pa", "P_s_Pa"])
def test_a_record_ends_where_a_channel_stops(bench, plant, name):
    stops = round(0.6 * len(bench))
    values = bench[name].to_numpy().copy()
    values[stops:] = values[stops]
    record = read_measurement(bench.assign(**{name: values}), plant)
    assert len(record.u) == stops + 1
    assert any(f"column {name[:-2].rstrip('_')}: stays at exactly" in note for note in record.notes)
    values[stops:-500] = values[stops]
    values[-500:] = bench[name][-500:]
    resumed = read_measurement(bench.assign(**{name: values}), plant)
    assert len(resumed.u) == len(bench) and any("fit the parts before" in note for note in resumed.notes)


def test_sound_signals_have_no_faults(bench, plant):
    """Neither noise, quantised or not, nor rest at the supply's pressure and at the stops is a fault."""
    stroke = simulate(plant, 1e-3, command=np.repeat([10.0, -10.0, 0.0], 700), start="vented")
    signals = [bench["P_A_Pa"], bench["x_m"], stroke.P_A, stroke.P_B]
    rests = plant.conditions.P_s, plant.conditions.P_atm
    rng = np.random.default_rng(1)
    resting = 5e5 + rng.normal(0.0, 100.0, 20_000)
    for signal in (*map(np.asarray, signals), resting, stroke.P_A + rng.normal(0.0, 300.0, len(stroke.P_A))):
        for step in (1e-6, 10.0, 100.0, 250.0, 1000.0, 4000.0):
            if step < np.ptp(signal) / 50:
                quantised = np.round(signal / step) * step
                assert not at_end_of_range(quantised, rests).any() and stopped(quantised) is None
    record = read_measurement(stroke.to_table(), plant)
    assert record.used.all() and not any("column" in note and "used" not in note for note in record.notes)


def test_a_measured_supply_that_is_off_is_named(bench, plant, monkeypatch):
    monkeypatch.setattr(fit_warnings, "CAUSES", ("offset_A", "sag", "offset_P_s"))  # others take long
    high = read_measurement(bench[:2500].assign(P_s_Pa=bench["P_s_Pa"] + 20e3), plant)
    problem, found = fitted(high, plant)
    split = residuals(problem, found.theta)
    without_intervals = SimpleNamespace(values=problem.values(found.theta), low={}, high={})
    (text,) = fit_warnings.cause_warnings(problem, split, without_intervals)
    assert text.startswith("an offset of") and "kPa of the sensor of P_s (--also offset_P_s" in text
    free = replace(problem, also=("offset_P_s",))
    assert free.values(fit(free).theta)["offset_P_s"] == pytest.approx(20e3, abs=2e3)
