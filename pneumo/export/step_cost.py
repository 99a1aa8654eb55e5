"""Measured cost of an exported step, from cost.json beside this file: `python -m benchmarks.exported_c`."""

import json
from functools import cache
from pathlib import Path
from typing import NamedTuple

FILE = Path(__file__).with_name("cost.json")
PART = "chambers"  # both chambers with their valve


class StepCost(NamedTuple):
    """Cost of one step of 1 ms of both chambers with their valve."""

    ns: float  #: in C, double precision, on the processor of the measurement
    instructions: float  #: of a Cortex-M4F, single precision


@cache
def step_costs() -> dict[str, StepCost]:
    """Measured cost of a step by model, and of the full order, "full"; models added later are missing."""
    rows = json.loads(FILE.read_text(encoding="utf-8"))["rows"][PART]
    return {
        name: StepCost(double["ns"], rows["float"][name]["instructions"])
        for name, double in rows["double"].items()
    }
