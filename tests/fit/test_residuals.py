"""Residuals of a fit split into the sensors' noise and the rest: known parts come back."""

import numpy as np
import pytest

from pneumo.fit.residuals import Residual, noise_of, quantum, sensor_noise, split_residuals

PERIOD, SAMPLES = 1e-3, 20_000
T = PERIOD * np.arange(SAMPLES)
P = 4e5 + 1e5 * np.sin(3 * T + np.array([[0.0], [1.0]]))  # Pa, nothing quantised
NONE = np.empty((0, 2, SAMPLES))
SLOW = 500.0 * np.sin(2 * np.pi * T)  # Pa, whole periods of 1 s


def white(deviation, seed=0):
    return np.random.default_rng(seed).normal(0.0, deviation, (2, SAMPLES))


def test_white_noise_leaves_no_rest():
    for side in split_residuals(P, white(1e3), PERIOD, NONE):
        # Of 20,000 samples the rms is known to 0.5 %, the median of third differences to some 2 %.
        assert side.rms == pytest.approx(1e3, rel=0.025) and side.noise == pytest.approx(1e3, rel=0.08)
        # The mean square of 1,000 means of 20 samples is known to 4 % of itself: 0.05 of the noise.
        assert side.coloured < 0.15 * 1e3
        assert not side.unexplained


def test_a_slow_error_is_the_rest_and_no_noise():
    sides = split_residuals(P, white(1e3) + np.array([[1.0], [2.0]]) * SLOW, PERIOD, NONE)
    for side, amplitude in zip(sides, (500.0, 1000.0), strict=True):
        # The square of the rest is known to the noise of the means, 5 % of it: 2.5 % of the rest.
        assert side.coloured == pytest.approx(amplitude / 2**0.5, rel=0.1)
        assert side.rms == pytest.approx(np.hypot(1e3, amplitude / 2**0.5), rel=0.025)
        assert side.noise == pytest.approx(1e3, rel=0.08)


@pytest.mark.parametrize("part", [0.5, 0.8])
def test_what_noise_in_the_position_explains_is_not_in_the_rest(part):
    # Replays with added noise that differ from their mean by a part of the residual.
    noisy = np.array([sign * part * np.array([SLOW, SLOW]) for sign in (1.0, -1.0)]) + P
    alone, explained = (split_residuals(P, np.array([SLOW, SLOW]), PERIOD, n) for n in (NONE, noisy))
    for before, after in zip(alone, explained, strict=True):
        # Squares are subtracted; the curvature of the slow error passes for noise, 1e-5 of it.
        assert after.coloured == pytest.approx((1 - part**2) ** 0.5 * before.coloured, rel=1e-3)


def test_steps_of_a_constant_pressure_do_not_average_out():
    # A pressure that rests within one step: its rounding error is the same in every sample.
    still = np.full((2, SAMPLES), 4e5)
    still[:, ::2] += 244.0
    of_rounding = np.full((2, SAMPLES), 244.0 / 12**0.5)
    for side in split_residuals(still, of_rounding, PERIOD, NONE):
        assert side.coloured == pytest.approx(0.0, abs=1e-6) and side.noise == pytest.approx(244 / 12**0.5)


@pytest.mark.parametrize(
    ("part", "unexplained", "far"), [(0.39, 0, 0), (0.41, 1, 0), (0.99, 1, 0), (1.01, 1, 1)]
)
def test_a_rest_is_unexplained_above_0_4_of_the_noise_and_far_above_all_of_it(part, unexplained, far):
    residual = Residual(2e3, part * 700.0, 700.0)  # limits of decision 91
    assert (residual.unexplained, residual.far_from_noise) == (unexplained, far)


def test_noise_of_two_sensors_is_their_root_mean_square():
    residual = white(1.0) * np.array([[300.0], [400.0]])
    alone = [noise_of(*pair) for pair in zip(P, residual, strict=True)]
    assert alone == pytest.approx([300.0, 400.0], rel=0.08)
    assert sensor_noise(P, residual) == pytest.approx(np.hypot(*alone) / 2**0.5, rel=1e-12)


def test_a_signal_of_one_value_or_of_many_has_no_steps():
    assert quantum(np.full(50, 3.0)) == 0.0
    assert quantum(np.tile([1.0, 3.0, 5.0], 20)) == 2.0
    assert quantum(np.arange(60.0)) == 0.0  # every sample another value


def test_steps_of_a_pressure_are_subtracted_by_their_variance():
    still = np.full((2, SAMPLES), 4e5)
    still[:, ::2] += 244.0
    for side in split_residuals(still, np.full((2, SAMPLES), 300.0), PERIOD, NONE):
        assert side.coloured == pytest.approx((300**2 - 244**2 / 12) ** 0.5, rel=1e-9)


@pytest.mark.parametrize(("period", "length"), [(1e-3, 20), (5e-3, 4), (2e-2, 1), (5e-2, 1), (0.2, 1)])
def test_white_noise_averages_out_over_20_ms_or_at_least_one_sample(period, length):
    """Of pulses of one sample in 20 the mean over a block is left; the median sees no noise in them."""
    pulses = np.tile((np.arange(SAMPLES) % 20 == 3) * 100.0, (2, 1))
    for side in split_residuals(P, pulses, period, NONE):
        assert side.noise == pytest.approx(0.0, abs=1e-9)
        assert side.coloured == pytest.approx(100.0 / (20 * length) ** 0.5, rel=1e-6)


def test_third_differences_are_those_of_white_noise():
    """Half of a normal distribution is within 0.6745 deviations; squares of 1, 3, 3 and 1 add up to 20."""
    cubic = np.arange(100.0) ** 3  # third differences of 6
    assert noise_of(np.arange(100.0), cubic) == pytest.approx(6 / (0.67449 * 20**0.5), rel=1e-4)


def test_noise_beyond_what_blocks_leave_is_no_rest():
    for side in split_residuals(P, np.tile([0.3, -0.3], (2, SAMPLES // 2)), PERIOD, NONE):
        assert side.coloured == 0.0 and side.rms == pytest.approx(0.3)
