"""Tables of exported steps: cost, from static/cost.json, and strokes, from static/strokes.json."""

import json
from pathlib import Path
from typing import Any

from paper.study.text.markdown_tables import markdown_table as table
from pneumo.equations.system import FULL_ORDER

STROKES = Path(__file__).parent / "static/strokes.json"
NAMES = {FULL_ORDER: "full order"}


def _name(row: str) -> str:
    return NAMES.get(row, row)


def strokes() -> str:
    """Table of the largest differences of strokes from vented to rest, by row."""
    rows = json.loads(STROKES.read_text(encoding="utf-8"))
    cells = list[list[str]]()
    for row, kinds in rows.items():
        cells.append([_name(row)])
        for kind in kinds.values():
            cells[-1] += [f"{kind['kept']} of {kind['strokes']}", f"{1e-3 * kind['pressure']:.2f}"]
            cells[-1].append(f"{kind['temperature']:.2f}" if row == FULL_ORDER else "")
    of_each = ["within 0.5 kPa and 1 K", "pressure (kPa)", "temperature (K)"]
    return table(["model", *of_each, *(f"shut while moving: {head}" for head in of_each)], cells)


def _count(value: float) -> str:
    return f"{value:,.0f}"


def tables(cost: dict[str, Any]) -> dict[str, str]:
    """Tables of export.md: steps and observers."""
    double_rows, single_rows = (cost["rows"][precision] for precision in ("double", "float"))
    steps = []
    for row, double in double_rows.items():
        single = single_rows[row]
        cells = [_name(row)]
        cells += [_count(at["ns"]) for at in (double, single)]
        cells += [
            _count(single[key]) if key in single else "" for key in ("instructions", "most_instructions")
        ]
        steps.append([*cells, _count(single["code_bytes"]), _count(single["stack_bytes"])])
    cycles = cost["observers"]["rows"]
    observers = []
    for row, double in cycles["double"].items():
        single = cycles["float"][row]
        ns = [_count(at["ns"]) for at in (double, single)]
        bytes_of = [_count(single[key]) for key in ("code_bytes", "stack_bytes", "estimate_bytes")]
        states = f"{double['states']}"
        observers.append([_name(row), states, *ns, _count(single["instructions"]), *bytes_of])
    times = ["double (ns)", "float (ns)"]
    memory = ["code (bytes)", "stack (bytes)"]
    of_observers = ["observer of", "states", *times, "instructions, mean", *memory, "estimate (bytes)"]
    heads = ["model", *times, "instructions, mean", "instructions, most", *memory]
    return {
        "table_steps": table(heads, steps),
        "table_strokes": strokes(),
        "table_observers": table(of_observers, observers),
    }


def numbers(cost: dict[str, Any]) -> dict[str, str]:
    """Numbers and tables of the cost of a step, by name."""
    single = cost["rows"]["float"]
    full_row = single[FULL_ORDER]
    on_a_pc = cost["rows"]["double"]
    of_M6 = on_a_pc[FULL_ORDER]["ns"] / on_a_pc["M6"]["ns"]
    cycle = cost["observers"]["rows"]["float"]["M8"]["instructions"]
    return tables(cost) | {
        "experiment": cost["experiment"],
        "processor": " ".join(cost["processor"].split()),
        "shared": "while other programs ran on it" if cost["shared"] else "otherwise idle",
        "compilers": "; ".join([cost["compiler"], *cost["arm"]]),
        "observer_over_step": f"{cycle / single['M8']['instructions']:.1f}",
        "worst_ms": " to ".join(f"{cycles * full_row['most_instructions'] / 168e3:.1f}" for cycles in (1, 2)),
        "most_over_mean": f"{full_row['most_instructions'] / full_row['instructions']:.1f}",
        "full_longer_on_a_pc": f"{100 * (of_M6 - 1):.0f} %",
        "full_over_M8_instructions": f"{full_row['instructions'] / single['M8']['instructions']:.2f}",
    }
