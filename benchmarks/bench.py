# pyright: basic, reportArgumentType=false
"""Speed of the core beside NumPy and SciPy, and of the whole study: ``make bench`` writes results/bench.json.

All replay the same lanes on the same run, in turn on one core, and must agree. A lane-evaluation is one
right-hand side of one lane in one chamber. Ratios of one run can be compared with those of another machine.
"""

import json
import os
import platform
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import RK45, solve_ivp

from benchmarks.study_runs import run_study
from pneumo.configuration.parameters import load, study
from pneumo.configuration.sampling import EXACT_SAMPLING, INTERPOLATED, Sampling
from pneumo.physics.cylinder import Chamber, Side, chamber_of, heat_area, volume
from pneumo.physics.models import Lane, model_dP_dt, temperature
from pneumo.physics.valve import choked_flow
from pneumo.simulation.full_order import Recording, record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay, replay_one_by_one

ROOT = Path(__file__).parents[1]
EXPERIMENT, REPEATS = "E14", 7
Replay = Callable[[Recording, np.ndarray], np.ndarray]  # mean square errors, (lane, chamber)


class Contender(NamedTuple):
    """A way to replay lanes on a run."""

    label: str
    replay: Replay
    seconds: float  # of the experiment, so that it takes about as long as the others
    tolerance: float  # on its mean square errors, relative to `one by one`


def array_rate(run: Recording, lanes: np.ndarray) -> Callable[[float, np.ndarray], np.ndarray]:
    """Rate of all lanes in both chambers, Pa per step, at a time in steps; signals are interpolated."""
    plant = run.plant
    gas, c, cylinder, g = plant.gas, plant.conditions, plant.cylinder, plant.gas.gamma
    lane: Any = Lane(*lanes.T)
    sign = np.array([[side.sign] for side in Side])
    both: Any = zip(*(chamber_of(cylinder, side) for side in Side), strict=True)
    chamber: Any = Chamber(*(np.array(pair)[:, None] for pair in both))
    samples = np.arange(len(run.u))

    def rate(t: float, P: Any) -> Any:
        P = P.reshape(2, -1)
        u, x, v = (sign * np.interp(t, samples, s) for s in (run.u, run.states[:, 0], run.states[:, 1]))
        u = np.clip(u, -plant.valve.u_max, plant.valve.u_max)
        T = temperature(P, c.P_0, c.T_0, lane.a)
        P_port = np.where(u >= 0, c.P_s, c.P_atm)
        inward, P_u = P_port >= P, np.maximum(P, P_port)
        A_t, T_u, ratio = plant.valve.k_xu * abs(u), np.where(inward, c.T_in, T), np.minimum(P, P_port) / P_u
        subsonic = ratio ** (2 / g) - ratio ** ((g + 1) / g)
        below = A_t * P_u * (2 * g / ((g - 1) * gas.R * T_u) * subsonic) ** 0.5
        flow = np.where(ratio <= gas.critical_ratio, choked_flow(A_t, P_u, T_u, gas), below)  # (1)
        flows, V = (np.where(inward, flow, 0.0), np.where(inward, 0.0, flow)), volume(x, chamber, cylinder)
        area_ratio = heat_area(x, cylinder) / heat_area(0.0, cylinder)
        constants = plant.k_0, c.P_0, c.T_0, c.T_in, c.T_amb, gas.R, g
        dP_dt: Any = model_dP_dt(P, T, V, chamber.area * v, *flows, area_ratio, *constants, lane)
        return run.h * dP_dt.ravel()

    return rate


def mse_of(run: Recording, pressure: np.ndarray) -> np.ndarray:
    """Mean square errors, shape (lane, chamber), of pressures, shape (steps + 1, both chambers' lanes)."""
    of_run = run.states[:, [2, 4]]
    return np.mean((of_run[:, :, None] - pressure.reshape(len(of_run), 2, -1)) ** 2, axis=0).T


def by_numpy(run: Recording, lanes: np.ndarray) -> np.ndarray:
    """The same method in NumPy, lanes of both chambers as one array."""
    rate, P = array_rate(run, lanes), np.empty((len(run.u), 2 * len(lanes)))
    P[0], K = run.plant.conditions.P_0, np.empty((RK45.n_stages, P.shape[1]))
    for k in range(len(run.u) - 1):
        for i in range(RK45.n_stages):
            K[i] = rate(k + RK45.C[i], P[k] + RK45.A[i, :i] @ K[:i])
        P[k + 1] = P[k] + RK45.B @ K
    return mse_of(run, P)


