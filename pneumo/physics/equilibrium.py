"""Equilibrium pressure of a half-bridge of two leaking restrictions, Appendix 2."""

from pneumo.physics.valve import Gas, mass_flow


def equilibrium_pressure(P_s: float, P_atm: float, gas: Gas, area_ratio: float = 1.0) -> float:
    """Pressure at which the leak from the supply equals the leak to the atmosphere.

    Parameters
    ----------
    P_s, P_atm : float
        Absolute supply and atmospheric pressure, Pa; ``P_s > P_atm > 0``.
    gas : Gas
    area_ratio : float
        A_1 / A_2, leak area towards the supply over leak area towards the atmosphere.

    Returns
    -------
    float
        P_0, Pa. With equal areas and the exact sonic coefficient it is 0.807458 P_s for air
        wherever the exhaust side is sonic (P_s >= 2.344 P_atm).

    Raises
    ------
    ValueError
        If P_s does not exceed P_atm.
    """
    from scipy.optimize import root_scalar  # here, since few runs need it and it takes half a second

    if not 0 < P_atm < P_s:
        raise ValueError(f"P_s = {P_s:g} Pa: must exceed P_atm = {P_atm:g} Pa (both absolute)")

    def surplus(P: float) -> float:
        inflow = mass_flow(area_ratio, P_s, P, 1.0, gas)
        return inflow - mass_flow(1.0, P, P_atm, 1.0, gas)  # (17), for any regime of either throat

    bracket = (P_atm, P_s)
    return float(root_scalar(surplus, bracket=bracket, method="brentq", xtol=1e-9 * P_atm, rtol=1e-14).root)
