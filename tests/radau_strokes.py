"""A stroke into rest at open ports by SciPy's Radau, on equations of our own.

The independent states are mass and internal energy of each chamber; the piston's release and its stop are
located by events.
"""

import numpy as np
from scipy.integrate import solve_ivp

H = 1e-3  # s, between the states that are returned
SMOOTH = 1e-8  # 1 - P_d/P_u, below which the flow is linear, as Radau's Newton iteration needs it: 7 mPa


def radau_stroke(plant, sign, opened, shut=0.0, vented=True):
    """States (x, v, P_A, T_A, P_B, T_B) after every 1 ms: the valve is fully open, then shut.

    The piston starts at the stop, vented, or in mid-stroke with both chambers at P_0 and T_0, where it must
    not stick.
    """
    gas, c, cyl, R, g = plant.gas, plant.conditions, plant.cylinder, plant.gas.R, plant.gas.gamma
    A_t, sides = plant.valve.k_xu * plant.valve.u_max, ((cyl.A_A, cyl.V_d_A, 1), (cyl.A_B, cyl.V_d_B, -1))

    def flow(P_u, P_d, T_u):
        drop = 1 - P_d / P_u
        if drop < SMOOTH:
            return flow(P_u, P_u * (1 - 1.001 * SMOOTH), T_u) * drop / (1.001 * SMOOTH)
        above = max((P_d / P_u - gas.critical_ratio) / (1 - gas.critical_ratio), 0.0)
        return A_t * gas.sonic_coefficient * P_u / T_u**0.5 * max(1 - above**2, 0.0) ** 0.5

    def wetted(x):
        return np.pi / 2 * cyl.bore**2 + np.pi * cyl.bore * (x + cyl.stroke / 2)

    def gases(y):
        V = [V_d + A * (cyl.stroke / 2 + way * y[0]) for A, V_d, way in sides]
        P = [(g - 1) * y[3 + 2 * i] / V[i] for i in (0, 1)]
        return V, P, [P[i] * V[i] / (R * y[2 + 2 * i]) for i in (0, 1)]

    def force(P):
        return P[0] * cyl.A_A - P[1] * cyl.A_B + cyl.load

    def rates(t, y, held, is_open):
        _, P, T = gases(y)
        v = 0.0 if held else y[1]
        result = [v, 0.0 if held else (force(P) - cyl.k_f * v - cyl.coulomb * sign) / cyl.M]
        for i, (A, _, way) in enumerate(sides):
            port = c.P_s if way * sign > 0 else c.P_atm
            fills = port >= P[i]
            m = flow(port, P[i], c.T_in) if fills else -flow(P[i], port, T[i])
            m *= is_open
            k = plant.k_0 * wetted(way * y[0]) / wetted(0.0) * max(P[i] * T[i] / (c.P_0 * c.T_0), 0) ** 0.5
            enthalpy = g * R / (g - 1) * m * (c.T_in if fills else T[i])
            result += [m, enthalpy - P[i] * A * way * v + k * (c.T_amb - T[i])]
        return result

    def released(t, y, held, is_open):
        return sign * force(gases(y)[1]) - cyl.coulomb

    def met(t, y, held, is_open):
        return cyl.x_max - sign * y[0]

    released.terminal, released.direction, met.terminal, met.direction = True, 1, True, -1
    x, P, T = (-sign * cyl.x_max, c.P_atm, c.T_amb) if vented else (0.0, c.P_0, c.T_0)
    y, t, at = [x, 0.0], 0.0, np.arange(1, round((opened + shut) / H) + 1) * H
    for A, V_d, way in sides:
        V = V_d + A * (cyl.stroke / 2 + way * x)
        y += [P * V / (R * T), P * V / (g - 1)]
    limits = {"rtol": 1e-9, "atol": [1e-9, 1e-9, 1e-13, 1e-5, 1e-13, 1e-5], "max_step": 0.02}
    options, rows = {"method": "Radau", "dense_output": True, **limits}, list[np.ndarray]()
    phases = [
        (True, released, opened),
        (False, met, opened),
        (True, None, opened),
        (True, None, opened + shut),
    ]
    for held, event, end in phases[not vented : 3 + (shut > 0)]:
        part = solve_ivp(rates, (t, end), y, events=event, args=(held, end == opened), **options)
        rows += [part.sol(min(time, end)) for time in at if t + 1e-9 < time <= part.t[-1] + 1e-9]
        t, y = part.t[-1], part.y[:, -1].copy()
        if event is met and part.status == 1:
            y[:2] = sign * cyl.x_max, 0.0
        if part.t[-1] == at[-1]:
            break
    states = []
    for y in rows:
        _, P, T = gases(y)
        states.append([y[0], y[1], P[0], T[0], P[1], T[1]])
    return np.array(states)
