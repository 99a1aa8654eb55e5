"""The search of a fit on linear problems, whose minima are those of linear algebra."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from pneumo.fit import least_squares
from pneumo.fit.least_squares import SETTLED, Fit, descend, fit_with_one_fixed, without_spikes

rng = np.random.default_rng(7)
J = rng.normal(size=(2, 50, 3)) * np.array([1.0, 5.0, 0.3])
TRUTH = np.array([0.4, -0.2, 0.9])
MEASURED = J @ TRUTH + rng.normal(0.0, 0.1, (2, 50))
FLAT = J.reshape(-1, 3)
START = np.array([1.5, -1.0, 2.0])
WIDE = np.array([[-9.0] * 3, [9.0] * 3])


def linear(theta):
    residual, none = MEASURED - J @ theta, np.zeros((3, 3))
    slope = FLAT.T @ residual.ravel()
    return Fit(theta, residual, J, float(np.sum(residual**2)), slope, FLAT.T @ FLAT, none, np.zeros(3))


@pytest.fixture(params=[False, True], ids=["with derivatives", "by sums alone"])
def problem(request, monkeypatch):
    """Linear problem; with noisy motions, a search with one parameter fixed compares sums alone."""
    monkeypatch.setattr(least_squares, "evaluate", lambda _, theta: linear(theta))
    monkeypatch.setattr(least_squares, "squares_at", lambda _, theta: linear(theta).squares)

    def of(bounds=WIDE):
        noisy = np.zeros(1) if request.param else None
        return SimpleNamespace(bounds=lambda: bounds, model=SimpleNamespace(name="M7"), noisy=noisy)

    return of


def minimum(bounds=WIDE, fixed=None):
    """Lowest sum of squares between bounds, with one parameter at its value in TRUTH plus 0.3 if fixed."""
    if fixed is None:
        return 2 * lsq_linear(FLAT, MEASURED.ravel(), bounds, tol=1e-14).cost
    others = np.arange(3) != fixed
    rest = MEASURED.ravel() - FLAT[:, fixed] * (TRUTH[fixed] + 0.3)
    return 2 * lsq_linear(FLAT[:, others], rest, bounds[:, others], tol=1e-14).cost


def assert_settled(found, lowest, start):
    """A search ends where a step would lower the sum by less than a part of the first variance."""
    negligible = SETTLED * linear(start).squares / found.residual.size
    # Damping of 1e-3 makes the step that much too short.
    assert lowest * (1 - 1e-9) <= found.squares < lowest + 1.01 * negligible


def test_a_search_from_far_ends_at_the_minimum(problem):
    assert_settled(descend(problem(), START), minimum(), START)


@pytest.mark.parametrize("index", [0, 1, 2])
def test_a_search_between_bounds_ends_at_their_minimum(problem, index):
    for low, high in ((TRUTH[index] + 0.5, 9.0), (-9.0, TRUTH[index] - 0.5)):
        bounds = WIDE.copy()
        bounds[:, index] = low, high
        found = descend(problem(bounds), START)
        assert np.all((found.theta >= bounds[0]) & (found.theta <= bounds[1]))
        assert_settled(found, minimum(bounds), np.clip(START, *bounds))


@pytest.mark.parametrize("index", [0, 1, 2])
def test_a_fixed_parameter_keeps_its_value_and_the_others_find_their_minimum(problem, index):
    best = linear(np.linalg.lstsq(FLAT, MEASURED.ravel())[0])
    value = TRUTH[index] + 0.3
    start = np.where(np.arange(3) == index, value, START)
    found = fit_with_one_fixed(problem(), best, index, value, START, 0.0)
    assert found.theta[index] == value
    assert_settled(found, minimum(fixed=index), start)


@pytest.mark.parametrize("index", [0, 1, 2])
def test_a_search_with_one_fixed_begins_at_the_minimum_of_the_linear_problem(monkeypatch, index):
    monkeypatch.setattr(least_squares, "descend", lambda _, start, **options: start)
    best = linear(np.linalg.lstsq(FLAT, MEASURED.ravel())[0])
    start = fit_with_one_fixed(None, best, index, TRUTH[index] + 0.3, None, 0.0)
    others = np.arange(3) != index
    rest = MEASURED.ravel() - FLAT[:, index] * (TRUTH[index] + 0.3)
    assert start[index] == TRUTH[index] + 0.3
    np.testing.assert_allclose(start[others], np.linalg.lstsq(FLAT[:, others], rest)[0], rtol=1e-9)


def test_a_step_uphill_is_not_taken_and_the_next_is_shorter(monkeypatch):
    """A sum of squares that rises beyond a short step: only damping makes the step short enough."""
    tried = []

    def narrow(_problem, theta):
        fit = linear(theta)
        tried.append(float(np.linalg.norm(theta - 5.0)))
        return fit._replace(squares=fit.squares + (1e9 if tried[-1] > 1.0 else 0.0))

    monkeypatch.setattr(least_squares, "evaluate", narrow)
    start = np.full(3, 5.0)
    problem = SimpleNamespace(bounds=lambda: WIDE, model=SimpleNamespace(name="M7"), noisy=None)
    found = descend(problem, start, most=12)
    assert tried[1] > 1.0 and found.squares < linear(start).squares
    assert np.linalg.norm(found.theta - start) <= 1.0


def test_noise_in_the_position_makes_no_larger_derivative_usual():
    measured, noisy = np.ones((2, 1000, 1)), np.ones((2, 1000, 1))
    noisy[:, 5::10] = 10.0
    limited = without_spikes(np.stack([measured, noisy]))
    np.testing.assert_array_equal(limited[0], measured)
    # Three times the usual maximum of the measured motion, from the median of the neighbours.
    np.testing.assert_array_equal(limited[1], np.minimum(noisy, 4.0))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_spike_of_the_other_sign_is_cut_though_smaller_than_three_times_the_usual(sign):
    J = np.full((2, 2, 1000, 1), -sign)
    J[1, :, 5::10] = 2.5 * sign
    expected = J.copy()
    expected[1, :, 5::10] = 2.0 * sign  # three from the median of the neighbours
    np.testing.assert_array_equal(without_spikes(J), expected)
