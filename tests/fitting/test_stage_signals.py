"""Signals between sensors and replay: limiter, stages, smoothing."""

import numpy as np
import pytest
from scipy.signal import lfilter

from pneumo.configuration.sampling import INTERPOLATED
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.stage_signals import SMOOTHING, smoothing, stage_signals
from pneumo.fitting.valve_signal import filtered, lagged

PERIOD = 2e-3


@pytest.fixture(scope="module")
def record(plant):
    t = PERIOD * np.arange(400)
    u = np.where(np.arange(400) % 40 < 20, 12.0, -3.0)
    x = 0.05 * np.sin(8 * t) + np.random.default_rng(5).normal(0, 2e-4, 400)
    return t, Measurement("m", PERIOD, u, x, np.zeros((2, 400)))


def test_stages_have_the_limited_command_or_a_linear_one_and_a_motion_with_its_derivative(record, plant):
    t, m = record
    found, u = stage_signals(m, plant), m.u
    assert found.h == pytest.approx(1e-3) and found.stride == 2
    assert found.u.shape == (798, 3) and found.motion.shape == (798, 3, 2)
    np.testing.assert_array_equal(found.u[::2, 0], np.clip(u[:-1], -10, 10))
    np.testing.assert_array_equal(found.u[1::2, 2], np.clip(u[:-1], -10, 10))
    at = np.repeat(t[:-1], 2) + np.tile([0.0, 1e-3], 399)
    # Smoothing leaves less of the noise than was there, and the derivative's is that times a frequency.
    assert np.std(found.motion[:, 0, 0] - 0.05 * np.sin(8 * at)) < 1e-4
    assert np.std(found.motion[:, 0, 1] - 0.4 * np.cos(8 * at)) < 0.02
    wide = plant._replace(valve=plant.valve._replace(u_max=20.0))
    found = stage_signals(m, wide, INTERPOLATED)
    np.testing.assert_allclose(found.u[1::2, 0], (u[:-1] + u[1:]) / 2, rtol=1e-12)


@pytest.mark.parametrize("side", ["A", "B"])
def test_steps_are_short_where_a_valve_fills_a_small_chamber_fast(plant, side):
    end = plant.cylinder.x_min if side == "A" else plant.cylinder.x_max
    u, x, V_d = 4.0 * (np.arange(50) > 9), np.full(50, end), getattr(plant.cylinder, f"V_d_{side}")
    record = Measurement("m", PERIOD, u, x, np.zeros((2, 50)))
    large = plant._replace(valve=plant.valve._replace(k_xu=2e-6))
    c, gas, A_t = plant.conditions, plant.gas, 2e-6 * 4.0
    rate = gas.gamma * gas.R * c.T_in**0.5 * gas.sonic_coefficient * c.P_s * A_t / V_d  # (4)
    longest = 0.25 * c.P_s / rate
    found = stage_signals(record, large)
    assert found.h <= longest < found.h * (1 + 1 / (found.stride - 1))
    assert stage_signals(record._replace(u=0 * u), large).stride == 2


def test_smoothing_is_that_with_the_lowest_generalised_cross_validation():
    """By matrices: squares over the square of the degrees of freedom."""
    count = 60
    x = 3.0 * np.arange(count) + np.cumsum(np.random.default_rng(3).normal(size=count))
    difference = np.diff(np.eye(count), axis=0)
    second = difference.T @ difference  # with mirrored ends
    z = x - np.linspace(x[0], x[-1], count)  # a line is no motion
    scores = []
    for weight in SMOOTHING:
        removed = np.eye(count) - np.linalg.inv(np.eye(count) + weight * second @ second)
        freedom, squares = np.trace(removed), np.sum((removed @ z) ** 2)
        scores.append((squares / freedom**2, weight))
    _, weight = min(scores)
    assert SMOOTHING[5] < weight < SMOOTHING[-5]
    assert smoothing(x, PERIOD) == pytest.approx(weight * PERIOD**3)


def test_filters_are_those_of_scipy_and_leave_what_is_constant():
    x = np.random.default_rng(1).standard_normal((2, 50))
    expected = lfilter([0.7, 0.2], [1.0, -0.1], x, zi=x[:, :1])[0]
    np.testing.assert_allclose(filtered(x, 0.7, 0.2, 0.1, x[:, 0]), expected, atol=1e-14)
    np.testing.assert_allclose(lagged(np.full(9, 3.0), 5e-3, 1e-3), 3.0, rtol=1e-14)
