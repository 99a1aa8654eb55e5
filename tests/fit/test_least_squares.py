"""The search of a fit on linear problems, whose minima are those of linear algebra."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from pneumo.errors import InputError
from pneumo.fit import least_squares
from pneumo.fit.fit_problem import Problem
from pneumo.fit.fitted_parameters import FULL_ORDER
from pneumo.fit.least_squares import (
    Fit,
    descend,
    evaluate,
    fit,
    fit_with_one_fixed,
    squares_at,
    without_spikes,
)
from pneumo.physics.models import MODELS

SETTLED = 0.03  # of the variance of a residual, by which a search may still change the sum of squares

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


@pytest.mark.parametrize("sign", [1.0, -1.0, 100.0])
def test_a_spike_of_the_other_sign_is_cut_though_smaller_than_three_times_the_usual(sign):
    J = np.full((2, 2, 1000, 1), -sign)
    J[1, :, 5::10] = 2.5 * sign
    expected = J.copy()
    expected[1, :, 5::10] = 2.0 * sign  # three from the median of the neighbours
    np.testing.assert_array_equal(without_spikes(J), expected)


def test_usual_is_what_all_but_the_largest_hundredth_of_a_derivative_stays_below():
    J = np.ones((2, 2, 1000, 1))
    J[0, :, 30::65] = 2.0  # 15 in 1,000
    J[1, :, 500] = 100.0
    expected = J.copy()
    expected[1, :, 500] = 7.0  # three times 2, from the median of 1
    np.testing.assert_array_equal(without_spikes(J), expected)


@pytest.mark.parametrize(("width", "cut"), [(2, True), (3, False)])
def test_a_spike_is_narrower_than_half_of_five_samples(width, cut):
    J = np.ones((1, 2, 1000, 1))
    J[:, :, 500 : 500 + width] = 100.0
    expected = np.where(J > 4.0, 4.0, J) if cut else J.copy()
    np.testing.assert_array_equal(without_spikes(J), expected)


def test_a_derivative_at_either_end_of_a_record_is_none():
    """Of a first pressure it is large there: the end itself fills most of the five samples."""
    J = np.ones((1, 2, 1000, 1))
    J[:, :, [0, -1]] = 100.0
    np.testing.assert_array_equal(without_spikes(J.copy()), J)


def small(theta, scale=1e-3):
    """The linear problem in other units: its slopes are below 1, its sum of squares below a millionth."""
    found = linear(theta)
    parts = {"residual": scale * found.residual, "jacobian": scale * found.jacobian}
    parts |= {name: scale**2 * getattr(found, name) for name in ("squares", "slope", "curvature")}
    return found._replace(**parts)


def searched(monkeypatch, start, bounds=WIDE, **options):
    monkeypatch.setattr(least_squares, "evaluate", lambda _, theta: small(theta))
    problem = SimpleNamespace(bounds=lambda: bounds, model=SimpleNamespace(name="M7"), noisy=None)
    return descend(problem, start, **options)


def test_a_search_does_not_depend_on_the_unit_of_the_residual(monkeypatch):
    settled = 1.01e-6 * SETTLED * linear(START).squares / MEASURED.size
    assert 0 <= searched(monkeypatch, START).squares - 1e-6 * minimum() < settled
    low = np.array([TRUTH[0] - 0.5, -9.0, -9.0])  # at a bound, and away from it
    away = searched(monkeypatch, low + np.array([0, 8.0, 10.0]), np.array([low, WIDE[1]]))
    assert away.theta[0] > low[0] + 0.3


def test_the_first_step_on_a_linear_problem_is_all_but_a_thousandth_of_the_way(monkeypatch):
    rise = small(START).squares - 1e-6 * minimum()
    assert 0 <= searched(monkeypatch, START, most=1).squares - 1e-6 * minimum() < 3e-6 * rise
    assert np.array_equal(searched(monkeypatch, START, negligible=1e9).theta, START)


@pytest.mark.parametrize(
    ("name", "noisy", "fixed", "alone"),
    [
        (FULL_ORDER, None, 0, True),
        ("M7", np.zeros(1), 0, True),
        ("M7", None, 0, False),
        ("M7", np.zeros(1), None, False),
        (FULL_ORDER, None, None, False),
    ],
)
def test_a_sum_alone_is_computed_where_derivatives_take_replays_of_their_own(
    monkeypatch, name, noisy, fixed, alone
):
    """With a parameter fixed, of the full order or with noisy motions."""
    sums = []
    monkeypatch.setattr(least_squares, "evaluate", lambda _, theta: linear(theta))
    monkeypatch.setattr(least_squares, "squares_at", lambda _, x: sums.append(x) or linear(x).squares)
    problem = SimpleNamespace(bounds=lambda: WIDE, model=SimpleNamespace(name=name), noisy=noisy)
    descend(problem, START, fixed=fixed)
    assert bool(sums) == alone


def test_a_sum_that_rises_makes_the_next_step_shorter_where_sums_are_compared_alone(monkeypatch):
    tried = []

    def narrow(_problem, theta):
        tried.append(float(np.linalg.norm(theta - 5.0)))
        return linear(theta).squares + (1e9 if tried[-1] > 1.0 else 0.0)

    monkeypatch.setattr(least_squares, "evaluate", lambda _, theta: linear(theta))
    monkeypatch.setattr(least_squares, "squares_at", narrow)
    problem = SimpleNamespace(bounds=lambda: WIDE, model=SimpleNamespace(name=FULL_ORDER), noisy=None)
    start = np.full(3, 5.0)
    found = descend(problem, start, fixed=0, most=12)
    assert tried[0] > tried[1] > tried[2]
    assert 0 < np.linalg.norm(found.theta - start) <= 1.0


def test_a_search_with_one_fixed_leaves_out_a_direction_that_is_flat(monkeypatch):
    monkeypatch.setattr(least_squares, "descend", lambda _, start, **options: start)
    alike = J.copy()
    alike[..., 1] = alike[..., 0] + 0.01 * alike[..., 1]  # hardly another parameter
    flat = alike.reshape(-1, 3)
    H = flat.T @ flat
    best = linear(np.zeros(3))._replace(jacobian=alike, curvature=H)
    start = fit_with_one_fixed(None, best, 2, 10.0, None, 0.0)
    scale = np.sqrt(np.diag(H))[:2]
    inverse = np.linalg.pinv(H[:2, :2] / np.outer(scale, scale), rcond=0.01, hermitian=True)
    assert np.linalg.matrix_rank(inverse, tol=1e-6) == 1
    np.testing.assert_allclose(start[:2], -inverse @ (H[:2, 2] * 10.0 / scale) / scale, rtol=1e-9)


def test_a_replay_that_leaves_the_positive_numbers_has_the_largest_residuals_and_no_correction(monkeypatch):
    P = 0.1 * np.ones((3, 2, 50))  # of the measured motion and of a pair with noise
    P[1], P[2] = 0.12, 0.08
    P[2, :, -1] = np.nan
    monkeypatch.setattr(least_squares, "pressure_and_jacobian", lambda *_: (P.copy(), np.ones((*P.shape, 1))))
    monkeypatch.setattr(least_squares, "scaled_pressures", lambda *_: P[:, None])
    signals, plant = (
        SimpleNamespace(P=np.full((2, 50), 0.3)),
        SimpleNamespace(conditions=SimpleNamespace(P_s=1.0)),
    )
    no_prior = np.zeros(1), np.zeros(1)
    problem = SimpleNamespace(signals=signals, plant=plant, prior_terms=lambda _: no_prior)
    expected = 2 * (49 * 0.2**2 + least_squares.OFF**2)
    for found in (evaluate(problem, np.zeros(1)).squares, squares_at(problem, np.zeros(1))):
        assert found == pytest.approx(expected, rel=1e-12)
    assert 5 < least_squares.OFF < 50  # a pressure is at most a few times P_s


@pytest.mark.parametrize(
    ("leak", "laminar", "flow", "refused"),
    [(1e-9, 0.0, None, True), (0.0, 0.01, None, True), (0.0, 0.0, None, False), (1e-9, 0.01, 1.0, False)],
)
def test_a_valve_that_leaks_or_is_partly_laminar_is_refused_unless_flows_were_measured(
    monkeypatch, plant, leak, laminar, flow, refused
):
    class Searched(Exception):
        pass

    def found(*_, **__):
        raise Searched

    monkeypatch.setattr(least_squares, "least_squares", found)
    plant = plant._replace(valve=plant.valve._replace(leak=leak, laminar=laminar))
    with pytest.raises(InputError if refused else Searched):
        fit(Problem(MODELS["M7"], plant, SimpleNamespace(flow=flow, begins=(0,)), {}), start=np.zeros(1))
