"""Covariance of many numbers from few samples of them, and the chi-square of deviations with it.

Reference: J. Schäfer and K. Strimmer, A shrinkage approach to large-scale covariance matrix estimation,
Statistical Applications in Genetics and Molecular Biology 4 (2005), 32, doi:10.2202/1544-6115.1175.
"""

from typing import NamedTuple

import numpy as np


class ShrunkCovariance(NamedTuple):
    """Covariance matrix whose correlations were shrunk towards 0, and by how much."""

    covariance: np.ndarray  #: shape (number, number)
    shrinkage: float  #: lambda: 0 leaves the sample's correlations, 1 leaves none


def shrunk_covariance(samples: np.ndarray) -> ShrunkCovariance:
    """Covariance of the columns of `samples`, shape (sample, number), with correlations shrunk towards 0.

    Variances are those of the sample. Its correlations are multiplied by 1 - lambda, where lambda is the sum
    of their estimated variances over the sum of their squares, within 0 and 1 (the reference's Table 2,
    target D). A number that is the same in all samples has no variance and no correlations.
    """
    count = len(samples)
    deviation = samples.std(axis=0, ddof=1)
    z = (samples - samples.mean(axis=0)) / np.where(deviation > 0, deviation, 1.0)
    products, squares = z.T @ z, (z**2).T @ z**2
    correlation = products / (count - 1)
    variance = count / (count - 1) ** 3 * (squares - products**2 / count)  # of each correlation
    others = ~np.eye(len(correlation), dtype=bool)
    all_squares = np.sum(correlation[others] ** 2)
    shrinkage = min(1.0, float(np.sum(variance[others]) / all_squares)) if all_squares > 0 else 1.0
    correlation *= 1 - shrinkage
    np.fill_diagonal(correlation, 1.0)
    return ShrunkCovariance(correlation * np.outer(deviation, deviation), shrinkage)


def chi_square(deviations: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Chi-square d' C^-1 d of each row d of deviations, shape (..., number); C is positive definite."""
    lower = np.linalg.cholesky(covariance)
    rows = deviations.reshape(-1, len(covariance))
    return np.sum(np.linalg.solve(lower, rows.T) ** 2, axis=0).reshape(deviations.shape[:-1])
