"""Sonic conductance of a valve whose catalogue gives a nominal flow."""

from pneumo.physics.valve import choked_flow, exact_gas, mass_flow

UPSTREAM, DOWNSTREAM = 7.0, 6.0  # bar absolute: from 6 to 5 bar on the gauge, as in European catalogues
SECONDS = 60.0  # in a minute


def conductance_of_nominal_flow(Q_n: float, b: float) -> float:
    """Sonic conductance C, dm^3/(s bar), of a nominal flow Q_n, l/min, and a critical ratio b.

    By ISO 6358 the volume flow is C P_u sqrt(1 - ((P_d/P_u - b)/(1 - b))^2), in litres of its reference
    atmosphere (20 degC, 1 bar).
    """
    gas = exact_gas(287.0, 1.4)._replace(critical_ratio=b, elliptic=True)
    at = 1.0, UPSTREAM, DOWNSTREAM, 293.15  # area and temperature cancel
    fraction = mass_flow(*at, gas) / choked_flow(1.0, UPSTREAM, 293.15, gas)
    return Q_n / (SECONDS * UPSTREAM * fraction)
