"""A network of gas nodes: chambers, vessels, hoses and supplies, joined by restrictions.

A node is a volume of gas with one pressure and one temperature; a hose is a node of constant volume. Each
follows the full order, eqs (4) and (5), or one of the reduced models. Between nodes, and between a node and
its surroundings of given pressure and temperature, gas flows through restrictions by eq (1) or ISO 6358.

The study's replays, of two chambers behind one servo-valve, do not use this module.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import pneumo.core as core
from pneumo.physics.models import Lane, temperature
from pneumo.physics.valve import Gas

MOST_PARTS = 10_000  # steps between two samples: a node that needs more is no part of a real rig
LAMINAR = 5e-3  # 1 - P_d / P_u below which a flow is proportional to it: no step follows the bare root
# Rate times step, for the fastest node, up to which a step is stable; the method's own limit is 3.3.
STABLE = 2.5
# Largest relative change of a pressure in a step, by a sonic flow from the highest to the lowest.
ACCURATE = 0.25
AT_ONCE = 1e3  # times between samples a heat store responds: faster ones follow at once
HOTTEST = 400.0  # K, in the estimate of that rate


class Node(NamedTuple):
    """A volume of gas, how its temperature is modelled, and the wall around it."""

    lane: Lane  #: coefficients of a model, or of the full order
    P: float  #: first pressure, Pa
    T: float  #: first temperature, K, of the full order
    P_0: float  #: pressure at which eq (6) gives T_0 and at which k_0 is stated, Pa
    T_0: float  #: temperature there, K
    T_wall: float  #: K
    k_0: float = 0.0  #: conductance to the wall, W/K; times `lane.wall_scale`
    k_store: float = 0.0  #: conductance to a heat store beside the gas, W/K
    c_store: float = 0.0  #: heat capacity of the store, J/K; 0: its temperature follows at once
    k_back: float = 0.0  #: conductance from the store to the wall, W/K


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
        temperature is no longer positive, and throughout if a sample took more than `MOST_PARTS` steps.
    """
    nodes = [
        node._replace(c_store=0.0) if node.k_store + node.k_back > AT_ONCE * node.c_store / h else node
        for node in nodes
    ]
    needed = h * fastest_rate(nodes, links, surroundings, V, areas, gas)
    if needed > MOST_PARTS:
        nothing = np.full(V.shape, np.nan)
        return Replayed(nothing, nothing, nothing)
    parts = max(1, int(np.ceil(needed)))
    rows = np.array([(*node.lane, *node[1:]) for node in nodes], dtype=float)
    count, samples = V.shape
    ends = count + len(surroundings)
    for link in links:
        for end in link[:2]:
            core.whole("end of a link", end, 0, ends - 1)
    states = np.full((samples, 3 * count), np.nan)
    core.lib.replay_network(
        core.rows("nodes", rows, "Node"),
        count,
        core.rows("links", np.array(links, dtype=float).reshape(-1, 4), "Link"),
        len(links),
        core.array("surroundings", np.array(surroundings, dtype=float).reshape(-1, 2), (None, 2)),
        len(surroundings),
        core.array("V", V, (count, samples)),
        core.array("areas", np.reshape(areas, (len(links), samples)), (len(links), samples)),
        core.array("area_ratios", np.ones_like(V) if area_ratios is None else area_ratios, (count, samples)),
        core.whole("samples", samples, 1),
        core.struct("Gas", gas),
        h,
        core.whole("parts", parts, 1, MOST_PARTS),
        core.out(np.empty((2 * core.lib.STAGES + 1) * 3 * count + 5 * ends)),
        core.out(states),
    )
    P, T, T_store = states.T.reshape(3, *V.shape)
    eq_6 = [
        T[s] if node.lane.full else temperature(P[s], node.P_0, node.T_0, node.lane.a)
        for s, node in enumerate(nodes)
    ]
    for s, node in enumerate(nodes):
        if node.k_store > 0 and not node.c_store:
            T_store[s] = (node.k_store * eq_6[s] + node.k_back * node.T_wall) / (node.k_store + node.k_back)
    return Replayed(P, np.array(eq_6), T_store)
