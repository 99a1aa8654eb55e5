# pyright: basic
"""Polynomials of the core: exponential and logarithm, written into maths.h, and a gas's subsonic flow."""

from collections.abc import Callable
from functools import cache
from math import factorial, log, sqrt
from typing import Any

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from pneumo.physics.valve import Gas


def coefficients(function: Callable[[Any], Any], low: float, high: float, degree: int) -> tuple[float, ...]:
    """Coefficients, lowest power first, of the polynomial that equals a function at the Chebyshev nodes."""
    fit = Chebyshev.interpolate(function, degree, domain=[low, high])
    return tuple(float(c) for c in fit.convert(kind=Polynomial).coef)


# exp(t) for |t| <= EXP_REACH, from its Taylor series
EXP_REACH = 0.6
EXP = (1.0, *coefficients(Polynomial([1 / factorial(k + 1) for k in range(20)]), -EXP_REACH, EXP_REACH, 10))
# ln(m) / z with z = (m - 1)/(m + 1), in powers of z^2, for m between sqrt(1/2) and sqrt(2)
LOG = (2.0, *coefficients(Polynomial([2 / (2 * k + 3) for k in range(20)]), 0.0, (3 - sqrt(8)) ** 2, 6))
# Relative error granted to `flow_polynomial`; it has 2e-15 for any gamma from 1.05 to 5/3.
FLOW_TOLERANCE = 1e-13


@cache
def flow_polynomial(gas: Gas) -> tuple[tuple[float, ...], float]:
    """Polynomial from which the subsonic mass flow of a gas follows, by eq (1) or the ellipse of ISO 6358.

    Mass flow is ``A_t P_u / sqrt(T_u) sqrt(s) polynomial(s)`` with s = ln(P_u / P_d).

    Returns
    -------
    coefficients : tuple of float
        Lowest power first.
    error : float
        Largest relative error of the polynomial at 999 pressure ratios from critical to nearly 1.
    """
    g, b, s_sonic = gas.gamma, gas.critical_ratio, -log(gas.critical_ratio)

    def function(s: np.ndarray) -> np.ndarray:
        if gas.elliptic:
            below = -np.expm1(-s) / (1 - b)
            return gas.sonic_coefficient * np.sqrt(below * (2 - below) / s)
        subsonic = -np.exp(-2 * s / g) * np.expm1(-(g - 1) * s / g)
        return np.sqrt(2 * g / ((g - 1) * gas.R) * subsonic / s)  # (1)

    s = np.linspace(0.0, s_sonic, 1000)[1:]
    for degree in (9, 13, 17):  # eq (1) does with the first; the ellipse of a small critical ratio does not
        psi = coefficients(function, 0.0, s_sonic, degree)
        error = float(np.max(np.abs(Polynomial(psi)(s) / function(s) - 1)))
        if error <= FLOW_TOLERANCE:
            break
    return psi, error