def by_solve_ivp(run: Recording, lanes: np.ndarray) -> np.ndarray:
    """SciPy's Dormand-Prince method with all lanes as one system; tolerances let it take our steps."""
    options: dict[str, Any] = {"method": "RK45", "first_step": 1.0, "max_step": 1.0, "rtol": 1e9, "atol": 1e9}
    start = np.full(2 * len(lanes), run.plant.conditions.P_0)
    return mse_of(run, solve_ivp(array_rate(run, lanes), (0.0, len(run.u) - 1.0), start, **options).y.T)


def core(sampling: Sampling) -> Replay:
    """Lanes side by side."""
    return lambda run, lanes: replay(run, lanes, sampling).mse


def one_by_one(run: Recording, lanes: np.ndarray) -> np.ndarray:
    """Lanes one after another, by the core's plain equations."""
    return replay_one_by_one(run, lanes, INTERPOLATED).mse


CONTENDERS = {
    "core": Contender("core, lanes side by side", core(INTERPOLATED), 20.0, 1e-8),
    "exact": Contender("the same, exact signals", core(EXACT_SAMPLING), 20.0, np.inf),  # other signals
    "scalar": Contender("core, lanes one by one", one_by_one, 2.0, 0.0),
    "numpy": Contender("NumPy, same method", by_numpy, 0.2, 1e-8),
    "solve_ivp": Contender("scipy.integrate.solve_ivp", by_solve_ivp, 0.2, 1e-8),
}


def compare(repeats: int, seconds: float = 1.0) -> dict[str, float]:
    """Nanoseconds a lane-evaluation of every contender: minima over runs in turn.

    Raises
    ------
    ArithmeticError
        If a contender's errors are not those of lanes replayed one by one.
    """
    paper = study(load(ROOT / "config/paper.yaml"))
    e = paper.experiments[EXPERIMENT]
    lanes, _ = grid_lanes(paper.n, e.plant.gas.gamma)
    steps = {name: round(seconds * c.seconds / e.h) for name, c in CONTENDERS.items()}
    runs = {name: record(e._replace(steps=count)) for name, count in steps.items()}
    for name, c in CONTENDERS.items():
        expected = one_by_one(runs[name], lanes)
        error = float(np.max(abs(c.replay(runs[name], lanes) / expected - 1)))
        if not error <= c.tolerance:
            raise ArithmeticError(f"{c.label}: mean square error differs by {error:.1e}, not {c.tolerance:g}")
    best = dict.fromkeys(CONTENDERS, np.inf)
    for _ in range(repeats):
        for name, c in CONTENDERS.items():
            begin = time.perf_counter()
            c.replay(runs[name], lanes)
            count = 2 * len(lanes) * RK45.n_stages * (len(runs[name].u) - 1)
            best[name] = min(best[name], (time.perf_counter() - begin) / count * 1e9)
    return best


def yardstick() -> float:
    """Seconds that this machine's Python takes for ``sum(range(10**8))``."""
    begin = time.perf_counter()
    sum(range(10**8))
    return time.perf_counter() - begin


def cpu() -> str:
    """Name of the processor and its number of cores."""
    info = Path("/proc/cpuinfo")
    named = re.search(r"model name\s*: (.*)", info.read_text() if info.exists() else "")
    return (
        f"{named.group(1) if named else platform.processor() or platform.machine()}, {os.cpu_count()} cores"
    )


def main() -> None:
    """Measure everything, write it and show it."""
    ns = compare(REPEATS)
    report: dict[str, Any] = {"cpu": cpu(), "yardstick_s": yardstick(), "ns_per_lane_evaluation": ns}
    report |= run_study()
    (ROOT / "results/bench.json").write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
    table = Table("", "ns a lane-evaluation", "over the core", title=f"{report['cpu']}; {EXPERIMENT}")
    for name, value in ns.items():
        table.add_row(CONTENDERS[name].label, f"{value:.3g}", f"{value / ns['core']:.3g}")
    Console().print(table)
    print(f"sum(range(10**8)): {report['yardstick_s']:.2f} s")
    for name, seconds in report["wall_s"].items():
        print(f"snakemake -j2, {name}: {seconds:.1f} s")


if __name__ == "__main__":
    main()
