"""Covariances by explicit matrices, and which of standard error and profile gives an interval."""

from types import SimpleNamespace

import numpy as np
import pytest

from pneumo.fit import parameter_intervals as intervals
from pneumo.fit.least_squares import Fit
from pneumo.fit.parameter_intervals import HALF_WIDTH, LOOSE, WIDE
from pneumo.fit.stage_signals import FEW_PAIRS, PAIRS

rng = np.random.default_rng(4)
SAMPLES = 64
JACOBIAN = rng.normal(size=(2, SAMPLES, 3)) * np.array([1.0, 0.1, 3.0])
RESIDUAL = np.convolve(rng.normal(size=2 * SAMPLES), [1.0, 0.5, 0.2], "same").reshape(2, SAMPLES)


def fit_of(J=JACOBIAN, residual=RESIDUAL, prior=(0.0, 0.0, 0.0), scatter=0.0, curvature=None):
    flat, prior = J.reshape(-1, J.shape[2]), np.array(prior)
    H = flat.T @ flat + np.diag(prior) if curvature is None else curvature
    zero = np.zeros(len(prior))
    scatter = scatter * np.eye(len(prior))
    return Fit(zero, residual, J, float(np.sum(residual**2)), zero, H, scatter, prior)


def correlated(residual):
    """Matrix of all samples' covariances, by the sums themselves and Parzen's window of an eighth."""
    chambers, samples = residual.shape
    longest = samples // 8
    e = residual - residual.mean(axis=1, keepdims=True)
    gamma = np.zeros((chambers, samples, chambers, samples))
    for a in range(chambers):
        for b in range(chambers):
            for lag in range(-longest, longest + 1):
                r = abs(lag) / (longest + 1)
                window = 1 - 6 * r**2 + 6 * r**3 if r <= 0.5 else 2 * (1 - r) ** 3
                pairs = [(t, t + lag) for t in range(samples) if 0 <= t + lag < samples]
                mean = sum(e[a, t] * e[b, s] for t, s in pairs) / samples * window
                for t, s in pairs:
                    gamma[a, t, b, s] = mean
    return gamma.reshape(chambers * samples, chambers * samples)


def test_the_slopes_covariance_is_that_of_all_pairs_of_samples():
    flat, gamma = JACOBIAN.reshape(-1, 3), correlated(RESIDUAL)
    np.testing.assert_allclose(
        intervals.residual_scatter(fit_of()), flat.T @ gamma @ flat, rtol=1e-9, atol=1e-9
    )


def test_covariances_are_those_of_noise_and_of_the_residual_with_prior_and_model_error():
    prior, scatter, error = (2.0, 0.5, 0.0), 7.0, 0.3
    flat = JACOBIAN.reshape(-1, 3)
    inverse = np.linalg.inv(flat.T @ flat + np.diag(prior))
    white = np.mean(np.diff(RESIDUAL, axis=1) ** 2) / 2
    of_prior = white * np.diag(prior)
    noise = scatter * np.eye(3) + white * flat.T @ flat + of_prior
    rest = flat.T @ correlated(RESIDUAL) @ flat + of_prior
    found = intervals.covariances(fit_of(prior=prior, scatter=scatter), error)
    for covariance, inner in zip(found, (noise, rest), strict=True):
        expected = inverse @ inner @ inverse + error / HALF_WIDTH**2 * inverse
        np.testing.assert_allclose(covariance, expected, rtol=1e-9, atol=1e-12)


def test_a_parameter_that_changes_nothing_is_not_determined():
    J = JACOBIAN * np.array([1.0, 0.0, 1.0])
    for covariance in intervals.covariances(fit_of(J)):
        variances = np.diag(covariance)
        assert variances[1] >= intervals.UNKNOWN and max(variances[0], variances[2]) < 1.0


def test_shifts_by_the_remainder_are_those_of_what_is_not_white():
    flat = JACOBIAN.reshape(-1, 3)
    inverse = np.linalg.inv(flat.T @ flat)
    white = np.mean(np.diff(RESIDUAL, axis=1) ** 2) / 2
    added = inverse @ (flat.T @ (correlated(RESIDUAL) - white * np.eye(2 * SAMPLES)) @ flat) @ inverse
    expected = HALF_WIDTH * np.sqrt(np.maximum(np.diag(added), 0.0))
    np.testing.assert_allclose(intervals.remainder_shifts(fit_of()), expected, rtol=1e-9)
    np.testing.assert_allclose(intervals.expected_shifts(np.diag([4.0, 9.0])), HALF_WIDTH * np.array([2, 3]))


