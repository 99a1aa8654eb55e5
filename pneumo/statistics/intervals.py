"""Student's confidence intervals."""

from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit  # `scipy.stats` takes half a second to import

CONFIDENCE = 0.95


class Interval(NamedTuple):
    """An estimate with the ends of its 95 % confidence interval; an end that is not determined is NaN."""

    value: float
    low: float
    high: float

    @property
    def known(self) -> bool:
        """Whether both ends of the interval are determined."""
        return bool(np.isfinite(self.low) and np.isfinite(self.high))

    def ends_text(self, form: str) -> str:
        """Return the ends as text; `form` is the format of a number, such as ".4g".

        Examples
        --------
        >>> Interval(2.0, 1.0, 3.0).ends_text("g"), Interval(2.0, np.nan, 3.0).ends_text("g")
        ('1 to 3', 'at most 3')
        """
        low, high = f"{self.low:{form}}", f"{self.high:{form}}"
        if np.isfinite(self.low):
            return f"{low} to {high}" if np.isfinite(self.high) else f"at least {low}"
        return f"at most {high}" if np.isfinite(self.high) else "not determined"

    def scaled(self, factor: float) -> "Interval":
        """Return estimate and ends times a factor, such as that of a change of unit."""
        return Interval(*(factor * value for value in self))


def student_interval(samples: np.ndarray) -> np.ndarray:
    """Mean of independent samples along the last axis, and the ends of its 95 % interval; shape (3, ...).

    The ends are NaN for a single sample.
    """
    mean, count = samples.mean(-1), samples.shape[-1]
    if count < 2:
        return np.array([mean, np.full_like(mean, np.nan), np.full_like(mean, np.nan)])
    quantile = float(stdtrit(count - 1, (1 + CONFIDENCE) / 2))
    half = quantile * samples.std(-1, ddof=1) / count**0.5
    return np.array([mean, mean - half, mean + half])
