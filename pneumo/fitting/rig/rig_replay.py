"""A run of a rig as a model replays it: chambers, lines, silencers and supply as a network of gas."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from pneumo.configuration.valve_conversions import SBAR, area_per_conductance
from pneumo.fitting.rig.rig_file import Rig
from pneumo.fitting.rig.rig_record import Points, Run
from pneumo.fitting.valve_signal import lagged
from pneumo.physics.cylinder import wetted_area
from pneumo.physics.models import EQ_8, MODELS, WallLaw, full_order_lane, lane
from pneumo.simulation.gas_network import Link, Node, replay

ADIABATIC = "full order, adiabatic"
CONSTANT = WallLaw(0.0, 0.0)
WALLS = {ADIABATIC: CONSTANT, "full order": CONSTANT, "full order, eq (7)": EQ_8}  # of full orders
RIG_MODELS = (*MODELS, *WALLS)
Signal = np.ndarray | float  # by sample, or constant
WALL = ("k_0", "store_k", "store_c", "store_back", "hose_k", "k_0_B")


def mean_opening(t: np.ndarray, begin: float, lasts: float) -> np.ndarray:
    """Fraction, 0 to 1, by which a valve is open, by sample, as a mean over the steps beside each sample.

    The valve starts to open at `begin` and takes `lasts`, both s; `t` is uniform. The weights of the mean
    fall linearly from the sample to its neighbours, where they are 0. So the fraction has the exact integral
    over time, and is smooth in `begin` and `lasts`, which a search needs (decision 153).
    """
    h = t[1] - t[0]
    since = np.clip(t - begin, -h, lasts + h)  # shut before, open after

    def twice_integrated(s: np.ndarray) -> np.ndarray:
        a, b = np.maximum(s, 0.0), np.maximum(s - lasts, 0.0)
        return (a - b) * (a**2 + a * b + b**2) / (6 * lasts)

    return np.diff([twice_integrated(since + step) for step in (-h, 0.0, h)], n=2, axis=0)[0] / h**2


def valve_opening(rig: Rig, values: Mapping[str, float], run: Run) -> np.ndarray:
    """Fraction, 0 to 1, by which the on/off valve of a rig is open, by sample; 0 without a valve."""
    v, t = values, run.t
    if not rig.has("valve_C_in"):
        return np.zeros_like(t)
    opened = mean_opening(t, run.on + v["valve_opening_delay"], v["valve_opening"])
    closed = mean_opening(t, run.off + v["valve_closing_delay"], v["valve_closing"])
    return np.clip(opened - closed, 0.0, 1.0)


class RigReplay(NamedTuple):
    """A run as a model replays it, at the samples of the run's inputs."""

    pressures: tuple[Points, ...]  # Pa, at the sensors, by chamber
    T: Points  # K, of the chamber's gas, as the thermometer reads it
    T_store: Points  # K, of the heat store beside the gas


