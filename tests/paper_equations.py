"""A second, literal reading of the paper's equations, to check the package's one table of models against.

Written model by model from sections 2 and 3 of DOI 10.1243/09596518JSCE203 and sharing nothing with the
package: plain floats, ``math``, the terms in the paper's order. Where the print is wrong the line is mended
and says so. Repetition is wanted here.
"""

import math


def mass_flow(A_t, P_u, P_d, T_u, gamma, R):
    """Eq. (1), with the paper's rounded numbers for air in the sonic branch."""
    if P_d / P_u > 0.5283:
        bracket = (P_d / P_u) ** (2 / gamma) - (P_d / P_u) ** ((gamma + 1) / gamma)
        return A_t * P_u * math.sqrt(2 * gamma / ((gamma - 1) * R * T_u) * bracket)
    return 0.0404 * P_u * A_t / math.sqrt(T_u)


def heat_transfer_coefficient(P, T, P_0, T_0, lambda_0):
    """Eq. (8)."""
    return lambda_0 * math.sqrt(P * T / (P_0 * T_0))


def heat_transfer(P, T, T_amb, P_0, T_0, lambda_0, A_q):
    """Eq. (7): heat per second from the wall to the air."""
    return heat_transfer_coefficient(P, T, P_0, T_0, lambda_0) * A_q * (T_amb - T)


def dP_dt_full(P, T, V, dV_dt, m_in, m_out, T_in, gamma, R, Q):
    """Eq. (4)."""
    return (
        -gamma * P / V * dV_dt
        + gamma * R / V * m_in * T_in
        - gamma * R / V * m_out * T
        + (gamma - 1) / V * Q  # mended: printed with a minus, by which eq. (7) would heat a hot gas
    )


def dT_dt_full(P, T, V, dV_dt, m_in, m_out, T_in, gamma, R, Q):
    """Eq. (5)."""
    return (
        T / V * dV_dt * (1 - gamma)
        - m_out * R * T**2 / (V * P) * (gamma - 1)
        + m_in * R * T / (V * P) * (gamma * T_in - T)
        + (gamma - 1) * T / (P * V) * Q  # mended: printed with a minus, as in (4), and without T, so in 1/s
    )


def full_order(P, T, V, dV_dt, m_in, m_out, T_amb, T_in, P_0, T_0, gamma, R, k_0, A_q, A_q0):
    """Eqs (4), (5), (7), (8) and, for lambda_0, (12): the datum model."""
    lambda_0 = k_0 / A_q0
    Q = heat_transfer(P, T, T_amb, P_0, T_0, lambda_0, A_q)
    return (
        dP_dt_full(P, T, V, dV_dt, m_in, m_out, T_in, gamma, R, Q),
        dT_dt_full(P, T, V, dV_dt, m_in, m_out, T_in, gamma, R, Q),
    )


def M1(P, V, dV_dt, m_in, m_out, T_amb, T_in, P_0, T_0, n, gamma, R, k_0, A_q, A_q0):
    T = T_0
    dP_dt = -P / V * dV_dt + R / V * T * (m_in - m_out)
    return T, dP_dt


def M2(P, V, dV_dt, m_in, m_out, T_amb, T_in, P_0, T_0, n, gamma, R, k_0, A_q, A_q0):
    T = T_0
    dP_dt = -n * P / V * dV_dt + n * R / V * T * (m_in - m_out)
    return T, dP_dt


def M3(P, V, dV_dt, m_in, m_out, T_amb, T_in, P_0, T_0, n, gamma, R, k_0, A_q, A_q0):
    T = T_0
    dP_dt = -gamma * P / V * dV_dt + gamma * R / V * T * (m_in - m_out)
    return T, dP_dt


def M4(P, V, dV_dt, m_in, m_out, T_amb, T_in, P_0, T_0, n, gamma, R, k_0, A_q, A_q0):
    T = T_0
    dP_dt = -1.2 * P / V * dV_dt + 1.4 * R / V * T * m_in - R / V * T * m_out
    return T, dP_dt


def M5(P, V, dV_dt, m_in, m_out, T_amb, T_in, P_0, T_0, n, gamma, R, k_0, A_q, A_q0):
    T = T_0 * (P / P_0) ** ((n - 1) / n)
    dP_dt = -n * P / V * dV_dt + n * R / V * T * (m_in - m_out)
    return T, dP_dt


def M6(P, V, dV_dt, m_in, m_out, T_amb, T_in, P_0, T_0, n, gamma, R, k_0, A_q, A_q0):
    T = T_0 * (P / P_0) ** ((n - 1) / n)
    dP_dt = -n * P / V * dV_dt + n * R / V * m_in * T_in - n * R / V * m_out * T
    return T, dP_dt


def M7(P, V, dV_dt, m_in, m_out, T_amb, T_in, P_0, T_0, n, gamma, R, k_0, A_q, A_q0):
    T = T_0 * (P / P_0) ** ((n - 1) / n)
    dP_dt = (
        -gamma * P / V * dV_dt
        + gamma * R / V * T * (m_in - m_out)
        + (gamma - 1) / V * k_0 * (T_amb - T)  # mended: printed T - T_amb
    )
    return T, dP_dt


def M8(P, V, dV_dt, m_in, m_out, T_amb, T_in, P_0, T_0, n, gamma, R, k_0, A_q, A_q0):
    T = T_0 * (P / P_0) ** ((n - 1) / n)
    dP_dt = (
        -gamma * P / V * dV_dt
        + gamma * R / V * m_in * T_in
        - gamma * R / V * m_out * T
        + (gamma - 1) / V * k_0 * (T_amb - T)  # mended: printed T - T_amb
    )
    return T, dP_dt


def M9(P, V, dV_dt, m_in, m_out, T_amb, T_in, P_0, T_0, n, gamma, R, k_0, A_q, A_q0):
    lambda_0 = k_0 / A_q0
    T = T_0 * (P / P_0) ** ((n - 1) / n)
    dP_dt = (
        -gamma * P / V * dV_dt
        + gamma * R / V * m_in * T_in
        - gamma * R / V * m_out * T
        + (gamma - 1) / V * lambda_0 * A_q * (T_amb - T)  # mended: printed T - T_amb
    )
    return T, dP_dt


def M10(P, V, dV_dt, m_in, m_out, T_amb, T_in, P_0, T_0, n, gamma, R, k_0, A_q, A_q0):
    lambda_0 = k_0 / A_q0
    T = T_0 * (P / P_0) ** ((n - 1) / n)
    dP_dt = (
        -gamma * P / V * dV_dt
        + gamma * R / V * m_in * T_in
        - gamma * R / V * m_out * T
        # mended: printed T - T_amb
        + (gamma - 1) / V * lambda_0 * A_q * math.sqrt(P * T / (P_0 * T_0)) * (T_amb - T)
    )
    return T, dP_dt


MODELS = {model.__name__: model for model in (M1, M2, M3, M4, M5, M6, M7, M8, M9, M10)}
