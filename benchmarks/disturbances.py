"""What may be wrong with a bench of `benchmarks.fit_bench`: in rig, configuration or file."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from benchmarks.bench_rig import U_MAX, Rig

DURATION, SHORT = 10.0, 4.0  # s
USUAL_RATE = 1000.0  # Hz, of a disturbed record: its cause is judged, not its rate
Columns = dict[str, np.ndarray]


class Disturbance(NamedTuple):
    """Difference from an ideal bench: in the rig, in its configuration, or in the file."""

    text: str
    rig: Callable[[Rig], Rig] = lambda rig: rig
    believed: Callable[[Rig, float], Rig] = lambda rig, _sign: rig  # sign: -1 or 1, drawn
    logged: Callable[[Columns], Columns] = lambda columns: columns
    duration: float = DURATION
    supply: bool = False  # whether the supply pressure is logged
    cause: str = ""  # name of the cause that a warning should have
    rate: float = USUAL_RATE  # Hz


def _tubes(rig: Rig, volume: float = 12.6e-6) -> Rig:
    return rig._replace(V_A=rig.V_A + volume, V_B=rig.V_B + volume)


def scaled(columns: Columns, factor: float, offset: float = 0.0) -> Columns:
    """Columns whose pressures are multiplied and moved."""
    return columns | {name: factor * columns[name] + offset for name in ("P_A", "P_B", "P_s")}


def _averaged(columns: Columns, samples: int) -> Columns:
    window = np.ones(samples) / samples
    means = {name: np.convolve(columns[name], window)[: len(columns[name])] for name in ("P_A", "P_B")}
    return columns | {
        name: np.concatenate([columns[name][:samples], v[samples:]]) for name, v in means.items()
    }


def _late(columns: Columns, samples: int) -> Columns:
    x = columns["x"]
    return columns | {"x": np.concatenate([np.repeat(x[0], samples), x[:-samples]])}


def _rig(**fields: float) -> Callable[[Rig], Rig]:
    return lambda rig: rig._replace(**fields)


DISTURBANCES = {
    "none": Disturbance("undisturbed"),
    "lag2": Disturbance("valve lag 2 ms", rig=_rig(lag=2e-3)),
    "lag5": Disturbance("valve lag 5 ms", rig=_rig(lag=5e-3)),
    "dead": Disturbance("dead time 4 ms", rig=_rig(dead_time=4e-3)),
    "null": Disturbance("null offset 2 %", rig=_rig(null=0.02 * U_MAX)),
    "area": Disturbance("exhaust area 0.75", rig=_rig(exhaust=0.75), cause="exhaust"),
    "tube": Disturbance("tubes 12.6 cm3 each", rig=_tubes),
    "sags": Disturbance("sagging supply", rig=_rig(weak_supply=0.5), cause="sag"),
    "logs": Disturbance("the same, P_s logged", rig=_rig(weak_supply=0.5), supply=True),
    "P_s": Disturbance(
        "P_s wrong by 1 bar", believed=lambda r, sign: r._replace(P_s=r.P_s + sign * 1e5), cause="P_s"
    ),
    "stroke": Disturbance(
        "stroke wrong by 50 mm",
        believed=lambda r, sign: r._replace(stroke=r.stroke + sign * 0.05),
        cause="stroke",
    ),
    "rod": Disturbance("rod forgotten", believed=lambda r, _: r._replace(rod=0.0), cause="A_B"),
    "swap": Disturbance("chambers swapped", logged=lambda c: c | {"P_A": c["P_B"], "P_B": c["P_A"]}),
    "sign": Disturbance("u inverted", logged=lambda c: c | {"u": -c["u"]}),
    "gauge": Disturbance("gauge pressures", logged=lambda c: scaled(c, 1.0, -101325.0)),
    "unit": Disturbance("bar in a column of kPa", logged=lambda c: scaled(c, 1e-2)),
    "slow": Disturbance("100 Hz record", logged=lambda c: {name: v[::10] for name, v in c.items()}),
    "short": Disturbance("4 s record", duration=SHORT),
    "offset": Disturbance(
        "P_A sensor off by 10 kPa", logged=lambda c: c | {"P_A": c["P_A"] + 1e4}, cause="offset_A"
    ),
    "scale": Disturbance("x too large by 3 %", logged=lambda c: c | {"x": 1.03 * c["x"]}, cause="x_scale"),
    "zero": Disturbance("zero of x off by 5 mm", logged=lambda c: c | {"x": c["x"] + 5e-3}, cause="x_zero"),
    "skew": Disturbance("x late by 3 ms", logged=lambda c: _late(c, 3), cause="skew"),
    "mean": Disturbance("P averaged over 5 ms", logged=lambda c: _averaged(c, 5), cause="filter"),
    "band": Disturbance("dead band 3 %", rig=_rig(dead_band=0.03 * U_MAX), cause="dead_band"),
    "play": Disturbance("hysteresis 1 %", rig=_rig(hysteresis=0.005 * U_MAX), cause="hysteresis"),
    "piston": Disturbance("piston leak 2 %", rig=_rig(piston_leak=0.02), cause="piston_leak"),
    "leak": Disturbance("valve leak 2 %", rig=_rig(valve_leak=0.02), cause="valve_leak"),
    "side": Disturbance("valve's side B 15 % smaller", rig=_rig(side_B=0.85), cause="C_B"),
    "warm": Disturbance("T_amb drifts 7 K", rig=_rig(warming=0.7), cause="drift"),
}
