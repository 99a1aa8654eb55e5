"""Covariance from few samples and the chi-square of deviations."""

import numpy as np
import pytest
from scipy.stats import chi2, kstest

from paper.study.paper_2006.likelihood import chi_square, shrunk_covariance


def test_white_noise_has_no_correlations_left_and_many_samples_keep_theirs():
    rng = np.random.default_rng(3)
    noise = shrunk_covariance(rng.normal(size=(20, 100)))
    assert noise.shrinkage > 0.9
    mixed = rng.normal(size=(20_000, 4)) @ np.linalg.cholesky(TRUE).T
    covariance, shrinkage = shrunk_covariance(mixed)
    assert shrinkage < 0.01
    np.testing.assert_allclose(covariance, TRUE, atol=0.1)


TRUE = np.array([[4.0, 1.8, 0.0, 0.5], [1.8, 1.0, 0.1, 0.2], [0.0, 0.1, 2.0, 0.9], [0.5, 0.2, 0.9, 1.0]])


def test_chi_square_is_known_and_of_its_distribution():
    assert chi_square(np.array([3.0, 4.0]), np.diag([9.0, 4.0])) == pytest.approx(1 + 4)
    correlated = np.array([[1.0, 0.8], [0.8, 1.0]])
    along, across = chi_square(np.array([[1.0, 1.0], [1.0, -1.0]]), correlated)
    assert (along, across) == (pytest.approx(2 / 1.8), pytest.approx(2 / 0.2))
    rng = np.random.default_rng(7)
    samples = rng.normal(size=(5000, 4)) @ np.linalg.cholesky(TRUE).T
    assert kstest(chi_square(samples, TRUE), chi2(4).cdf).pvalue > 0.01
    assert kstest(chi_square(samples, np.diag(np.diag(TRUE))), chi2(4).cdf).pvalue < 1e-6
