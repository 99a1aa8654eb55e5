"""The kernel and its contenders in turn, on one core; as a program, the kernel alone as JSON.

Run as a program it takes the processor that NUMBA_CPU_NAME and NUMBA_CPU_FEATURES name for this one.
"""

import json
import os
import statistics
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.contenders import CONTENDERS, Case, Contender, Run, our_run, scalar
from benchmarks.probe import bound, operations, probe, timed
from pneumo.configuration.experiment import Study
from pneumo.configuration.parameters import load, study
from pneumo.configuration.sampling import EXACT_SAMPLING
from pneumo.simulation.full_order import record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay

ROOT = Path(__file__).parents[1]
EXPERIMENT = "E14"
REPEATS = 15
LEAST_GAIN = {"numpy": 120, "diffrax": 12}  # the aims of the fast kernel


class DisagreementError(ArithmeticError):
    """A contender's numbers are not those of the readable kernel."""


def paper() -> Study:
    """The study of the paper."""
    return study(load(ROOT / "config/paper.yaml"))


def case_of(name: str, steps: int) -> Case:
    """The first steps of an experiment of the paper, with all its lanes."""
    experiment = paper().experiments[name]._replace(steps=steps)
    lanes, _ = grid_lanes(paper().n, experiment.plant.gas.gamma)
    return Case(experiment, record(experiment), lanes)


def stay_on_one_core() -> None:
    """Keep this process and its threads on one core, where the system knows how."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def evaluations(case: Case, calls: float) -> float:
    """Lane-evaluations of a run of so many calls per lane and chamber."""
    return 2 * len(case.lanes) * calls


def difference(contender: Contender, case: Case, run: Run) -> float:
    """Largest relative difference from the readable kernel's MSE.

    Raises
    ------
    DisagreementError
        If it is larger than the contender is granted.
    """
    theirs, ours = run().mse, scalar(case)().mse
    error = float(np.max(abs(theirs / ours - 1)))
    if not error <= contender.tolerance:
        raise DisagreementError(
            f"{contender.label}: MSE differs from the readable kernel's by {error:.1e} of it, more than the "
            f"{contender.tolerance:.0e} granted ({contender.reason})"
        )
    return error


def compare(contenders: dict[str, Contender], repeats: int) -> dict[str, Any]:
    """Check contenders against the readable kernel, then time them and the probe in turn.

    Returns
    -------
    dict
        Medians: ``ns_per_lane_evaluation``, and the bound with what it follows from.
    """
    h = paper().experiments[EXPERIMENT].h
    longest = case_of(EXPERIMENT, round(max(c.seconds for c in contenders.values()) / h))
    runs, checks = {}, {}
    for name, contender in contenders.items():
        case = longest.first(round(contender.seconds / h))
        run = contender.prepare(case)
        error = difference(contender, case, run)
        checks[name] = {"mse_relative": error, "tolerance": contender.tolerance, "reason": contender.reason}
        runs[name] = run, evaluations(case, run().calls)
        if name == "kernel":
            runs["kernel_exact"] = our_run(replay, case, EXACT_SAMPLING), runs[name][1]
            runs["kernel_exact"][0]()  # compiles
    rows, probes = {name: [] for name in runs}, []
    for _ in range(repeats):
        for name, (run, count) in runs.items():
            rows[name].append(timed(run) / count * 1e9)
        probes.append(probe())
    ns = {name: statistics.median(row) for name, row in rows.items()}
    costs = {name: statistics.median(row[name] for row in probes) for name in probes[0]}
    least = bound(costs, longest.lanes)
    return {
        "ns_per_lane_evaluation": {name: value for name, value in ns.items() if name != "kernel_exact"},
        "kernel_exact_transport_ns": ns["kernel_exact"],
        "bound_ns": least.ns,
        "fraction_of_bound": least.ns / ns["kernel"],
        "bound": {
            "cycles_per_8_lanes": least.cycles_per_8_lanes,
            "operations_per_lane": operations(longest.lanes)._asdict(),
            "ns_per_operation_on_one_double": costs,
            "clock_GHz": 1 / costs["cycle"],
        },
        "gain": {f"over_{name}": value / ns["kernel"] for name, value in ns.items() if name in CONTENDERS},
        "least_gain": LEAST_GAIN,
        "checks": checks,
        "repeats": repeats,
    }


def growth(repeats: int) -> dict[str, list[dict[str, float]]]:
    """How the kernel's time, s, grows with lanes, duration and number of cylinders."""

    @cache
    def shortest(name: str, steps: int, lanes: int) -> float:
        case = case_of(name, steps)
        case = case._replace(lanes=case.lanes[np.arange(lanes) % len(case.lanes)])
        run = our_run(replay, case)
        return min(timed(run) for _ in range(repeats))

    grid = len(grid_lanes(paper().n, 1.4)[0])
    h = paper().experiments[EXPERIMENT].h
    names = [EXPERIMENT, "E16", "E13", "E15"]  # cylinders D and E in turn, of the same duration
    return {
        "lanes": [
            {"lanes": lanes, "s": shortest(EXPERIMENT, 2000, lanes)}
            for lanes in (8, 16, 32, grid, 132, 264, 528, 1056)
        ],
        "duration": [
            {"duration_s": seconds, "s": shortest(EXPERIMENT, round(seconds / h), grid)}
            for seconds in (1, 3, 10, 30, 60)
        ],
        "cylinders": [
            {"cylinders": count, "s": sum(shortest(name, 2000, grid) for name in names[:count])}
            for count in (1, 2, 4)
        ],
    }


def main() -> None:
    """Print the kernel's figures as JSON."""
    stay_on_one_core()
    print(json.dumps(compare({"kernel": CONTENDERS["kernel"]}, REPEATS)))


if __name__ == "__main__":
    main()
