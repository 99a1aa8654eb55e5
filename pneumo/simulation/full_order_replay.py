# pyright: basic
"""Replay of the full-order chambers with parameters that differ from the run's: the full order as a model.

A row is one set of parameters of the full order; it corresponds to a lane, one reduced model at one n.
"""

from typing import NamedTuple

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.configuration.sampling import Sampling
from pneumo.physics.chamber import dP_dt, dT_dt, wall_conductance, wall_heat
from pneumo.physics.cylinder import Chamber, heat_area, volume
from pneumo.physics.models import WALL_LAWS, full_order_lane, lane_array
from pneumo.physics.valve import chamber_flows
from pneumo.simulation.compiled import inlined
from pneumo.simulation.full_order import Recording
from pneumo.simulation.replay import replay_in_parts


class FullRow(NamedTuple):
    """A full-order model of the chambers, by the parameters in which it differs from the plant."""

    wall_scale: float = 1.0  #: its k_0 over the plant's; 0: adiabatic
    flow_scale: float = 1.0  #: its mass flows over those of the plant's valve
    e_A: float = WALL_LAWS["lambda A_q"][1]  #: exponent of A_q / A_q0 in the wall law; 0: constant
    e_PT: float = WALL_LAWS["lambda A_q"][2]  #: exponent of PT / (P_0 T_0) in the wall law; 0: constant


@inlined
def full_row_rates(
    u: float, x: float, v: float, P: float, T: float, chamber: Chamber, plant: Plant, row: FullRow
) -> tuple[float, float]:
    """Full-order rates of one chamber with a row's parameters: dP/dt, Pa/s, and dT/dt, K/s.

    Signs of the limited command u, V, x, m, and v, m/s, are those of chamber A; for B negate all three.
    """
    gas, conditions = plant.gas, plant.conditions
    V, g = volume(x, chamber, plant.cylinder), gas.gamma
    m_in, m_out = chamber_flows(u, P, T, plant.valve, gas, conditions)
    m_in, m_out, dV_dt = row.flow_scale * m_in, row.flow_scale * m_out, chamber.area * v
    area_ratio = heat_area(x, plant.cylinder) / heat_area(0.0, plant.cylinder)
    PT_ratio = P * T / (conditions.P_0 * conditions.T_0)
    k = row.wall_scale * wall_conductance(plant.k_0, area_ratio, PT_ratio, row.e_A, row.e_PT)
    heat = wall_heat(T, k, conditions.T_amb)
    return (
        dP_dt(P, T, V, dV_dt, m_in, m_out, conditions.T_in, heat, g, g, g, gas.R, g),
        dT_dt(P, T, V, dV_dt, m_in, m_out, conditions.T_in, heat, gas.R, g),
    )


def full_order_mse(recording: Recording, rows: list[FullRow], sampling: Sampling) -> np.ndarray:
    """Mean square pressure error of full-order models with other parameters, Pa^2, shape (row, chamber).

    Each row is replayed from the run's first state on the run's signals and compared with the run's
    pressures. A step whose estimated error is too large is halved, as in `pneumo.simulation.replay.replay`.
    NaN where a replay or the run itself failed.
    """
    gamma = recording.plant.gas.gamma
    lanes = [
        full_order_lane(gamma, row.wall_scale, row.e_A, row.e_PT)._replace(flow_scale=row.flow_scale)
        for row in rows
    ]
    return replay_in_parts(recording, lane_array(lanes), sampling, lambda *_: None).mse
