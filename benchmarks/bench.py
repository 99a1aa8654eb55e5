# pyright: basic
"""Speed of the core and of the whole study: ``make bench`` adds a line to benchmarks/history.jsonl.

All ways to replay take the same lanes on the same run, in turn on one core, and must agree. A lane-evaluation
is one right-hand side of one lane in one chamber.
"""

import json
import os
import platform
import re
import time
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.study_runs import run_study
from pneumo.configuration.parameters import load, study
from pneumo.configuration.sampling import EXACT_SAMPLING, INTERPOLATED, Sampling
from pneumo.simulation.full_order import Recording, record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay, replay_one_by_one
from pneumo.simulation.tableau import STAGES
from pneumo.storage.files import made_with

ROOT = Path(__file__).parents[1]
EXPERIMENT, REPEATS = "E14", 7
Replay = Callable[[Recording, np.ndarray], np.ndarray]  # mean square errors, (lane, chamber)


class Contender(NamedTuple):
    """A way to replay lanes on a run."""

    label: str
    replay: Replay
    seconds: float  # of the experiment, so that it takes about as long as the others
    tolerance: float  # on its mean square errors, relative to `one by one`


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
            count = 2 * len(lanes) * STAGES * (len(runs[name].u) - 1)
            best[name] = min(best[name], (time.perf_counter() - begin) / count * 1e9)
    return best


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
    report: dict[str, Any] = {"cpu": cpu(), "ns_per_lane_evaluation": ns}
    report |= run_study()
    with (ROOT / "benchmarks/history.jsonl").open("a", encoding="utf-8") as history:
        history.write(json.dumps({"day": date.today().isoformat(), **made_with(), **report}) + "\n")
    table = Table("", "ns a lane-evaluation", "over the core", title=f"{report['cpu']}; {EXPERIMENT}")
    for name, value in ns.items():
        table.add_row(CONTENDERS[name].label, f"{value:.3g}", f"{value / ns['core']:.3g}")
    Console().print(table)
    for name, seconds in report["wall_s"].items():
        print(f"snakemake -j2, {name}: {seconds:.1f} s")


if __name__ == "__main__":
    main()
