"""Numbers and tables of cluster.md.

static/fleet.json is from `python -m benchmarks.fleet`, static/slurm.json from results/evidence/slurm.json.
"""

import json
from pathlib import Path
from typing import Any

from fragments import table

from benchmarks.fleet_law import law, minutes, rows

STATIC = Path(__file__).with_name("static")


def stored(name: str) -> dict[str, Any]:
    """Measurements of static/: `fleet` or `slurm`."""
    return json.loads((STATIC / f"{name}.json").read_text(encoding="utf-8"))


def tables(fleet: dict[str, Any], slurm: dict[str, Any]) -> dict[str, str]:
    """Tables of the page by name: the law's costs, and how the disturbed jobs ended."""
    columns = {  # heading -> key, format
        "cylinders": ("cylinders", ".0f"),
        "jobs": ("jobs", ".0f"),
        "planning (s of processor)": ("planning_s", ".1f"),
        "main process (MB)": ("peak_MB", ".0f"),
        "results (MB)": ("disk_MB", ".3g"),
        "all of it (core-seconds)": ("core_s", ".0f"),
    }
    measured = [row | {"core_s": 3600 * row["core_h"]} for row in rows(fleet)]
    costs = [[f"{row[key]:{form}}" for key, form in columns.values()] for row in measured]
    disturbed: list[list[str]] = []
    for disturbance, job in slurm["slurm"]["disturbed"].items():
        attempts = [attempt for attempt in slurm["slurm"]["jobs"] if attempt["task"] == job["task"]]
        ends = [f"{attempt['state'].lower()} (limit {attempt['time_limit']})" for attempt in attempts]
        disturbed.append([disturbance, f"`{job['task'].split('_')[-1]}`", ", then ".join(ends)])
    heads = ["disturbance", "block", "how Slurm says that its jobs ended"]
    return {"costs": table(columns, costs), "slurm": table(heads, disturbed)}


def numbers(fleet: dict[str, Any], slurm: dict[str, Any]) -> dict[str, str]:
    """Numbers in the page's sentences by name."""
    per_unit, on_slurm = law(fleet), slurm["slurm"]
    return {
        "processor": fleet["cpu"],
        "cylinder": f"{per_unit.cylinder_s:.1f}",
        "job": f"{per_unit.job_s:.0f}",
        "block kB": f"{per_unit.block_kB:.0f}",
        "file kB": f"{per_unit.file_kB:.0f}",
        "index kB": f"{per_unit.index_kB:.1f}",
        "hours": f"{rows(fleet)[-1]['core_h']:.0f}",
        "minutes": f"{minutes(fleet):.1f}",
        "cylinders": str(slurm["cylinders"]),
        "per job": str(slurm["per_job"]),
        "simulated": str(slurm["simulated_s_per_run"]),
        "local": f"{slurm['local_wall_s'] / 60:.1f}",
        "remote": f"{on_slurm['wall_s'] / 60:.1f}",
        "jobs": str(len(on_slurm["jobs"])),
        "retries": str(on_slurm["retries"]),
        "same": f"{slurm['identical']} of {slurm['files']}",
        "version": slurm["versions"]["slurm"],
    }
