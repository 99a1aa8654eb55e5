"""A rig's record cut into runs: edges between samples, times, the smoothed position, what is left out."""

import numpy as np
import pandas as pd
import pytest

from pneumo.errors import InputError
from pneumo.fitting.rig.rig_file import rig
from pneumo.fitting.rig.rig_record import (
    AFTER,
    BEFORE,
    FALLEN,
    RISEN,
    edges,
    pulses,
    read_runs,
)

H = 1e-3
T = H * np.arange(1200)
LOW, HIGH = 1e5, 6e5


def pulse(begins, t=T):
    """Pressure that rises on a line for 0.2 s, holds, and falls on a line for 0.1 s."""
    return LOW + (HIGH - LOW) * np.interp(t - begins, [0.0, 0.2, 0.3, 0.4], [0.0, 1.0, 1.0, 0.0])


def command(t=T):
    return 5.0 * ((t > 0.0995) & (t < 0.2995))


@pytest.mark.parametrize("late", [0.0, 0.25, 0.5, 0.9])
def test_edges_are_interpolated_between_samples(late):
    ((begin, end),) = edges(pulse(0.1 + late * H))
    # Samples from 0.1 s on, as the lines cross the levels: rounding is left.
    assert begin == pytest.approx(100 + late + RISEN * 200, abs=1e-6)
    assert end == pytest.approx(100 + late + 300 + (1 - FALLEN) * 100, abs=1e-6)


def test_a_small_pulse_and_one_that_does_not_end_are_no_pulses():
    small = LOW + 0.5 * (pulse(0.1) - LOW)
    assert len(edges(np.concatenate([pulse(0.1), small]))) == 1
    assert edges(pulse(0.1)[:350]) == []
    dip = pulse(0.1) - 0.5 * (HIGH - LOW) * ((T > 0.32) & (T < 0.35))
    assert edges(dip) == pytest.approx(edges(pulse(0.1)))  # it ends where it last falls


def test_whole_pulses_are_runs_with_the_records_period_that_begin_and_end_at_rest():
    true = 0.03 * (1 - np.cos(8 * T))
    noisy = 0.5 + true + np.random.default_rng(3).normal(0.0, 2e-5, len(T))
    (run,) = pulses(T, noisy, pulse(0.1), command(), P_B=pulse(0.2))
    part = slice(90, 90 + len(run.x))
    assert run.h == pytest.approx(H, rel=1e-12)
    np.testing.assert_allclose(run.P.t, H * np.arange(len(run.x)), rtol=1e-12)
    assert (run.on, run.off - run.on) == pytest.approx((BEFORE, 0.2), rel=1e-9)
    np.testing.assert_array_equal(run.P.values, pulse(0.1)[part])
    np.testing.assert_array_equal(run.P_B.values, pulse(0.2)[part])
    # It ends a while after the pressure has come back to 1.5 % of its range, within one sample.
    assert run.P.t[-1] == pytest.approx(0.01 + 0.4 - RISEN * 0.1 + AFTER, abs=H)
    # Of samples that are 1 ms apart in a motion of 8 rad/s, smoothing leaves a small part of the noise.
    assert np.std(run.x - true[part]) < 0.5 * 2e-5
    assert run.travel == pytest.approx(0.06, abs=5e-5) and run.x.min() >= 0

    two, t = np.tile(pulse(0.1), 2), H * np.arange(2 * len(T))
    assert len(pulses(t, 0 * t, two)) == 2
    assert len(pulses(t[:1600], 0 * t[:1600], two[:1600])) == 1  # the second is cut
    with pytest.raises(InputError, match="no whole pulse"):
        pulses(T, np.zeros_like(T), np.full_like(T, LOW), 0 * T)


VESSEL = rig({"volume_L": 10, "P_surroundings_bar": 1.1}, "test")


def written(folder, **columns):
    pd.DataFrame(columns).to_csv(folder / "tank.csv", index=False)
    return folder / "tank.csv"


def test_a_gauge_pressure_is_above_the_rigs_surroundings_and_times_count_from_the_first_row(tmp_path):
    t = [7.0, 8.0, 9.5, 10.0, 11.0, 12.0]
    P = [5.0, 4.0, np.nan, 3.0, 2.0, 1.0]
    (run,) = read_runs(written(tmp_path, t_s=t, P_A_barg=P), VESSEL)
    assert run.P.t.tolist() == [0.0, 1.0, 3.0, 4.0, 5.0]
    assert run.P.values == pytest.approx([6.1e5, 5.1e5, 4.1e5, 3.1e5, 2.1e5], rel=1e-12)
    line = rig({"volume_L": 10, "P_surroundings_bar": 0.04}, "test")  # to a vacuum pump: gauges know no line
    (run,) = read_runs(written(tmp_path, t_s=t, P_A_barg=-np.array(P) / 10), line)
    assert run.P.values[0] == pytest.approx(101325 - 0.5e5)
    with pytest.raises(InputError, match=r"line 2, column P_A .*: '-5.0': must be positive"):
        read_runs(written(tmp_path, t_s=t, P_A_bar=-np.array(P)), line)


@pytest.mark.parametrize(
    ("t", "P", "said"),
    [
        ([0, 1, 2, 3, 4], [1, 1, np.nan, 1, 1], "column P_A: 4 numbers: must be at least 5"),
        ([0, 1, 2, 1.5, 3], [1, 1, 1, 1, 1], "line 5, column t: '1.5': time of P_A must increase"),
        ([0, 1, 2, np.nan, 3, 4], [1, 1, 1, 1, 1, 1], "line 5, column t: 'empty': must be a finite number"),
    ],
)
def test_points_are_five_or_more_at_times_that_increase(t, P, said, tmp_path):
    with pytest.raises(InputError, match=said):
        read_runs(written(tmp_path, t_s=np.array(t, float), P_A_bar=np.array(P, float)), VESSEL)


FILLED = {"volume_L": 10, "valve_C_in_dm3_per_sbar": 1, "valve_C_out_dm3_per_sbar": 1, "P_s_bar": 7}


def test_a_vessel_behind_a_valve_is_cut_into_its_pulses_with_the_temperature(tmp_path):
    t, warm = T + 3.0, np.where(np.arange(len(T)) % 50 == 0, 300 + T, np.nan)
    file = written(tmp_path, t_s=t, P_A_bar=1e-5 * pulse(0.1), u_V=command(), T_K=warm)
    (run,) = read_runs(file, rig(FILLED, "test"))
    assert (run.x == 0).all() and (run.on, run.off) == pytest.approx((BEFORE, BEFORE + 0.2), abs=1e-9)
    begins = 0.1 - BEFORE
    of_gas = np.arange(0.1, begins + run.t[-1], 0.05)
    assert run.T.t == pytest.approx(of_gas - begins, abs=1e-9)
    assert run.T.values == pytest.approx(300 + of_gas, abs=1e-9)
    without = written(tmp_path, t_s=T, P_A_bar=1e-5 * pulse(0.1))
    with pytest.raises(InputError, match=r"no column u: .*; or --command edges"):
        read_runs(without, rig(FILLED, "test"))
    assert len(read_runs(without, rig(FILLED, "test"), from_edges=True)) == 1
