"""The least squares behind every fit, on a decay with known truth: y = a exp(-b t), c, with a, b > 0."""

from typing import NamedTuple

import numpy as np
import pytest

from pneumo.fitting.least_squares import (
    HALF_WIDTH,
    Scale,
    correlations,
    covariances,
    parameter_interval,
    solve,
)

T = np.linspace(0.0, 3.0, 400)
TRUTH = np.array([0.5, -0.2, 1.0])  # ln a, ln b and the second channel's level
NOISE = 0.02


class Decay(NamedTuple):
    """Two channels; the logarithm of b does not matter where `blind`."""

    y: np.ndarray
    high: float = 3.0
    blind: bool = False
    centre: float = 0.0  # of c's prior
    weight: float = 0.0

    names = ("a", "b", "c")
    scales = dict.fromkeys(names, Scale(0.05, 20.0, logarithmic=True))

    def bounds(self):
        return np.array([[-3.0, -3.0, -3.0], [3.0, self.high, 3.0]])

    def computed(self, theta):
        decay = np.exp(theta[0] - (0.0 if self.blind else np.exp(theta[1])) * T)
        return np.array([decay, np.full_like(T, theta[2])])

    def residual(self, theta):
        return self.y - self.computed(theta)

    def around(self, theta):
        return self.residual(theta), lambda: self.jacobian(theta)

    def jacobian(self, theta):
        first = self.computed(theta)[0]
        J = np.zeros((*self.y.shape, 3))
        J[0, :, 0], J[0, :, 1], J[1, :, 2] = first, -first * T * np.exp(theta[1]), 1.0
        J[..., 1] *= not self.blind
        return J

    def prior_terms(self, theta):
        return theta - [0, 0, self.centre], np.array([0, 0, self.weight])


def measured(seed=0, memory=0.0, noise=NOISE):
    """Record with noise that has a correlation of `memory` from sample to sample."""
    white = np.random.default_rng(seed).normal(0.0, noise, (2, len(T)))
    for i in range(1, len(T)):
        white[:, i] = memory * white[:, i - 1] + (1 - memory**2) ** 0.5 * white[:, i]
    return Decay(Decay(white).computed(TRUTH) + white)


@pytest.mark.parametrize("start", [(0, 0, 0), (-2, 2, -2), (2.9, -2.9, 2.9)])
def test_a_search_ends_at_the_minimum_from_anywhere(start):
    exact = measured(noise=0.0)
    np.testing.assert_allclose(solve(exact, np.array(start, float)).theta, TRUTH, atol=1e-4)


def test_a_search_keeps_bounds_and_what_is_fixed():
    exact = measured(noise=0.0)
    assert solve(exact._replace(high=-0.5), np.zeros(3)).theta[1] == pytest.approx(-0.5, abs=1e-3)
    held = solve(exact, np.array([0.0, 1.0, 0.0]), fixed=1)
    assert held.theta[1] == 1.0 and held.theta[2] == pytest.approx(1.0)


def test_a_prior_draws_its_parameter_by_its_weight():
    drawn = solve(measured(noise=0.0)._replace(centre=2.0, weight=float(len(T))), np.zeros(3))
    assert drawn.theta[2] == pytest.approx(1.5)  # as heavy as the record
    assert drawn.squares == pytest.approx(2 * len(T) * 0.25)


@pytest.mark.parametrize("memory", [0.0, 0.7])
def test_nineteen_of_twenty_intervals_hold_the_truth_whatever_memory_noise_has(memory):
    held = []
    for seed in range(100):
        problem = measured(seed, memory)
        best = solve(problem, TRUTH)
        both = covariances(best)
        ends = [parameter_interval(problem, best, i, both) for i in range(3)]
        held += [low <= truth <= high for truth, (low, high) in zip(TRUTH, ends, strict=True)]
    # 300 intervals know their rate to 1.3 %; memory costs one record some of its own correlation.
    assert 0.91 < np.mean(held) < 0.99


def test_the_spectrum_of_residuals_is_nowhere_negative():
    """Else a parameter could have a negative variance; Parzen's taper is among those that keep to this."""
    gamma = correlations(measured(memory=0.9).y)
    spectra = np.fft.fft(np.roll(np.pad(gamma, ((0, 0), (0, 0), (0, 4096))), -(gamma.shape[2] // 2), axis=2))
    assert np.linalg.eigvalsh(spectra.transpose(2, 0, 1)).min() > -1e-12 * np.abs(spectra).max()


def test_a_wide_interval_is_that_of_the_profile():
    problem = measured(noise=1.5)
    best = solve(problem, TRUTH)
    both = covariances(best)
    low, high = parameter_interval(problem, best, 1, both)
    assert high - low > 0.6
    variance = both[:, 1, 1].max()
    allowed = HALF_WIDTH**2 * variance / np.linalg.inv(best.curvature)[1, 1]
    for end in (low, high):
        start = best.theta.copy()
        start[1] = end
        risen = solve(problem, start, fixed=1).squares - best.squares
        assert risen == pytest.approx(allowed, rel=0.2)  # an end is accurate to 5 %


def test_what_a_record_does_not_show_is_open():
    blind = Decay(measured().y, blind=True)
    best = solve(blind, np.zeros(3))
    assert np.isinf(parameter_interval(blind, best, 1, covariances(best))).all()
    assert np.isfinite(parameter_interval(blind, best, 2, covariances(best))).all()
