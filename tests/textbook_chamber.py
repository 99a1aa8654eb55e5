"""A chamber in twenty lines, as a user writes one: the text that the mutants of the checks change."""

from math import pi, sqrt


def mass_flow(area, P_u, P_d, T_u, gas):
    g, R = gas.gamma, gas.R
    critical = (2 / (g + 1)) ** (g / (g - 1))
    ratio = max(P_d / P_u, critical)
    return area * P_u * sqrt(2 * g / ((g - 1) * R * T_u) * max(ratio ** (2 / g) - ratio ** ((g + 1) / g), 0))


def rates(P, T, x, v, u, side, plant):
    gas, valve, c, cylinder, k_0, *_ = plant
    g, R = gas.gamma, gas.R
    if side == "B":
        u, x, v = -u, -x, -v
    area = cylinder.A_A if side == "A" else cylinder.A_B
    dead = cylinder.V_d_A if side == "A" else cylinder.V_d_B
    V = dead + area * (cylinder.stroke / 2 + x)
    dV_dt = area * v
    m_in = m_out = 0.0
    for port, opening in ((c.P_s, max(u, 0)), (c.P_atm, max(-u, 0))):
        throat = valve.k_xu * opening + valve.leak
        if port > P:
            m_in += mass_flow(throat, port, P, c.T_in, gas)
        else:
            m_out += mass_flow(throat, P, port, T, gas)
    A_q = 2 * pi / 4 * cylinder.bore**2 + pi * cylinder.bore * (cylinder.stroke / 2 + x)
    A_q0 = 2 * pi / 4 * cylinder.bore**2 + pi * cylinder.bore * cylinder.stroke / 2
    Q = k_0 * A_q / A_q0 * sqrt(P * T / (c.P_0 * c.T_0)) * (c.T_amb - T)
    H = g * R / (g - 1) * (m_in * c.T_in - m_out * T)
    dP_dt = (g - 1) / V * (H + Q - P * dV_dt) - P * dV_dt / V
    dm_dt = m_in - m_out
    dT_dt = T * (dP_dt / P + dV_dt / V - dm_dt * R * T / (P * V))
    return dP_dt, dT_dt


def isothermal(P, x, v, u, plant):
    """Rate of chamber A's pressure at constant temperature."""
    gas, valve, c, cylinder, *_ = plant
    V = cylinder.V_d_A + cylinder.A_A * (cylinder.stroke / 2 + x)
    port = c.P_s if u > 0 else c.P_atm
    throat = valve.k_xu * abs(u)
    inward = port > P
    m = mass_flow(throat, max(P, port), min(P, port), c.T_in if inward else c.T_0, gas)
    return (gas.R * c.T_0 * (m if inward else -m) - P * cylinder.A_A * v) / V
