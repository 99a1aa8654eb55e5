"""Air in a chamber: energy and mass balance, eqs (4), (5), (7) and (8), misprints corrected.

The equations use only + - * / **, so they take floats, NumPy arrays, quantities with units and
symbols alike. Wall heat enters with the sign that opposes the temperature difference.
"""


def wall_heat(T: float, conductance: float, T_amb: float) -> float:
    """Heat flow from the wall into the air, W: eqs (7), (11), (13), with the sign of the text."""
    return conductance * (T_amb - T)


def wall_conductance(k_0: float, area_ratio: float, PT_ratio: float, e_A: float, e_PT: float) -> float:
    """Thermal conductance of the wall, W/K.

    `k_0` is its value at equilibrium, lambda_0 A_q(x_0) of eq (12), W/K; `area_ratio` is A_q(x) / A_q(x_0),
    `PT_ratio` is P T / (P_0 T_0). Exponents (e_A, e_PT) are (0, 0) in eq (13), (1, 0) in eq (11) and
    (1, 1/2) in eqs (7) and (8).
    """
    return k_0 * area_ratio**e_A * PT_ratio**e_PT  # (8)


def dP_dt(
    P: float,
    T: float,
    V: float,
    dV_dt: float,
    m_in: float,
    m_out: float,
    T_inlet: float,
    heat: float,
    n_V: float,
    n_in: float,
    n_out: float,
    R: float,
    gamma: float,
) -> float:
    """Rate of pressure of a chamber, Pa/s: eq (4) where n_V, n_in and n_out are gamma, else a reduced model.

    P in Pa, T in K, V in m^3, dV_dt in m^3/s, mass flows m_in and m_out in kg/s. T_inlet, K, is the
    temperature of the inflow: T_in, or T in models without mixing. `heat`, W, flows from the wall into the
    air. The indices n_V, n_in and n_out multiply the terms of volume, inflow and outflow.
    """
    return (
        -n_V * P * dV_dt + R * (n_in * m_in * T_inlet - n_out * m_out * T) + (gamma - 1) * heat
    ) / V  # (4)


def dT_dt(
    P: float,
    T: float,
    V: float,
    dV_dt: float,
    m_in: float,
    m_out: float,
    T_in: float,
    heat: float,
    R: float,
    gamma: float,
) -> float:
    """Rate of temperature, K/s: eq (5), with the factor T that its last term lacks in print.

    Parameters are those of `dP_dt`; inflow enters at T_in.
    """
    return (
        T / V * dV_dt * (1 - gamma)
        - m_out * R * T**2 / (V * P) * (gamma - 1)
        + m_in * R * T / (V * P) * (gamma * T_in - T)
        + (gamma - 1) * T / (P * V) * heat
    )  # (5)
