# pyright: standard
"""The bound: what this processor needs for the kernel's arithmetic alone.

A probe measures how fast independent multiply-adds, divisions and square roots pass through the vector units.
The kernel's operations, counted from its source, times these costs are a time that nothing else adds to: no
loads and stores, no comparisons, no integers, no waiting of one result for another, no shared terms.
"""

import time
from collections.abc import Callable
from math import sqrt
from typing import Any, NamedTuple

import numba
import numpy as np
from numba.core import config
from numba.core.codegen import get_host_cpu_features

from pneumo.simulation.runge_kutta import STAGES
from pneumo.simulation.vectorised import needs


class Operations(NamedTuple):
    """Operations on one lane: multiplications, additions or both fused; divisions; square roots."""

    fused: float
    divisions: float = 0.0
    roots: float = 0.0


# One row per loop of `pneumo.simulation.vectorised`; a test compares them with the machine code. A product
# and its sum count as one. Comparisons, choices, absolute values and integers count nothing.
LOOPS = {
    "pressure of an early stage": Operations(3),
    "pressure of a late stage": Operations(6),
    "logarithm": Operations(3 + 9 + 2, divisions=1),  # parts of the double; square, polynomial; two sums
    "temperature": Operations(1 + 12),  # argument; polynomial of 12 coefficients
    "wall heat": Operations(5),
    "wall heat with the root of PT": Operations(6, roots=1),
    "flow and sum of the terms": Operations(1 + 10 + 1 + 3 + 3 + 3, roots=1),  # s, psi, root, in, out, sum
    "new pressure": Operations(8),
    "error and its sums": Operations(1 + 4 + 4),
}


def passes(lanes: np.ndarray) -> dict[str, float]:
    """How often a lane-evaluation passes each loop, on average over the lanes of a study."""
    need = needs(lanes)
    once_a_step = dict.fromkeys(("new pressure", "error and its sums"), 1 / STAGES)
    by_need = {
        "temperature": float(np.mean(need >= 1)),
        "wall heat": float(np.mean(need >= 2)),
        "wall heat with the root of PT": float(np.mean(need >= 3)),
    }
    half = {f"pressure of {which} stage": 0.5 for which in ("an early", "a late")}
    return dict.fromkeys(LOOPS, 1.0) | half | by_need | once_a_step


# The kernel's aim was set with this many cycles for a vector of 8 doubles; a longer count would flatter it.
MOST_CYCLES = 66


def operations(lanes: np.ndarray) -> Operations:
    """Count the operations of one lane-evaluation, on average over the lanes of a study."""
    count = passes(lanes)
    return Operations(*(sum(count[name] * row[i] for name, row in LOOPS.items()) for i in range(3)))


@numba.njit(error_model="numpy", fastmath={"contract"})
def fused(values, b, c, times):  # pragma: no cover
    """19 multiply-adds per value, in four chains, so that none waits for another."""
    for _ in range(times):
        for i in range(len(values)):
            p = q = r = s = values[i]
            p, q, r, s = p * b + c, q * c + b, r * b + b, s * c + c
            p, q, r, s = p * b + c, q * c + b, r * b + b, s * c + c
            p, q, r, s = p * b + c, q * c + b, r * b + b, s * c + c
            p, q, r, s = p * b + c, q * c + b, r * b + b, s * c + c
            values[i] = p * b + (q * b + (r * c + s))


@numba.njit(error_model="numpy")
def divisions(values, b, c, times):  # pragma: no cover
    """One division per value."""
    for _ in range(times):
        for i in range(len(values)):
            values[i] = b / values[i]


@numba.njit(error_model="numpy")
def roots(values, b, c, times):  # pragma: no cover
    """One square root per value."""
    for _ in range(times):
        for i in range(len(values)):
            values[i] = sqrt(values[i])


@numba.njit
def six_cycles(state, times):  # pragma: no cover
    """Shift and exclusive or, three times, each waiting for the one before: six cycles on any processor."""
    for _ in range(times):
        state ^= state << np.uint64(13)
        state ^= state >> np.uint64(7)
        state ^= state << np.uint64(17)
    return state


PER_VALUE = {fused: 19, divisions: 1, roots: 1}
VALUES = 1024  # in the first-level cache


def timed(run: Callable[..., Any], *arguments: Any) -> float:
    """Processor time of one call, s: what other processes take meanwhile does not count."""
    begin = time.process_time()
    run(*arguments)
    return time.process_time() - begin


def probe() -> dict[str, float]:
    """Measure once, some milliseconds long: ns per operation on one double, and per cycle."""
    costs = {}
    for run, count in PER_VALUE.items():
        values, times = np.full(VALUES, 1.5), 4000 // count
        run(values, 0.5, 0.75, 1)
        costs[run.__name__] = timed(run, values, 0.5, 0.75, times) / (VALUES * times * count) * 1e9
    six_cycles(np.uint64(1), 1)
    costs["cycle"] = timed(six_cycles, np.uint64(1), 200_000) / (200_000 * 6) * 1e9
    return costs


def vector_width() -> int:
    """Doubles in the widest vector that numba compiles for."""
    features = config.CPU_FEATURES or get_host_cpu_features()  # pyright: ignore[reportAttributeAccessIssue]
    selected = set(features.split(","))
    return 8 if "+avx512f" in selected else 4 if "+avx" in selected else 2


class Bound(NamedTuple):
    """Least time for one lane-evaluation and how it comes about.

    Attributes
    ----------
    ns : float
    cycles_per_8_lanes : float
    """

    ns: float
    cycles_per_8_lanes: float


def bound(costs: dict[str, float], lanes: np.ndarray) -> Bound:
    """Combine what the probe measured with the count of operations.

    Lanes that are the same are replayed once; the time is for one of those that were asked for.
    """
    different = np.unique(lanes, axis=0)
    ns = sum(count * costs[name] for name, count in operations(different)._asdict().items())
    cycles = min(8 * ns / costs["cycle"], MOST_CYCLES * 8 / vector_width())
    cycles *= len(different) / len(lanes)
    return Bound(cycles * costs["cycle"] / 8, cycles)