def replay_run(rig: Rig, model: str, values: Mapping[str, float], run: Run) -> RigReplay:
    """Replay of a run: pressures at the sensors, Pa, temperatures of gas and heat store in the chamber, K."""
    v, gas, t, is_open = values, rig.gas, run.t, valve_opening(rig, values, run)
    T_amb, P_atm = v["T_surroundings"], v["P_surroundings"]
    C = area_per_conductance(gas) / SBAR  # m^2 for 1 m^3/(s Pa)
    row = MODELS.get(model)
    of_model = lane(row, v["n"], gas.gamma) if row else full_order_lane(gas.gamma, WALLS[model])
    warm = model != ADIABATIC
    sides = ("", "_B") if rig.has("dead_volume_B") else ("",)
    supply = "supply" if rig.has("supply_volume") else "source"
    surroundings = {"atmosphere": (P_atm, T_amb)}
    surroundings |= {"source": (v["P_s"], T_amb)} if rig.has("valve_C_in") else {}
    # Nodes with volume, and heat transfer area over that at the start; links: ends, b, ratio back, area.
    nodes = dict[str, tuple[Node, Signal, Signal]]()
    links = list[tuple[str, str, float, float, Signal]]()

    def of(name: str, side: str) -> float:
        """Quantity of a chamber; that of A where B has none of its own."""
        return v.get(name + side, v[name])

    for side in sides:
        port = chamber = f"chamber{side}"
        P_start = v["P_start"] if not side else v.get("P_start_B", v["P_s"])
        T_start = of("T_start", side)
        walls = [of("k_0", side), *(v[name] for name in WALL[1:4])]
        node = Node(of_model, P_start, T_start, P_start, T_start, T_amb, *(k * warm for k in walls))
        if rig.has("volume"):
            nodes[chamber] = node, v["volume"], 1.0
        else:
            x = run.travel - run.x if side else run.x
            volume = of("dead_volume", side) + np.pi / 4 * (v["bore"] ** 2 - of("rod", side) ** 2) * x
            area = wetted_area(volume, np.array(v["bore"]))
            nodes[chamber] = node, volume, area / area[0]
        if rig.has("hose_volume"):
            port = f"hose{side}"
            hose = node._replace(k_0=v["hose_k"] * warm, k_store=0.0, c_store=0.0, k_back=0.0)
            nodes[port] = hose, of("hose_volume", side), 1.0
            back = v["hose_out_over_in"]
            links.append((port, chamber, v.get("hose_b", np.nan), back, C * of("hose_C", side)))
        if rig.has("orifice"):
            area = v["C_d"] * np.pi / 4 * v["orifice"] ** 2
            links.append((port, "atmosphere", v.get("orifice_b", np.nan), 1.0, area))
        elif rig.has("valve_C_in"):
            to_supply = 1.0 - is_open if side else is_open
            exhaust = f"silencer{side}" if rig.has("silencer_volume") else "atmosphere"
            b = v.get("valve_b", np.nan)
            links.append((supply, port, b, 1.0, C * of("valve_C_in", side) * to_supply))
            out = C * of("valve_C_out", side) * (1.0 - to_supply)
            links.append((port, exhaust, v.get("valve_b_out", b), 1.0, out))
            if rig.has("silencer_volume"):
                nodes[exhaust] = Node(of_model, P_atm, T_amb, P_atm, T_amb, T_amb), v["silencer_volume"], 1.0
                b = v.get("silencer_b", np.nan)
                links.append((exhaust, "atmosphere", b, 1.0, C * v["silencer_C"]))
    if rig.has("supply_volume"):
        full = Node(full_order_lane(gas.gamma, CONSTANT), v["P_s"], T_amb, v["P_s"], T_amb, T_amb)
        nodes["supply"] = full, v["supply_volume"], 1.0
        links.append(("source", "supply", v.get("regulator_b", np.nan), 1.0, C * v["regulator_C"]))
    index = {name: k for k, name in enumerate([*nodes, *surroundings])}
    first, volumes, ratios = zip(*nodes.values(), strict=True)
    ends = [Link(index[a], index[b], *rest) for a, b, *rest, _ in links]

    def sampled(signals: Sequence[Signal]) -> np.ndarray:
        return np.array([np.broadcast_to(signal, t.shape) for signal in signals])

    network = first, ends, [*surroundings.values()], sampled(volumes), sampled([link[-1] for link in links])
    states = replay(*network, gas, run.h, sampled(ratios))
    at = "hose" if rig.has("hose_volume") and rig.sensor == "valve" else "chamber"
    pressures = tuple(Points(t, states.P[index[at + side]]) for side in sides)
    T = Points(t, lagged(states.T[0], values["T_lag"], run.h))
    return RigReplay(pressures, T, Points(t, states.T_store[0]))


def errors(replayed: Points, measured: Points) -> np.ndarray:
    """Replayed minus measured values at the measured times."""
    return np.interp(measured.t, replayed.t, replayed.values) - measured.values


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def run_errors(rig: Rig, model: str, values: Mapping[str, float], run: Run) -> tuple[np.ndarray, np.ndarray]:
    """Errors of pressure, Pa, and temperature, K, at the points of a run; empty where none was measured.

    The pressure's errors are those of the first chamber, then those of the other.
    """
    replayed = replay_run(rig, model, values, run)
    P = [errors(*pair) for pair in zip(replayed.pressures, run.pressures, strict=True)]
    return np.concatenate(P), errors(replayed.T, run.T) if run.T is not None else np.empty(0)
