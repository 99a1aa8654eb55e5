"""One step of the observers' filter, uncompiled: noise, stops, limits, the order of its rule."""

import numpy as np
import pytest
from paper_study import STUDY

from pneumo.evidence.at_work.observers import Noise, correct_all, first_covariance, predict
from pneumo.physics.models import MODELS, lane

pytestmark = pytest.mark.uncompiled

CLOSED = STUDY.experiments["E10"]
PLANT, H = CLOSED.plant, CLOSED.h
C, CYLINDER = PLANT.conditions, PLANT.cylinder
LANE = lane(MODELS["M8"], 1.35, PLANT.gas.gamma)
SILENT = Noise(0.0, 0.0)


def after(y, u=1.0, noise=SILENT, h=H, steps=1):
    """State and covariance after some steps from the first covariance."""
    y, covariance, W = np.array(y), first_covariance(), np.empty((4, 4, 4))
    for _ in range(steps):
        predict(y, covariance, u, PLANT, LANE, noise, h, W)
    return y, covariance


def test_noise_adds_its_variance():
    start = [0.01, 0.2, 4e5, 5e5]
    (_, silent), (_, noisy) = after(start), after(start, noise=Noise(2.0, 1e6))
    added = np.diag([0.0, H * (2.0 / CYLINDER.M) ** 2, H * 1e12, H * 1e12])
    np.testing.assert_allclose(noisy - silent, added, rtol=1e-9, atol=1e-9)


def test_the_rule_is_of_second_order():
    start = [0.01, 0.2, 4e5, 5e5]
    true = after(start, h=H / 64, steps=64)[0]
    one, two = (abs(after(start, h=H / k, steps=k)[0] - true)[2:].max() for k in (1, 2))
    assert one / two == pytest.approx(4, rel=0.2)


def test_a_stop_holds_the_piston():
    y, _ = after([CYLINDER.x_max - 1e-5, 0.5, C.P_0, C.P_0])
    assert y[:2].tolist() == [CYLINDER.x_max, 0.0]


def test_the_infinite_slope_of_the_flow_at_equal_pressures_is_limited():
    _, covariance = after([0.0, 0.0, C.P_s - 1.0, C.P_0], u=10.0)
    # With the rate's derivative at -1/h, a step halves the error: 1 - 1 + 1/2.
    assert covariance[2, 2] == pytest.approx(first_covariance()[2, 2] / 4, rel=0.05)


def test_pressures_stay_possible():
    beyond, limits = [0.0, 0.0, 3 * C.P_s, C.P_atm / 10], [2 * C.P_s, C.P_atm / 2]
    assert after(beyond, u=0.0)[0][2:].tolist() == limits
    y = np.array(beyond)
    correct_all(y, first_covariance(), 0.0, np.zeros(2), 0, PLANT)
    assert y[2:].tolist() == limits


@pytest.mark.parametrize("measured", [0, 1, 2])
def test_each_pressure_that_is_measured_corrects_its_own(measured):
    y, read = np.array([0.0, 0.0, C.P_0, C.P_0]), C.P_0 + np.array([2e4, -3e4])
    correct_all(y, first_covariance(), 0.0, read, measured, PLANT)
    expected = np.where(np.arange(2) < measured, read, C.P_0)
    assert y[2:] == pytest.approx(expected, abs=150)  # the sensor's variance is a 400th of the first
