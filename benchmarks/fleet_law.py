"""Cost of a fleet by its number of cylinders: measured, or from a law fitted to measurements.

Core-seconds are the sum of planning, each job and each cylinder; bytes that of each file of a block, each
cylinder and the index.
"""

from collections.abc import Sequence
from math import ceil
from typing import Any, NamedTuple

import numpy as np

NODES, CORES = 100, 4  # of the estimate: a job of the Slurm profile has a node's four cores
BLOCK = 50  # cylinders in a job, unless the configuration says otherwise


class Law(NamedTuple):
    """Cost of a job and of a cylinder."""

    job_s: float  # core-seconds of a job's start
    cylinder_s: float  # core-seconds of a cylinder
    file_kB: float  # of a block's file, whatever its number of cylinders
    block_kB: float  # of a cylinder in its block
    index_file_kB: float  # of index and page, whatever their number of cylinders
    index_kB: float  # of a cylinder in index and page


def law(measured: dict[str, Any]) -> Law:
    """Fit the law to what `benchmarks.fleet` measured."""
    runs, sizes = measured["runs"], measured["sizes"]
    planning = measured["planned"][0]["cpu_s"]
    seconds = [run["cpu_s"] - planning for run in runs]
    job, cylinder = _fitted([[run["jobs"], run["cylinders"]] for run in runs], seconds)
    blocks = [[size["blocks"], size["cylinders"]] for size in sizes]
    file, block = _fitted(blocks, [size["blocks_kB"] for size in sizes])
    index = [[1, size["cylinders"]] for size in sizes]
    index_file, index_each = _fitted(index, [size["index_kB"] for size in sizes])
    return Law(job, cylinder, file, block, index_file, index_each)


def _fitted(terms: Sequence[Sequence[float]], values: Sequence[float]) -> tuple[float, float]:
    """Both factors of the terms."""
    factors, *_ = np.linalg.lstsq(np.array(terms, float), np.array(values), rcond=None)
    return float(factors[0]), float(factors[1])


def rows(measured: dict[str, Any]) -> list[dict[str, float]]:
    """Return, for each number of cylinders that was planned, what planning took and what the law gives."""
    cost, table = law(measured), []
    for plan in measured["planned"]:
        count = plan["cylinders"]
        seconds = plan["cpu_s"] + plan["jobs"] * cost.job_s + count * cost.cylinder_s
        files = cost.index_file_kB + ceil(count / BLOCK) * cost.file_kB
        disk = files + count * (cost.block_kB + cost.index_kB)
        row = {"cylinders": count, "planning_s": plan["cpu_s"], "peak_MB": plan["peak_MB"]}
        table.append(row | {"jobs": plan["jobs"], "disk_MB": disk / 1e3, "core_h": seconds / 3600})
    return table


def minutes(measured: dict[str, Any]) -> float:
    """Return the estimate of wall time, min, for the largest fleet on `NODES` nodes, blocks in turns."""
    cost, plan = law(measured), measured["planned"][-1]
    turns = ceil(ceil(plan["cylinders"] / BLOCK) / NODES)
    block = cost.job_s + BLOCK * cost.cylinder_s / CORES
    return (plan["cpu_s"] + turns * block + cost.job_s) / 60
