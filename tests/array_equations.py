"""The full-order equations once more, for arrays: eqs (1) to (8) and (12) as selects; Runge-Kutta steps."""

import numpy as np
from readable_equations import A, B


def array_flows(u, P, T, plant):
    """Mass flows into and out of a chamber for arrays: eqs (1), (2) as selects."""
    c, g, R = plant.conditions, plant.gas.gamma, plant.gas.R
    port = np.where(u >= 0, c.P_s, c.P_atm)
    inward = port >= P
    P_u, P_d, T_u = np.where(inward, port, P), np.where(inward, P, port), np.where(inward, c.T_in, T)
    ratio = np.maximum(P_d / P_u, plant.gas.critical_ratio)
    throat = plant.valve.k_xu * np.abs(u) * P_u / np.sqrt(T_u)
    subsonic = np.sqrt(2 * g / ((g - 1) * R) * (ratio ** (2 / g) - ratio ** ((g + 1) / g)))
    sonic = P_d / P_u <= plant.gas.critical_ratio
    flow = throat * np.where(sonic, plant.gas.sonic_coefficient, subsonic)
    return np.where(inward, flow, 0.0), np.where(inward, 0.0, flow)


def array_command(reference, x, e):
    """Command before the limiter for arrays."""
    if e.drive.closed_loop:
        return e.drive.k_p * (reference - x)
    if not e.drive.each_stage:
        return reference  # it has the sign that the step began with
    forced = np.abs(x) >= e.drive.x_reverse
    return np.where(forced, -np.sign(x) * np.abs(reference), reference)


def array_sides(y, reference, e):
    """Per chamber (u, x, v, P, T) counted outward from it; y has shape (..., 6)."""
    u = np.clip(array_command(reference, y[..., 0], e), -e.plant.valve.u_max, e.plant.valve.u_max)
    for sign, P in ((1, 2), (-1, 4)):
        yield sign * u, sign * y[..., 0], sign * y[..., 1], y[..., P], y[..., P + 1]


def array_wall(x, P, T, e):
    """Wall heat into the air, W: eqs (7), (8), (12) and A_q(x)."""
    c, cylinder = e.plant.conditions, e.plant.cylinder
    ratio = (x + cylinder.stroke / 2 + cylinder.bore / 2) / (cylinder.stroke / 2 + cylinder.bore / 2)
    return e.plant.k_0 * ratio * np.sqrt(P * T / (c.P_0 * c.T_0)) * (c.T_amb - T)


def array_rates(y, reference, e):
    """Full-order rates for arrays of states of shape (..., 6)."""
    cylinder, c, R, g = e.plant.cylinder, e.plant.conditions, e.plant.gas.R, e.plant.gas.gamma
    dy = np.empty_like(y)
    force = cylinder.A_A * y[..., 2] - cylinder.A_B * y[..., 4]
    dy[..., 0], dy[..., 1] = y[..., 1], (force + cylinder.load - cylinder.k_f * y[..., 1]) / cylinder.M
    for side, (u, x, v, P, T) in enumerate(array_sides(y, reference, e)):
        area, V_d = ((cylinder.A_A, cylinder.V_d_A), (cylinder.A_B, cylinder.V_d_B))[side]
        V, dV_dt = V_d + area * (cylinder.stroke / 2 + x), area * v
        m_in, m_out = array_flows(u, P, T, e.plant)
        enthalpy = g * R / (g - 1) * (m_in * c.T_in - m_out * T)
        inner = enthalpy - P * dV_dt + array_wall(x, P, T, e)  # d(PV)/dt = (gamma - 1) of this
        dP_dt = ((g - 1) * inner - P * dV_dt) / V
        dy[..., 2 + 2 * side] = dP_dt
        dy[..., 3 + 2 * side] = T * (dP_dt / P + dV_dt / V - (m_in - m_out) * R * T / (P * V))
    return dy


def integrated(rate, z, steps, h):
    """States at every step of z' = rate(z, step, stage), shape (steps + 1, ...)."""
    states = [z]
    for k in range(steps):
        K = np.empty((6, len(z)))
        for i in range(6):
            K[i] = rate(states[-1] + h * A[i, :i] @ K[:i], k, i)
        states.append(states[-1] + h * B @ K)
    return np.array(states)
