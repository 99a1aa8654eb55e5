"""Upper tail of the chi-square distribution, in the standard library."""

import math

MOST_TERMS = 10_000
TINY = 1e-300


def exceeded_probability(chi_square: float, degrees_of_freedom: float) -> float:
    """Probability that a larger chi-square arises by chance; NaN without degrees of freedom.

    The regularised upper incomplete gamma function Q(a, x) with a half the degrees of freedom and x half the
    chi-square: by its series where x < a + 1, else by its continued fraction (Lentz's method).

    Examples
    --------
    >>> round(exceeded_probability(3.841459, 1), 6)
    0.05
    """
    a = degrees_of_freedom / 2
    x = chi_square / 2
    if math.isnan(x) or a <= 0:
        return math.nan
    if x <= 0:
        return 1.0
    scale = math.exp(a * math.log(x) - x - math.lgamma(a))
    return 1 - scale * _series(a, x) if x < a + 1 else scale * _fraction(a, x)


def _series(a: float, x: float) -> float:
    term = 1 / a
    total = term
    for n in range(1, MOST_TERMS):
        term *= x / (a + n)
        total += term
        if term < 1e-17 * total:
            break
    return total


def _fraction(a: float, x: float) -> float:
    b = x + 1 - a
    c = 1 / TINY
    d = 1 / b
    value = d
    for n in range(1, MOST_TERMS):
        step = -n * (n - a)
        b += 2
        d = 1 / (step * d + b or TINY)
        c = b + step / c or TINY
        value *= c * d
        if abs(c * d - 1) < 1e-16:
            break
    return value
