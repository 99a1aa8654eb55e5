"""An offset of a pressure sensor shows in the residual of a fit that does not have it as a parameter."""

import numpy as np
import pytest

from pneumo.fit.fit_result import Estimate
from pneumo.fit.fit_warnings import offset_warnings
from pneumo.fit.least_squares import Fit
from pneumo.fit.sensor_offsets import SensorOffset, sensor_offsets

SAMPLES, P_S = 4000, 7e5
NAMES = ("k_0", "k_xu", "V_d_A", "V_d_B")


def fitted(offset, noise, slow=0.0):
    """Linear fit of pressures with an offset of A, Pa, and its derivatives: slow signals of both chambers."""
    rng, t = np.random.default_rng(1), np.linspace(0.0, 60.0, SAMPLES)
    J = np.array([[0.3 + np.sin(t + k + side) for k in range(4)] for side in range(2)]).swapaxes(1, 2)
    P = rng.normal(0.0, noise, (2, SAMPLES)) + np.repeat(rng.normal(0.0, slow, (2, 80)), 50, axis=1)
    P[0] += offset
    flat = J.reshape(-1, 4)
    curvature = flat.T @ flat + 1e-6 * np.eye(4)
    theta = np.linalg.solve(curvature, flat.T @ P.ravel() / P_S)
    residual = P / P_S - J @ theta
    none = np.zeros(4)
    return Fit(theta, residual, J, float(np.sum(residual**2)), none, curvature, np.zeros((4, 4)), none)


def test_an_offset_that_is_not_fitted_is_found_with_its_effect_on_the_parameters():
    best, none = fitted(1e4, 1e3), np.zeros((0, 2, SAMPLES))
    of_A, of_B = sensor_offsets(best, none, P_S)
    assert of_A.value == pytest.approx(1e4, abs=4 * of_A.deviation)
    assert of_A.deviation < 500.0  # 1 kPa by the root of 4,000 samples, and more: parameters take a part
    np.testing.assert_allclose(best.theta + of_A.shifts, fitted(0.0, 1e3).theta, atol=1e-3)
    assert abs(of_A.value) / of_A.deviation > abs(of_B.value) / of_B.deviation


def test_what_is_configured_and_slow_residuals_make_an_offset_less_sure():
    sure, _ = sensor_offsets(fitted(1e4, 1e3), np.zeros((0, 2, SAMPLES)), P_S)
    gain = np.zeros((1, 2, SAMPLES))
    gain[0, 0] = 5e3 / P_S
    unsure, _ = sensor_offsets(fitted(1e4, 1e3), gain, P_S)
    assert unsure.deviation == pytest.approx(np.hypot(sure.deviation, 5e3 / 1.96), rel=0.01)
    slow, _ = sensor_offsets(fitted(1e4, 1e3, slow=2e3), np.zeros((0, 2, SAMPLES)), P_S)
    assert slow.deviation > 5 * sure.deviation  # 2 kPa by the root of 80 blocks: ten times


def warned(*, A=(1e4, 1e3, 0.2), B=(0.0, 1e3, 0.0), expected=0.1):
    """Warnings by value, deviation and shift of V_d of A, of both offsets."""
    offsets = {
        f"offset_{side}": SensorOffset(value, deviation, np.array([0.0, 0.0, shift, 0.0]))
        for side, (value, deviation, shift) in zip("AB", (A, B), strict=True)
    }
    none = np.zeros(2)
    half = dict.fromkeys(NAMES, expected)
    return offset_warnings(Estimate({}, {}, {}, none, none, none, expected=half, offsets=offsets))


def test_an_offset_is_named_where_it_is_sure_and_moves_a_parameter_out_of_its_interval():
    (text,) = warned()
    assert text.startswith("an offset of 10 kPa of the sensor of P_A (--also offset_A fits it) would move")
    assert warned(A=(1e4, 4e3, 0.2)) == []  # 2.5 standard deviations
    assert warned(expected=0.3) == []  # within the interval
    assert warned(A=(1e4, 1e3, 0.04), expected=0.0) == []  # of no importance
    (both,) = warned(B=(-8e3, 1e3, 0.2))
    assert "offset_A" in both and "offset_B" in both and "cannot tell which" in both
    (alone,) = warned(B=(-4e3, 1e3, 0.2))
    assert "offset_B" not in alone
