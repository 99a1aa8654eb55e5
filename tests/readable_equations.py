"""The equations of the core in plain Python, written to be read: rates, a step, a replay of one lane."""

import numpy as np
from scipy.integrate import RK45

from pneumo.physics.chamber import dT_dt, wall_conductance, wall_heat
from pneumo.physics.cylinder import Side, acceleration, chamber_of, heat_area, motion, stopped, volume
from pneumo.physics.models import full_order_lane, model_dP_dt, temperature
from pneumo.physics.valve import chamber_flows, limited
from pneumo.simulation.excitation import command

# Dormand and Prince's method: stage coefficients, weights, nodes, and fifth-order minus fourth-order weights.
A, B, C, E = np.pad(RK45.A, ((0, 0), (0, 1))), RK45.B, RK45.C, -RK45.E
STAGES = len(B)


def chamber_rates(u, x, v, P, T, chamber, plant, lane=None):
    """Rates of one chamber's pressure, Pa/s, and temperature, K/s, by a lane, or by the plant's full order.

    A reduced model takes its temperature from eq (6), not from T; its second rate is 0. Signs of the limited
    command u, V, x, m, and v, m/s, are those of chamber A; for B negate all three.
    """
    gas, c = plant.gas, plant.conditions
    lane = lane or full_order_lane(gas.gamma)
    T = T if lane.full else temperature(P, c.P_0, c.T_0, lane.a)
    V, dV_dt = volume(x, chamber, plant.cylinder), chamber.area * v
    m_in, m_out = chamber_flows(u, P, T, plant.valve, gas, c, chamber.side)
    area_ratio = heat_area(x, plant.cylinder) / heat_area(0.0, plant.cylinder)
    state, surroundings = (P, T, V, dV_dt, m_in, m_out), (c.P_0, c.T_0, c.T_in, c.T_amb, gas.R, gas.gamma)
    dP = model_dP_dt(*state, area_ratio, plant.k_0, *surroundings, lane)
    if not lane.full:
        return dP, 0.0
    k = wall_conductance(plant.k_0, area_ratio, P * T / (c.P_0 * c.T_0), lane.e_A, lane.e_PT)
    heat = lane.wall_scale * wall_heat(T, k, c.T_amb)
    m_in, m_out = lane.flow_scale * m_in, lane.flow_scale * m_out
    return dP, dT_dt(P, T, V, dV_dt, m_in, m_out, c.T_in, heat, gas.R, gas.gamma)


def lane_rate(u, x, v, P, chamber, plant, lane):
    """Rate of one chamber's pressure by a reduced model, Pa/s; parameters are those of `chamber_rates`."""
    return chamber_rates(u, x, v, P, plant.conditions.T_0, chamber, plant, lane)[0]


def full_order_rates(y, reference, drive, plant, force=0.0):
    """Rates of the state (x, v, P_A, T_A, P_B, T_B): eq (3), and eqs (4) and (5) for both chambers.

    `reference`, m in closed loop or V in open loop, and the external force, N, hold for the whole step.
    """
    x, v, P_A, T_A, P_B, T_B = y
    u = limited(command(reference, x, drive), plant.valve.u_max)
    of_A = chamber_rates(u, x, v, P_A, T_A, chamber_of(plant.cylinder, Side.A), plant)
    of_B = chamber_rates(-u, -x, -v, P_B, T_B, chamber_of(plant.cylinder, Side.B), plant)
    moving = motion(x, v, acceleration(v, P_A, P_B, force, plant.cylinder), plant.cylinder)
    return np.array([*moving, *of_A, *of_B])


def dormand_prince(rates, y, h):
    """State h s after y, and the six stage states: one step of Dormand and Prince's method."""
    K = np.zeros((STAGES, len(y)))
    stages = np.empty_like(K)
    for i in range(STAGES):
        stages[i] = y + h * (A[i, :i] @ K[:i])
        K[i] = rates(stages[i], i)
    return y + h * (B @ K), stages


def full_order_step(y, reference, drive, plant, h, force=0.0):
    """State h s after y by the full order, with the end stops applied to position and velocity."""
    after, _ = dormand_prince(lambda state, _: full_order_rates(state, reference, drive, plant, force), y, h)
    after[:2] = stopped(after[0], after[1], y[1], plant.cylinder)
    return after


def stage_signals(recording, k, halvings):
    """Limited u, x, v and chamber B's own u at the stages of each part of step k, and at its end."""
    plant, drive, h = recording.plant, recording.drive, recording.h / 2**halvings
    y, reference = recording.states[k], recording.reference[k]
    for _ in range(2**halvings):
        end, stages = dormand_prince(lambda y, _: full_order_rates(y, reference, drive, plant), y, h)
        u = [limited(command(reference, stage[0], drive), plant.valve.u_max) for stage in [*stages, end]]
        yield [(now, *stage[:2], -now) for now, stage in zip(u, [*stages, end], strict=True)]
        y = full_order_step(y, reference, drive, plant, h)


def replay_lane(recording, lane, side):
    """Pressure of one chamber by a lane at every step of a run, Pa; NaN from where it is not positive.

    Signals are exact, steps are divided as the run's were, and the first state is the run's.
    """
    plant, sign = recording.plant, side.sign
    chamber, pressure = chamber_of(plant.cylinder, side), np.full(len(recording.states), np.nan)
    y = recording.states[0, 2 + 2 * side :][:2]
    pressure[0] = y[0]
    for k, halvings in enumerate(recording.halvings.tolist()):
        for inputs in stage_signals(recording, k, halvings):

            def rates(y, i, inputs=inputs):
                u, x, v, u_B = inputs[i]
                own = u if side == Side.A else u_B
                return np.array(chamber_rates(own, sign * x, sign * v, y[0], y[1], chamber, plant, lane))

            y, _ = dormand_prince(rates, y, recording.h / 2**halvings)
        if not y[0] > 0:
            break
        pressure[k + 1] = y[0]
    return pressure