def test_a_curvature_that_is_not_positive_gives_way_to_the_plain_one():
    J = JACOBIAN
    plain = J.reshape(-1, 3).T @ J.reshape(-1, 3)
    assert intervals.definite(fit_of(J))
    np.testing.assert_allclose(intervals.inverse_curvature(fit_of(J)), np.linalg.inv(plain), rtol=1e-9)
    bent = fit_of(J, curvature=plain - 1.5 * np.diag([0.0, plain[1, 1], 0.0]))
    assert not intervals.definite(bent)
    np.testing.assert_allclose(intervals.inverse_curvature(bent), np.linalg.inv(plain), rtol=1e-9)
    # A direction that is flat within rounding is no reason.
    flat = np.stack([J[..., 0], J[..., 0], J[..., 2]], axis=-1)
    assert intervals.definite(fit_of(flat))


def test_a_correlation_is_of_the_larger_covariance():
    small, large = np.array([[1.0, 0.2], [0.2, 1.0]]), np.array([[4.0, -3.0], [-3.0, 9.0]])
    np.testing.assert_allclose(intervals.correlation(np.array([small, large])), [[1.0, -0.5], [-0.5, 1.0]])


@pytest.fixture
def interval(monkeypatch):
    """Interval of the first of two parameters by their covariance; a profile would give -0.9 to 1.1."""
    monkeypatch.setattr(intervals, "profile_interval", lambda *_: (-0.9, 1.1))
    best, rough = (SimpleNamespace(theta=np.array([at, 0.0])) for at in (0.5, 0.2))

    def of(half, other=0.1, correlation=0.0, name="k_xu", bounds=(-9.0, 9.0)):
        """`half` and `other` are the half-widths of 95 % intervals."""
        sizes = np.array([half, other]) / HALF_WIDTH
        covariance = np.outer(sizes, sizes) * np.array([[1.0, correlation], [correlation, 1.0]])
        ends = np.array([[bounds[0], -9.0], [bounds[1], 9.0]])
        problem = SimpleNamespace(names=(name, "k_0"), bounds=lambda: ends)
        both = np.array([covariance, 0.5 * covariance])
        return intervals.parameter_interval(problem, rough, best, 0, both)

    return of


def test_a_narrow_interval_is_that_of_the_standard_error(interval):
    assert interval(0.99 * WIDE) == pytest.approx((0.5 - 0.99 * WIDE, 0.5 + 0.99 * WIDE), rel=1e-9)
    assert interval(0.1, other=2 * LOOSE) == pytest.approx((0.4, 0.6), rel=1e-9)
    assert interval(0.15) == pytest.approx((0.35, 0.65), rel=1e-9)


def test_a_wide_interval_is_that_of_the_profile_about_the_best(interval):
    by_profile = pytest.approx((-0.9 + 0.3, 1.1 + 0.3), rel=1e-9)  # shifted from the rough fit to the best
    assert interval(1.01 * WIDE) == by_profile == interval(0.7)  # a factor of 2 to either side is wide
    assert interval(0.1, bounds=(0.41, 9.0)) == (pytest.approx(-np.inf), pytest.approx(1.4))
    assert interval(0.1, bounds=(-9.0, 0.59)) == (pytest.approx(-0.6), pytest.approx(np.inf))
    assert interval(0.1, bounds=(0.39, 0.61)) == pytest.approx((0.4, 0.6), rel=1e-9)


def test_a_parameter_that_is_not_logarithmic_has_the_standard_error_and_open_ends(interval):
    assert interval(1.5 * WIDE, name="n") == pytest.approx((0.5 - 1.5 * WIDE, 0.5 + 1.5 * WIDE), rel=1e-9)
    assert interval(0.2, name="n", bounds=(0.31, 0.69)) == (-np.inf, np.inf)
    assert interval(0.2, name="n", bounds=(0.31, 0.71)) == (-np.inf, pytest.approx(0.7))
    assert interval(0.2, name="n", bounds=(0.29, 0.69)) == (pytest.approx(0.3), np.inf)


def test_a_parameter_correlated_with_a_loose_one_has_both_intervals(interval):
    assert interval(0.1, other=2 * LOOSE, correlation=0.9) == pytest.approx((-0.6, 1.4), rel=1e-9)
    assert interval(0.1, other=2 * LOOSE, correlation=-0.9) == pytest.approx((-0.6, 1.4), rel=1e-9)
    assert interval(0.1, other=2 * LOOSE, correlation=0.4) == pytest.approx((0.4, 0.6), rel=1e-9)
    assert interval(0.1, other=0.5 * LOOSE, correlation=0.9) == pytest.approx((0.4, 0.6), rel=1e-9)
    assert interval(0.1, other=1.5, correlation=0.9) == pytest.approx((-0.6, 1.4), rel=1e-9)


