"""Equilibrium pressure of a half-bridge of two leaking restrictions, Appendix 2."""

from functools import lru_cache

from pneumo.physics.valve import Gas, mass_flow


@lru_cache  # rows of a large table share supply and gas
def equilibrium_pressure(P_s: float, P_atm: float, gas: Gas) -> float:
    """Pressure at which the leak from the supply equals the leak to the atmosphere.

    It is P_0, Pa, from absolute pressures, Pa, with equal leak areas. With the exact sonic coefficient it is
    0.807458 P_s for air wherever the flow to the atmosphere is sonic (P_s >= 2.344 P_atm).

    Raises
    ------
    ValueError
        Unless ``P_s > P_atm > 0``.
    """
    if not 0 < P_atm < P_s:
        raise ValueError(f"P_s = {P_s:g} Pa: must exceed P_atm = {P_atm:g} Pa (both absolute)")

    def surplus(P: float) -> float:
        inflow = mass_flow(1.0, P_s, P, 1.0, gas)
        return inflow - mass_flow(1.0, P, P_atm, 1.0, gas)  # (17), for any regime of either throat

    low, high = P_atm, P_s
    while low < (middle := (low + high) / 2) < high:  # by bisection, to the last bit
        low, high = (middle, high) if surplus(middle) > 0 else (low, middle)
    return low
