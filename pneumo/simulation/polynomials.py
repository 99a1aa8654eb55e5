"""Polynomial of a gas's subsonic flow, with which the core replays many lanes side by side."""

from decimal import Decimal, localcontext
from functools import cache
from math import cos, pi

import numpy as np
from numpy.polynomial import Polynomial

from pneumo.physics.valve import Gas

EXP_REACH = 0.6  # of the core's exponential without branches, in maths.h
# Relative error granted to `flow_polynomial`; it has 2e-15 for any gamma from 1.05 to 5/3.
FLOW_TOLERANCE = 1e-13
DIGITS = 32  # of decimal arithmetic, which rounds alike on every processor


def _flow_over_root(s: Decimal, gas: Gas) -> Decimal:
    """Subsonic flow at s = ln(P_u / P_d), over ``A_t P_u / sqrt(T_u) sqrt(s)``."""
    if gas.elliptic:
        below = (1 - (-s).exp()) / (1 - Decimal(gas.critical_ratio))
        return Decimal(gas.sonic_coefficient) * (below * (2 - below) / s).sqrt()  # ISO 6358
    R, g = Decimal(gas.R), Decimal(gas.gamma)
    subsonic = (-2 * s / g).exp() * (1 - (-(g - 1) * s / g).exp())
    return (2 * g / ((g - 1) * R) * subsonic / s).sqrt()  # (1)


def _interpolated(gas: Gas, s_sonic: Decimal, degree: int) -> tuple[float, ...]:
    """Coefficients, lowest power first, of the polynomial through Chebyshev's nodes."""
    # Rounded, so that another processor's cosine gives the same.
    cosines = (f"{cos(pi * (2 * k + 1) / (2 * degree + 2)):.9f}" for k in range(degree + 1))
    nodes = [s_sonic * (1 + Decimal(text)) / 2 for text in cosines]
    newton = [_flow_over_root(s, gas) for s in nodes]
    for i in range(1, len(nodes)):  # divided differences
        for k in range(len(nodes) - 1, i - 1, -1):
            newton[k] = (newton[k] - newton[k - 1]) / (nodes[k] - nodes[k - i])
    powers = [newton[-1]]
    for value, node in zip(newton[-2::-1], nodes[-2::-1], strict=True):  # times (s - node), plus value
        powers = [a - node * b for a, b in zip([Decimal(0), *powers], [*powers, Decimal(0)], strict=True)]
        powers[0] += value
    return tuple(map(float, powers))


@cache
def flow_polynomial(gas: Gas) -> tuple[tuple[float, ...], float]:
    """Polynomial from which the subsonic mass flow of a gas follows, by eq (1) or the ellipse of ISO 6358.

    Mass flow is ``A_t P_u / sqrt(T_u) sqrt(s) polynomial(s)`` with s = ln(P_u / P_d).

    Returns
    -------
    coefficients : tuple of float
        Lowest power first; the same on every processor.
    error : float
        Largest relative error of the polynomial at 30 pressure ratios from critical to nearly 1.
    """
    with localcontext() as context:
        context.prec = DIGITS
        s_sonic = -Decimal(gas.critical_ratio).ln()
        points = [s_sonic * k / 30 for k in range(1, 31)]
        exact, s = np.array([float(_flow_over_root(p, gas)) for p in points]), np.array(points, dtype=float)
        for degree in (9, 13, 17):  # eq (1) does with the first; the ellipse of a small critical ratio not
            psi = _interpolated(gas, s_sonic, degree)
            error = float(np.max(np.abs(Polynomial(psi)(s) / exact - 1)))
            if error <= FLOW_TOLERANCE:
                break
    return psi, error