def test_the_larger_of_two_covariances_counts():
    ends = np.array([[-9.0], [9.0]])
    problem = SimpleNamespace(names=("k_xu",), bounds=lambda: ends)
    best = SimpleNamespace(theta=np.zeros(1))
    for sizes in ((0.1, 0.2), (0.2, 0.1)):
        both = (np.array(sizes) / HALF_WIDTH).reshape(2, 1, 1) ** 2
        assert intervals.parameter_interval(problem, best, best, 0, both) == pytest.approx((-0.2, 0.2))


def test_sixteen_pairs_of_noise_give_an_interval_of_2_12_standard_errors():
    assert PAIRS == 16 and FEW_PAIRS == 3  # decision 22: three in the search
    assert pytest.approx(2.1199, abs=1e-4) == HALF_WIDTH  # Student's distribution, 16 degrees of freedom


def test_a_covariance_without_the_models_own_error_is_that_of_none():
    plain, exact, off = (intervals.covariances(fit_of(), *error) for error in ((), (0.0,), (1.0,)))
    np.testing.assert_array_equal(plain, exact)
    assert np.all(np.diagonal(off - exact, axis1=1, axis2=2) > 0)


def test_a_parameter_that_its_prior_or_opposite_samples_determine_is_not_unknown():
    J = JACOBIAN.copy()
    J[..., 0], J[..., 1] = np.tile([1.0, -1.0], SAMPLES // 2), 0.0  # a sum of zero, and nothing
    for covariance in intervals.covariances(fit_of(J, prior=(0.0, 2.0, 0.0))):
        assert np.diag(covariance).max() < 10.0


def test_a_residual_that_alternates_moves_nothing():
    alternating = np.tile([1.0, -1.0], (2, SAMPLES // 2))
    slow = JACOBIAN * 0 + np.cos(np.outer(np.arange(SAMPLES), [0.1, 0.2, 0.3]))
    np.testing.assert_array_equal(intervals.remainder_shifts(fit_of(slow, alternating)), 0.0)


def test_the_curvature_of_a_flat_direction_is_a_millionth_of_the_largest():
    a, c = JACOBIAN[..., 0], JACOBIAN[..., 2]
    flat = fit_of(np.stack([a, a, c], axis=-1))
    scale = np.sqrt(np.diag(flat.curvature))
    largest = np.linalg.eigvalsh(flat.curvature / np.outer(scale, scale)).max()
    inverse = intervals.inverse_curvature(flat) * np.outer(scale, scale)
    assert np.linalg.eigvalsh(inverse).max() == pytest.approx(1e6 / largest, rel=1e-6)


PROFILES = [  # deviance by the distance below and above the best, in what is allowed, and ends
    (lambda x: (x / 1.5) ** 2 if x < 0 else (x / 2.0) ** 2, (-1.5, 2.0)),
    (lambda x: (x / 4) ** 2 - 0.1, (-4 * 1.1**0.5, 4 * 1.1**0.5)),  # below the minimum, as noise may be
]


@pytest.mark.parametrize(("deviance", "ends"), PROFILES)
def test_both_ends_of_a_profile_are_found_in_a_few_trials(monkeypatch, deviance, ends):
    """The curvature is 4, and the variance of the parameter more than its inverse."""
    variance, tried = 2.0, []
    allowed = HALF_WIDTH**2 * variance * 4
    J = np.full((2, SAMPLES, 1), (4 / (2 * SAMPLES)) ** 0.5)
    best = fit_of(J, prior=(0.0,))._replace(theta=np.array([1.0]))
    problem = SimpleNamespace(bounds=lambda: np.array([[-9.0], [9.0]]))

    def fixed(_problem, fit, _index, value, start, negligible):
        tried.append((value, start))
        assert negligible == pytest.approx(0.05 * allowed, rel=1e-9)
        return fit._replace(theta=np.array([value]), squares=fit.squares + allowed * deviance(value - 1.0))

    monkeypatch.setattr(intervals, "fit_with_one_fixed", fixed)
    found = intervals.profile_interval(problem, best, 0, variance)
    assert found == pytest.approx((1 + ends[0], 1 + ends[1]), abs=0.05)
    assert len(tried) <= 9  # five for the farther end
    assert tried[0][1] is None and tried[1][1] == tried[0][0]  # from the last value inside
