"""What values of quantities make of the signals that a replay reads, and of the pressures that it gives.

Inputs are command, supply and motion, outputs the pressures; `pneumo.quantities.applied` changes the plant.
"""

from collections.abc import Mapping

import numpy as np

import pneumo.core as core
from pneumo.configuration.experiment import Plant
from pneumo.fitting.stage_signals import StageSignals
from pneumo.fitting.valve_signal import behind_valve, filtered, lagged
from pneumo.physics.cylinder import Side, chamber_of
from pneumo.physics.valve import choked_flow

SUPPLY_LINE = 1e-3 * core.lib.SUPPLY_LINE_MS  # s, time constant of the volume behind a supply that sags


def misread(signals: StageSignals, name: str, off: float) -> StageSignals:
    """Signals of a record whose sensors are off: the zero of x, m, its scale, or the gain of a pressure."""
    if name == "x_zero":
        return signals._replace(motion=signals.motion + np.array([off, 0.0]))
    if name == "x_scale":
        return signals._replace(motion=signals.motion * (1 + off))
    if name == "P_gain_s":
        return signals._replace(P_s=None if signals.P_s is None else signals.P_s * (1 + off))
    gains = 1 + off * np.array([[name == f"P_gain_{side}"] for side in "AB"])
    return signals._replace(P=signals.P * gains)


def opened(signals: StageSignals, values: dict[str, float]) -> StageSignals:
    """Signals for a reduced model: command behind the fitted valve, pressures less the fitted offsets."""
    P_s = None if signals.P_s is None else signals.P_s - offset(signals.zeros, values, "P_s")
    u = np.empty_like(signals.u)
    for first, last in signals.pieces:
        steps = slice(first * signals.stride, (last + 1) * signals.stride)
        u[steps] = behind_valve(signals.u[steps], signals.h, values, signals.largest)
    return signals._replace(u=u, P=signals.P - offsets(signals, values), P_s=P_s)


def supply_at_valve(
    signals: StageSignals, u: np.ndarray, plant: Plant, value: dict[str, float]
) -> np.ndarray | None:
    """Supply pressure as measured, less its sensor's offset, or as configured, Pa, by (step, stage).

    It falls by a fraction `sag` at the largest flow where `value` has one, and with the square of the flow,
    as behind a line that obeys ISO 6358. None if it is as configured.
    """
    measured = None if signals.P_s is None else signals.P_s - offset(signals.zeros, value, "P_s")
    if "sag" not in value:
        return measured
    upstream = plant.conditions.P_s if measured is None else measured
    return upstream * (1 - value["sag"] * flow_fraction(signals, u, plant) ** 2)[:, None] * np.ones(u.shape)


def flow_fraction(signals: StageSignals, u: np.ndarray, plant: Plant) -> np.ndarray:
    """Flow from the supply over the largest, shape (step,), smoothed over `SUPPLY_LINE`.

    It is that through the opening `u`, V, at the measured pressures.
    """
    steps = np.arange(len(u)) / signals.stride
    A, B = (np.interp(steps, np.arange(signals.P.shape[1]), side) for side in signals.P)
    ratio = np.where(u[:, 0] > 0, A, B) / plant.conditions.P_s
    flow = np.abs(u[:, 0]) / plant.valve.u_max * subsonic(ratio, plant.gas.critical_ratio)
    decay = np.exp(-signals.h / SUPPLY_LINE)
    return filtered(flow, 1 - decay, 0.0, decay, 0.0)


def subsonic(ratio: np.ndarray, b: float) -> np.ndarray:
    """Flow over the choked flow by ISO 6358, at ratios of the pressures downstream and upstream."""
    return np.sqrt(1 - np.clip((ratio - b) / (1 - b), 0.0, 1.0) ** 2)


def leaked_volume(signals: StageSignals, plant: Plant, value: dict[str, float]) -> np.ndarray:
    """Volume flow that leaks out of each chamber, m^3/s at the chamber's pressure, by (step, chamber).

    Gas leaks past the piston and through both paths of the valve; the area of each leak is a fraction of the
    configured valve's. Flows are computed at the measured pressures and T_amb.
    """
    c, gas = plant.conditions, plant.gas
    steps = np.arange(len(signals.u)) / signals.stride
    chambers = [np.interp(steps, np.arange(signals.P.shape[1]), side) for side in signals.P]
    supply = np.full(len(steps), c.P_s) if signals.P_s is None else signals.P_s[:, 0]
    sonic = choked_flow(plant.valve.k_xu * plant.valve.u_max, 1.0, c.T_amb, gas)  # over the pressure upstream

    def mass_flow(P_1: np.ndarray, P_2: np.ndarray) -> np.ndarray:
        """Mass flow from 1 to 2, kg/s."""
        upstream = np.maximum(P_1, P_2)
        ratio = np.minimum(P_1, P_2) / upstream
        return np.sign(P_1 - P_2) * sonic * upstream * subsonic(ratio, gas.critical_ratio)

    piston, valve = (value.get(name, 0.0) for name in ("piston_leak", "valve_leak"))
    past = piston * mass_flow(*chambers)
    outside = np.full(len(steps), c.P_atm)
    flows = [
        sign * past + valve * (mass_flow(P, outside) - mass_flow(supply, P))
        for sign, P in zip((1.0, -1.0), chambers, strict=True)
    ]
    return np.stack([m * gas.R * c.T_amb / P for m, P in zip(flows, chambers, strict=True)], axis=-1)


def with_leak(motion: np.ndarray, plant: Plant, leaked: np.ndarray, side: int) -> np.ndarray:
    """Motion with a changed velocity that has the effect of a leak out of one chamber.

    Air that leaks out lets the rest expand, as behind a moving piston: the rates of pressure and temperature
    are the same. `leaked`, m^3/s, is from `leaked_volume`.
    """
    moved = motion.copy()
    area = chamber_of(plant.cylinder, side).area
    moved[..., 1] += Side(side).sign * (leaked[:, side] / area)[:, None]
    return moved


def as_logged(P: np.ndarray, period: float, value: dict[str, float]) -> np.ndarray:
    """Replayed pressures as a logger records them, Pa, with samples along the last axis.

    They are earlier by `skew` and behind a filter with the time constant `filter`, both in s, where `value`
    has them.
    """
    if skew := value.get("skew", 0.0):
        last = P.shape[-1] - 1
        at = np.clip(np.arange(last + 1) + skew / period, 0, last)
        before = np.minimum(at.astype(int), last - 1)
        P = P[..., before] + (at - before) * (P[..., before + 1] - P[..., before])
    return lagged(P, value.get("filter", 0.0), period)


def offset(zeros: Mapping[str, float], values: Mapping[str, float], pressure: str) -> float:
    """Fitted offset of the sensor of P_A, P_B or P_s, Pa; of a gauge, in `zeros`, with the atmosphere's."""
    name = "offset_P_s" if pressure == "P_s" else pressure.replace("P", "offset")
    off = values.get(name, 0.0)
    return off + zeros[pressure] - values["P_atm"] if pressure in zeros and "P_atm" in values else off


def offsets(signals: StageSignals, values: Mapping[str, float]) -> np.ndarray:
    """Offsets of the sensors of both chambers, Pa, shape (chamber, 1); zero where none is fitted."""
    return np.array([[offset(signals.zeros, values, f"P_{side}")] for side in "AB"])
