"""Equilibrium pressure of a half-bridge of two leaking restrictions, Appendix 2."""

from collections.abc import Callable
from functools import lru_cache

from pneumo.physics.valve import Gas, mass_flow

TOLERANCE = 1e-9  # of P_0, over P_atm
PRECISION = 1e-14  # of P_0, relative; both stop the search


@lru_cache  # rows of a large table share supply and gas
def equilibrium_pressure(P_s: float, P_atm: float, gas: Gas, area_ratio: float = 1.0) -> float:
    """Pressure at which the leak from the supply equals the leak to the atmosphere.

    It is P_0, Pa, from absolute pressures, Pa. `area_ratio` is A_1 / A_2, the leak area to the supply over
    that to the atmosphere. With equal areas and the exact sonic coefficient, P_0 is 0.807458 P_s for air
    wherever the flow to the atmosphere is sonic (P_s >= 2.344 P_atm).

    Raises
    ------
    ValueError
        Unless ``P_s > P_atm > 0``.
    """
    if not 0 < P_atm < P_s:
        raise ValueError(f"P_s = {P_s:g} Pa: must exceed P_atm = {P_atm:g} Pa (both absolute)")

    def surplus(P: float) -> float:
        inflow = mass_flow(area_ratio, P_s, P, 1.0, gas)
        return inflow - mass_flow(1.0, P, P_atm, 1.0, gas)  # (17), for any regime of either throat

    return _root(surplus, P_atm, P_s, TOLERANCE * P_atm)


def _root(f: Callable[[float], float], low: float, high: float, tolerance: float) -> float:
    """Root of f, which changes its sign between low and high, by Brent's method.

    Each operation is that of scipy.optimize.brentq, so the root is the same to the bit. It always lies
    between `x` and `far`; `old` is the previous x.
    """
    old, x, far = low, high, low
    f_old, f_x = f(low), f(high)
    f_far, last, step = f_old, high - low, high - low
    while True:
        if (f_old > 0) != (f_x > 0):  # the root is between the last two points
            far, f_far = old, f_old
            last = step = x - old
        if abs(f_far) < abs(f_x):
            old, x, far = x, far, x
            f_old, f_x, f_far = f_x, f_far, f_x
        shortest = (tolerance + PRECISION * abs(x)) / 2
        half = (far - x) / 2
        if f_x == 0 or abs(half) < shortest:
            return x
        trial = 2 * half  # too long a step
        if abs(last) > shortest and abs(f_x) < abs(f_old):
            if old == far:  # secant
                trial = -f_x * (x - old) / (f_x - f_old)
            else:  # inverse quadratic interpolation
                d_old, d_far = (f_old - f_x) / (old - x), (f_far - f_x) / (far - x)
                trial = -f_x * (f_far * d_far - f_old * d_old) / (d_far * d_old * (f_far - f_old))
        short = 2 * abs(trial) < min(abs(last), 3 * abs(half) - shortest)
        last, step = (step, trial) if short else (half, half)
        old, f_old = x, f_x
        x += step if abs(step) > shortest else shortest if half > 0 else -shortest
        f_x = f(x)
