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


def costs(fleet: dict[str, Any]) -> str:
    """Table of the law."""
    head = ["cylinders", "jobs", "planning (s of processor)", "main process (MB)", "results (MB)"]
    body = [
        [
            f"{row['cylinders']:.0f}",
            f"{row['jobs']:.0f}",
            f"{row['planning_s']:.1f}",
            f"{row['peak_MB']:.0f}",
            f"{row['disk_MB']:.3g}",
            f"{3600 * row['core_h']:.0f}",
        ]
        for row in rows(fleet)
    ]
    return table([*head, "all of it (core-seconds)"], body)


def disturbances(found: dict[str, Any]) -> str:
    """Table of the disturbed jobs, and how each of their tries ended."""
    body: list[list[str]] = []
    for disturbance, job in found["disturbed"].items():
        tries = [each for each in found["jobs"] if each["task"] == job["task"]]
        ends = [f"{each['state'].lower()} (limit {each['time_limit']})" for each in tries]
        body.append([disturbance, f"`{job['task'].split('_')[-1]}`", ", then ".join(ends)])
    return table(["disturbance", "block", "how Slurm says that its jobs ended"], body)


def tables(fleet: dict[str, Any], slurm: dict[str, Any]) -> dict[str, str]:
    """Tables of the page by name."""
    return {"costs": costs(fleet), "slurm": disturbances(slurm["slurm"])}


def numbers(fleet: dict[str, Any], slurm: dict[str, Any]) -> dict[str, str]:
    """Numbers in the page's sentences by name."""
    per_unit, largest, on_slurm = law(fleet), rows(fleet)[-1], slurm["slurm"]
    return {
        "processor": fleet["cpu"],
        "cylinder": f"{per_unit.cylinder_s:.1f}",
        "job": f"{per_unit.job_s:.0f}",
        "block kB": f"{per_unit.block_kB:.0f}",
        "file kB": f"{per_unit.file_kB:.0f}",
        "index kB": f"{per_unit.index_kB:.1f}",
        "hours": f"{largest['core_h']:.0f}",
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
