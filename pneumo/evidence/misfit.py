"""How far reproduced numbers are from printed ones, in units of what is expected: the noise model.

ln(reproduced / printed) has a standard deviation made of two parts: the rounding of the print, uniform over
one unit of the last digit, and a discrepancy that is stated beforehand and stands for all that the
reproduction has in another way than the authors had it.
"""

import numpy as np
from scipy.stats import chi2

THRESHOLD = float(chi2.ppf(0.95, 1))  # deviance at the ends of a 95 % interval, one parameter
THRESHOLD_2 = float(chi2.ppf(0.95, 2))  # and at the edge of a 95 % region of two


def noise(printed: np.ndarray, half_unit: np.ndarray, discrepancy: float) -> np.ndarray:
    """Standard deviation of ln(reproduced / printed).

    Parameters
    ----------
    printed : numpy.ndarray
        Printed numbers.
    half_unit : numpy.ndarray
        Half a unit in the last printed digit of each, `pneumo.verdict.published.half_unit`.
    discrepancy : float
        Relative difference expected where everything is right.
    """
    return np.hypot(half_unit / np.sqrt(3) / np.abs(printed), discrepancy)


def rms(log_ratios: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(log_ratios))))


def scale(lowest: float, count: int, parameters: int) -> float:
    """What deviances are divided by: the lowest one per degree of freedom, if that exceeds one.

    Where the best fit misses by more than the noise model expects, intervals widen accordingly.
    """
    return max(1.0, lowest / max(1, count - parameters))


def interval(values: np.ndarray, deviance: np.ndarray, threshold: float = THRESHOLD) -> tuple[float, float]:
    """Ends of the interval in which a profile lies below a threshold.

    Parameters
    ----------
    values : numpy.ndarray
        Ascending values of the parameter.
    deviance : numpy.ndarray
        Profile over them; NaN where it was not followed.
    threshold : float

    Returns
    -------
    low, high : float
        Outermost crossings, interpolated linearly; infinite where the profile ends below the threshold.
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
