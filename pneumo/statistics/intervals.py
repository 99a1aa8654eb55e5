"""Student's intervals of independent samples and of ratios of paired samples."""

from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit  # `scipy.stats` takes half a second to import

CONFIDENCE = 0.95


class Interval(NamedTuple):
    """An estimate with the ends of its interval; an end that nothing limits is NaN."""

    value: float
    low: float
    high: float

    @property
    def known(self) -> bool:
        """Whether the interval has two ends."""
        return bool(np.isfinite(self.low) and np.isfinite(self.high))

    def scaled(self, factor: float) -> "Interval":
        """Return the same in another unit."""
        return Interval(*(factor * value for value in self))


def student_interval(samples: np.ndarray) -> Interval:
    """Mean of independent samples with its interval by Student's t."""
    mean, count = float(np.mean(samples)), len(samples)
    if count < 2:
        return Interval(mean, np.nan, np.nan)
    half = float(stdtrit(count - 1, (1 + CONFIDENCE) / 2) * np.std(samples, ddof=1) / count**0.5)
    return Interval(mean, mean - half, mean + half)


def paired_ratio(upper: np.ndarray, lower: np.ndarray) -> Interval:
    """Geometric mean of the ratio of paired samples with its interval."""
    return Interval(*(float(np.exp(value)) for value in student_interval(np.log(upper / lower))))
