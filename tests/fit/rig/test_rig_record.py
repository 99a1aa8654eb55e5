"""A rig's record cut into runs: edges between samples, times, the smoothed position, what is left out."""

import numpy as np
import pytest

from pneumo.errors import InputError
from pneumo.fit.rig.rig_record import (
    AFTER,
    BEFORE,
    FALLEN,
    RISEN,
    Points,
    commanded,
    edges,
    pulses,
    vessel_run,
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
    both = np.concatenate([pulse(0.1), LOW + 0.5 * (pulse(0.1) - LOW)])
    assert len(edges(both)) == 1
    assert edges(pulse(0.1)[:350]) == []


def test_a_command_is_on_above_its_middle():
    u = np.array([0.0, 0.0, 4.0, 24.0, 24.0, 20.0, 10.0, 0.0, 0.0, 24.0])
    assert commanded(u) == [(3.0, 6.0)]  # the last one is not off again


def test_a_run_has_the_records_period_and_begins_and_ends_at_rest():
    (run,) = pulses(T, np.zeros_like(T), pulse(0.1), command())
    assert run.h == pytest.approx(H, rel=1e-12)
    np.testing.assert_allclose(run.P.t, H * np.arange(len(run.x)), rtol=1e-12)
    np.testing.assert_array_equal(run.t, run.P.t)
    assert (run.on, run.off - run.on) == pytest.approx((BEFORE, 0.2), rel=1e-9)
    np.testing.assert_array_equal(run.P.values, pulse(0.1)[90 : 90 + len(run.x)])
    # It ends a while after the pressure has come back to 1.5 % of its range, within one sample.
    assert run.P.t[-1] == pytest.approx(0.01 + 0.4 - RISEN * 0.1 + AFTER, abs=H)
    calm = 300 + int(np.argmax(pulse(0.1)[300:] <= LOW + RISEN * (HIGH - LOW)))
    assert len(run.x) == calm + 30 - 90 + 1


def test_only_whole_pulses_are_runs():
    two = np.concatenate([pulse(0.1), pulse(0.1)])
    u, x = np.tile(command(), 2), np.zeros(2 * len(T))
    t = H * np.arange(2 * len(T))
    assert len(pulses(t, x, two, u)) == 2
    cut = slice(None, len(T) + 400)  # within the second
    assert len(pulses(t[cut], x[cut], two[cut], u[cut])) == 1
    with pytest.raises(InputError, match="no whole pulse"):
        pulses(T, np.zeros_like(T), np.full_like(T, LOW), 0 * T)


def test_a_position_is_smoothed_and_counts_from_its_smallest():
    true = 0.03 * (1 - np.cos(8 * T))
    noisy = 0.5 + true + np.random.default_rng(3).normal(0.0, 2e-5, len(T))
    (run,) = pulses(T, noisy, pulse(0.1), command(), P_B=pulse(0.2))
    error = run.x - true[90 : 90 + len(run.x)]
    # Of samples that are 1 ms apart in a motion of 8 rad/s, smoothing leaves a small part of the noise.
    assert np.std(error) < 0.5 * 2e-5
    assert run.travel == pytest.approx(0.06, abs=5e-5) and run.x.min() >= 0
    np.testing.assert_array_equal(run.P_B.values, pulse(0.2)[90 : 90 + len(run.x)])


def test_a_vessels_run_lasts_as_long_as_its_last_point():
    P, T_of_gas = (Points(np.array([0.0, 0.1, end]), np.zeros(3)) for end in (3.0, 4.5))
    assert vessel_run(P).t[-1] == pytest.approx(3.0) and vessel_run(P, T_of_gas).t[-1] == pytest.approx(4.5)
    assert vessel_run(T_of_gas, P).t[-1] == pytest.approx(4.5)


def test_a_part_of_a_run_leaves_its_first_time_out_and_has_its_last():
    (run,) = pulses(T, np.zeros_like(T), pulse(0.1), command(), P_B=pulse(0.2))
    times = run.P.t
    part = run.within(times[10], times[20])
    for pressure in part.pressures:
        np.testing.assert_array_equal(pressure.t, times[11:21])
