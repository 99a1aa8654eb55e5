"""Noise model of ln(reproduced / printed), and intervals from a profile of the deviance.

The noise has two parts: rounding of the print, uniform over one unit of the last digit, and a discrepancy,
set beforehand, for other differences between the authors' study and ours.
"""

import numpy as np
from scipy.stats import chi2

THRESHOLD = float(chi2.ppf(0.95, 1))  # deviance at the ends of a 95 % interval, one parameter
REGION_THRESHOLD = float(chi2.ppf(0.95, 2))  # and at the edge of a 95 % region of two


def log_noise(printed: np.ndarray, half_unit: np.ndarray, discrepancy: float) -> np.ndarray:
    """Standard deviation of ln(reproduced / printed).

    `half_unit` is half a unit in the last printed digit, `pneumo.verdict.published.half_unit`; `discrepancy`
    is the relative difference expected where everything is right.
    """
    return np.hypot(half_unit / np.sqrt(3) / np.abs(printed), discrepancy)


def widening(lowest: float, count: int, parameters: int) -> float:
    """Factor by which deviances are divided: the lowest deviance over the degrees of freedom, at least 1.

    Intervals widen where the best fit misses by more than the noise model expects.
    """
    return max(1.0, lowest / max(1, count - parameters))


def deviance_interval(
    values: np.ndarray, deviance: np.ndarray, threshold: float = THRESHOLD
) -> tuple[float, float]:
    """Ends of the interval in which a profile of the deviance lies below a threshold.

    An end is the outermost crossing, interpolated linearly, or infinite where the profile ends below the
    threshold. `values` of the parameter ascend; `deviance` is NaN where the profile was not computed.
    """
    known = np.isfinite(deviance)
    x, y = np.asarray(values)[known], np.asarray(deviance)[known]
    below = np.nonzero(y <= threshold)[0]
    first, last = below[0], below[-1]

    def crossing(inside: int, outside: int) -> float:
        part = (threshold - y[inside]) / (y[outside] - y[inside])
        return float(x[inside] + part * (x[outside] - x[inside]))

    low = crossing(first, first - 1) if first > 0 else -np.inf
    high = crossing(last, last + 1) if last + 1 < len(x) else np.inf
    return low, high
