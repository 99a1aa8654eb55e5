# pyright: basic
"""A network of gas nodes: chambers, vessels, hoses and supplies, joined by restrictions.

A node is a volume of gas with one pressure and one temperature; a hose is a node of constant volume. Each
follows the full order, eqs (4) and (5), or one of the reduced models. Between nodes, and between a node and
its surroundings of given pressure and temperature, gas flows through restrictions by eq (1) or ISO 6358.

The study's own kernels, for two chambers behind one servo-valve, neither use this module nor are used by it.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from pneumo.physics.chamber import dP_dt, dT_dt, wall_conductance, wall_heat
from pneumo.physics.models import Lane, Model, lane, temperature
from pneumo.physics.valve import Gas, laminar_factor, mass_flow
from pneumo.simulation.compiled import inlined, kernel
from pneumo.simulation.full_order import copy_state
from pneumo.simulation.runge_kutta import STAGES, C, dormand_prince

inlined(temperature)
LAMINAR = 5e-3  # 1 - P_d / P_u below which a flow is proportional to it: no step follows the bare root
# Rate times step, for the fastest node, up to which a step is stable; the method's own limit is 3.3.
STABLE = 2.5
ACCURATE = (
    0.25  # largest relative change of a pressure in a step, by a sonic flow from the highest to the lowest
)
HOTTEST = 400.0  # K, in the estimate of that rate

PRESSURE, TEMPERATURE, STORE = range(3)  # rows of a state, each with a column for each node
# Rows of the work space: pressure and temperature of nodes and surroundings, flows in and out, and the sum of
# inflows times their temperature.
P_OF, T_OF, M_IN, M_OUT, MT_IN = range(5)


class Node(NamedTuple):
    """A volume of gas, how its temperature is modelled, and the wall around it."""

    lane: Lane  #: coefficients of eq (10) and of the wall's law; those of the full order where `full`
    full: bool  #: whether the temperature is a state, by eq (5), or follows from the pressure, by eq (6)
    P: float  #: first pressure, Pa
    T: float  #: first temperature, K, of the full order
    P_0: float  #: pressure at which eq (6) gives T_0 and at which k_0 is stated, Pa
    T_0: float  #: temperature there, K
    T_wall: float  #: K
    k_0: float = 0.0  #: conductance to the wall, W/K; times `lane.wall_scale`
    k_store: float = 0.0  #: conductance to a heat store beside the gas, W/K
    c_store: float = 0.0  #: heat capacity of the store, J/K; none where 0
    k_back: float = 0.0  #: conductance from the store to the wall, W/K


# Columns of a node's row in the kernel: the fields of its lane, then the others.
N_V, N_IN, N_OUT, EXPONENT, MIXING, _, WALL_SCALE, E_A, E_PT = range(len(Lane._fields))
FULL, P_START, T_START, P_0, T_0, T_WALL, K_0, K_STORE, C_STORE, K_BACK = (
    len(Lane._fields) + i for i in range(len(Node._fields) - 1)
)


class Link(NamedTuple):
    """A restriction between two ends, `first` and `second`.

    An end is the index of a node, or the number of nodes plus the index of one of the surroundings.
    """

    first: int
    second: int
    b: float = np.nan  #: critical ratio of ISO 6358; NaN for eq (1)
    back: float = 1.0  #: area for flow from second to first over that from first to second (check valve: 0)


class Replayed(NamedTuple):
    """States of all nodes at every sample, each of shape (node, sample)."""

    P: np.ndarray  # Pa
    T: np.ndarray  # K
    T_store: np.ndarray  # K


def full_order_lane(gamma: float, e_A: float = 0.0, e_PT: float = 0.0) -> Lane:
    """Coefficients of the full order, eq (4); wall conductance proportional to A_q^e_A (P T)^e_PT, eq (8)."""
    return Lane(gamma, gamma, gamma, 0.0, 1.0, 1.0, 1.0, e_A, e_PT)


def law(model: Model | None, n: float, gamma: float) -> tuple[Lane, bool]:
    """Fields `lane` and `full` of a `Node` by a reduced model at n, or by the full order if model is None."""
    return (full_order_lane(gamma), True) if model is None else (lane(model, n, gamma), False)


@inlined
def network_rates(y: np.ndarray, i: int, context: Any, dy: np.ndarray) -> None:
    """Write the rates of all nodes at Runge-Kutta stage i into dy.

    The state y holds the pressures of all nodes, then their temperatures, then those of their heat stores.
    """
    j, part, parts, h, V, areas, ratios, nodes, links, outside, gas, work = context
    count, at = len(nodes), (part + C[i]) / parts
    for s in range(count):
        row = nodes[s]
        work[P_OF, s] = y[s]
        # (6), or the state
        work[T_OF, s] = (
            y[count + s] if row[FULL] > 0 else temperature(y[s], row[P_0], row[T_0], row[EXPONENT])
        )
        work[M_IN, s], work[M_OUT, s], work[MT_IN, s] = 0.0, 0.0, 0.0
    for s in range(len(outside)):
        work[P_OF, count + s], work[T_OF, count + s] = outside[s, 0], outside[s, 1]
    for e in range(len(links)):
        up, down, A_t = int(links[e, 0]), int(links[e, 1]), areas[e, j] + at * (areas[e, j + 1] - areas[e, j])
        if work[P_OF, down] > work[P_OF, up]:
            up, down, A_t = down, up, A_t * links[e, 3]
        P_u, P_d, T_u = work[P_OF, up], work[P_OF, down], work[T_OF, up]
        if A_t <= 0:
            continue
        b = links[e, 2]
        through = Gas(gas.R, gas.gamma, gas.sonic_coefficient, b, True) if b > 0 else gas
        m = mass_flow(A_t * laminar_factor(P_u, P_d, LAMINAR), P_u, P_d, T_u, through)
        work[M_OUT, up] += m
        work[M_IN, down] += m
        work[MT_IN, down] += m * T_u
    g = gas.gamma
    for s in range(count):
        row, P, T, m_in, m_out = nodes[s], y[s], work[T_OF, s], work[M_IN, s], work[M_OUT, s]
        dV_dt = (V[s, j + 1] - V[s, j]) / h
        volume, ratio = V[s, j] + at * h * dV_dt, ratios[s, j] + at * (ratios[s, j + 1] - ratios[s, j])
        T_in = work[MT_IN, s] / m_in if m_in > 0 else T
        conductance = wall_conductance(row[K_0], ratio, P * T / (row[P_0] * row[T_0]), row[E_A], row[E_PT])
        heat = row[WALL_SCALE] * wall_heat(T, conductance, row[T_WALL])
        dy[count + s], dy[2 * count + s] = 0.0, 0.0
        if row[C_STORE] > 0:
            stored = row[K_STORE] * (T - y[2 * count + s])
            heat -= stored
            dy[2 * count + s] = (stored + row[K_BACK] * (row[T_WALL] - y[2 * count + s])) / row[C_STORE]
        T_inlet = row[MIXING] * T_in + (1 - row[MIXING]) * T
        dy[s] = dP_dt(
            P, T, volume, dV_dt, m_in, m_out, T_inlet, heat, row[N_V], row[N_IN], row[N_OUT], gas.R, g
        )
        if row[FULL] > 0:
            dy[count + s] = dT_dt(P, T, volume, dV_dt, m_in, m_out, T_in, heat, gas.R, g)


_step = dormand_prince(network_rates)


@kernel
def _replayed(
    nodes: np.ndarray,
    links: np.ndarray,
    outside: np.ndarray,
    V: np.ndarray,
    areas: np.ndarray,
    ratios: np.ndarray,
    gas: Gas,
    h: float,
    parts: int,
) -> np.ndarray:
    """States as in `network_rates`, shape (sample, 3 * node).

    NaN from the sample on at which a pressure or temperature is no longer positive.
    """
    count, samples = V.shape
    states = np.full((samples, 3 * count), np.nan)
    y = np.empty(3 * count)
    for s in range(count):
        y[s], y[count + s], y[2 * count + s] = nodes[s, P_START], nodes[s, T_START], nodes[s, T_WALL]
    Y, K = np.empty((STAGES, 3 * count)), np.empty((STAGES, 3 * count))
    work = np.empty((5, count + len(outside)))
    copy_state(y, states[0])
    for j in range(samples - 1):
        for part in range(parts):
            context = (j, part, parts, h, V, areas, ratios, nodes, links, outside, gas, work)
            _step(y, context, h / parts, Y, K, y)
        for s in range(count):
            if not (y[s] > 0 and (nodes[s, FULL] == 0 or y[count + s] > 0)):
                return states
        copy_state(y, states[j + 1])
    return states


def fastest_rate(
    nodes: Sequence[Node],
    links: Sequence[Link],
    surroundings: Sequence[tuple[float, float]],
    V: np.ndarray,
    areas: np.ndarray,
    gas: Gas,
) -> float:
    """Inverse of the longest step that is stable and accurate, 1/s; parameters are those of `replay`.

    It depends on V and `areas` only by each node's smallest volume and each link's largest area.
    """
    # Rates over the area of a node's restrictions per volume: the slope of the proportional flow, and the
    # relative change of pressure by a sonic flow at the largest pressure ratio.
    P = [node.P for node in nodes] + [pressure for pressure, _ in surroundings]
    slope = gas.gamma * (2 * gas.R * HOTTEST / LAMINAR) ** 0.5
    sonic = gas.gamma * gas.R * HOTTEST**0.5 * gas.sonic_coefficient * max(P) / min(P)
    rates = list[float]()
    for s, node in enumerate(nodes):
        open_to = [
            A_t.max() * max(1.0, link.back) for link, A_t in zip(links, areas, strict=True) if s in link[:2]
        ]
        wide = sum(open_to) / np.abs(V[s]).min()
        store = (node.k_store + node.k_back) / node.c_store if node.c_store else 0.0
        heat = (node.k_0 * node.lane.wall_scale + node.k_store) * (gas.gamma - 1) * HOTTEST
        heat /= min(P) * np.abs(V[s]).min()
        rates += [(wide * slope + store + heat) / STABLE, wide * sonic / ACCURATE]
    return max(rates)


def replay(
    nodes: Sequence[Node],
    links: Sequence[Link],
    surroundings: Sequence[tuple[float, float]],
    V: np.ndarray,
    areas: np.ndarray,
    gas: Gas,
    h: float,
    area_ratios: np.ndarray | None = None,
) -> Replayed:
    """Integrate pressures and temperatures of gas volumes that are joined by restrictions.

    Parameters
    ----------
    nodes
        Volumes of gas, with their initial pressures and temperatures.
    links
        Restrictions. Each end is an index of `nodes`, or ``len(nodes)`` plus an index of `surroundings`.
    surroundings
        Pressure, Pa, and temperature, K, of each supply or atmosphere: an infinite volume.
    V
        Volumes, m^3, shape (node, sample); linear between samples.
    areas
        Effective areas of the restrictions, m^2, shape (link, sample); linear between samples.
    gas
        Gas in all nodes.
    h
        Time between samples, s. Each is divided into as many equal steps as the fastest node needs.
    area_ratios
        Heat transfer area over that at which the node's k_0 holds, shape (node, sample); 1 by default.

    Returns
    -------
    Replayed
        Pressures and temperatures at every sample; NaN from the sample on at which a pressure or a
        temperature is no longer positive.
    """
    parts = max(1, int(np.ceil(h * fastest_rate(nodes, links, surroundings, V, areas, gas))))
    rows = np.array([(*node.lane, *node[1:]) for node in nodes], dtype=float)
    states = _replayed(
        rows,
        np.array(links, dtype=float).reshape(len(links), 4),
        np.array(surroundings, dtype=float).reshape(len(surroundings), 2),
        np.ascontiguousarray(V, dtype=float),
        np.ascontiguousarray(areas, dtype=float).reshape(len(links), V.shape[1]),
        np.ones_like(V) if area_ratios is None else np.ascontiguousarray(area_ratios, dtype=float),
        gas,
        h,
        parts,
    )
    P, T, T_store = states.T.reshape(3, *V.shape)
    eq_6 = [
        T[s] if node.full else temperature(P[s], node.P_0, node.T_0, node.lane.a)
        for s, node in enumerate(nodes)
    ]
    return Replayed(P, np.array(eq_6), T_store)
