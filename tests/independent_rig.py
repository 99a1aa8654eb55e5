"""A chamber behind an on/off valve and a hose, simulated without pneumo.

States are the mass and the internal energy of hose and chamber, by scipy's implicit solver; restrictions
follow ISO 6358 with the tanh of the pressure difference near equal pressures; the piston moves as told.
"""

import numpy as np
from scipy.integrate import solve_ivp

R, C_V, C_P = 287.05, 717.6, 1004.65  # J/(kg K)
RHO_0, T_0 = 1.185, 293.15  # the reference of a sonic conductance
T_ROOM, P_ROOM = 293.15, 101325.0
TRUTH = {
    "hose_volume": 6e-6,  # m^3
    "hose_C": 0.9e-8,  # m^3/(s Pa)
    "dead_volume": 12e-6,
    "k_0": 0.5,  # W/K
    "valve_C_in": 1.2e-8,
    "valve_C_out": 1.0e-8,
    "P_s": 6e5,
}
BORE, OPENS, CLOSES = 32e-3, 3e-3, 4e-3  # m, s, s
PERIOD, OPEN = 0.5, 0.12  # s


def flow(C, b, P_1, P_2, T_1):
    """Mass flow from 1 to 2, kg/s, P_1 >= P_2."""
    ratio = P_2 / P_1
    choked = C * P_1 * RHO_0 * np.sqrt(T_0 / T_1)
    if ratio <= b:
        return choked
    return choked * np.sqrt(max(1 - ((ratio - b) / (1 - b)) ** 2, 0.0)) * np.tanh((P_1 - P_2) / 200.0)


def position(t):
    """Distance of the piston from its smallest volume, m: out while the valve is open, back after."""
    phase = t % PERIOD
    rise = 0.5 - 0.5 * np.cos(np.pi * np.clip((phase - 0.03) / 0.12, 0, 1))
    fall = 0.5 - 0.5 * np.cos(np.pi * np.clip((phase - 0.2) / 0.25, 0, 1))
    return 0.08 * (rise - fall)


OF_B = {"hose_volume": 6e-6, "hose_C": 0.9e-8, "dead_volume": 20e-6, "k_0": 0.5, "rod": 12e-3}
TRAVEL = 0.08  # m, at which B has its dead volume


def simulated(pulses=4, hose=True, b=0.5283, noise=0.3e3, seed=0, other=False):
    """Time, position, command and pressure at the valve, of a record at 1 kHz.

    With `other` the second chamber of the same 5/2 valve, as a record of its own: the supply fills it while
    the valve is off, and it shrinks as the first grows.
    """
    v, area = TRUTH, np.pi / 4 * BORE**2
    if other:
        v, area = TRUTH | OF_B, np.pi / 4 * (BORE**2 - OF_B["rod"] ** 2)

    def distance(t):
        return TRAVEL - position(t) if other else position(t)

    def opened(t):
        phase = t % PERIOD
        on = np.clip((phase - 0.02) / OPENS, 0, 1) - np.clip((phase - 0.02 - OPEN) / CLOSES, 0, 1)
        return 1 - on if other else on

    def state(t, y):
        V = np.array([v["hose_volume"], v["dead_volume"] + area * distance(t)])
        m, U = y[:2], y[2:]
        T = U / (m * C_V)
        return V, m, T, m * R * T / V

    def rates(t, y):
        _, _, T, P = state(t, y)
        s = opened(t)
        dm, dU = np.zeros(2), np.zeros(2)

        def through(C, P_a, T_a, a, P_b, T_b, b_node):
            if C <= 0:
                return
            if P_a >= P_b:
                q, T_up = flow(C, b, P_a, P_b, T_a), T_a
            else:
                q, T_up = -flow(C, b, P_b, P_a, T_b), T_b
            for number, sign in ((a, -1), (b_node, 1)):
                if number is not None:
                    dm[number] += sign * q
                    dU[number] += sign * q * C_P * T_up

        port = 0 if hose else 1
        through(v["valve_C_in"] * s, v["P_s"], T_ROOM, None, P[port], T[port], port)
        through(v["valve_C_out"] * (1 - s), P[port], T[port], port, P_ROOM, T_ROOM, None)
        if hose:
            through(v["hose_C"], P[0], T[0], 0, P[1], T[1], 1)
        dU[1] += v["k_0"] * (T_ROOM - T[1]) - P[1] * area * (distance(t + 1e-6) - distance(t - 1e-6)) / 2e-6
        return np.concatenate([dm, dU])

    t = np.arange(round(pulses * PERIOD / 1e-3)) * 1e-3
    V0 = state(0.0, np.ones(4))[0]
    m0 = (v["P_s"] if other else P_ROOM) * V0 / (R * T_ROOM)
    start = np.concatenate([m0, m0 * C_V * T_ROOM])
    atol = 1e-8 * start
    y = solve_ivp(rates, (0, t[-1]), start, "LSODA", t, rtol=1e-7, atol=atol, max_step=2e-3).y
    P = np.array([state(at, column)[3] for at, column in zip(t, y.T, strict=True)])
    rng = np.random.default_rng(seed)
    measured = P[:, 0 if hose else 1] + rng.normal(0, noise, len(t))
    u = ((t % PERIOD >= 0.02) & (t % PERIOD < 0.02 + OPEN)).astype(float)
    return t, position(t), u, measured
