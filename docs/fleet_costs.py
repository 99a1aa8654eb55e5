"""Tables, numbers and figure of cluster.md from static/: `python docs/fleet_costs.py` writes them anew.

static/fleet.json is from `python -m benchmarks.fleet`, static/slurm.json from results/evidence/slurm.json.
"""

import json
import shutil
import tempfile
from pathlib import Path
from typing import Any

from fragments import filled, table

from benchmarks.fleet_law import law, law_figure, minutes, rows
from pneumo.publish.style import save

PAGE = Path(__file__).with_name("cluster.md")
STATIC = Path(__file__).with_name("static")
SLURM = Path(__file__).parents[1] / "results" / "evidence" / "slurm.json"


def stored(name: str) -> dict[str, Any]:
    """What was measured: fleet or slurm."""
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
    """Table of what was done to which job, and how it and the one in its place ended."""
    body: list[list[str]] = []
    for what, job in found["disturbed"].items():
        tries = [each for each in found["jobs"] if each["task"] == job["task"]]
        ends = [f"{each['state'].lower()} (limit {each['time_limit']})" for each in tries]
        body.append([what, f"`{job['task'].split('_')[-1]}`", ", then ".join(ends)])
    return table(["what", "block", "how Slurm says that its jobs ended"], body)


def refreshed(text: str, fleet: dict[str, Any], slurm: dict[str, Any]) -> str:
    """The page with everything between markers made anew; `KeyError` if a marker's name is unknown."""
    one, last, found = law(fleet), rows(fleet)[-1], slurm["slurm"]
    results = {
        "processor": fleet["cpu"],
        "cylinder": f"{one.cylinder_s:.1f}",
        "job": f"{one.job_s:.0f}",
        "block kB": f"{one.block_kB:.0f}",
        "file kB": f"{one.file_kB:.0f}",
        "index kB": f"{one.index_kB:.1f}",
        "hours": f"{last['core_h']:.0f}",
        "minutes": f"{minutes(fleet):.1f}",
        "cylinders": str(slurm["cylinders"]),
        "per job": str(slurm["per_job"]),
        "simulated": str(slurm["simulated_s_per_run"]),
        "local": f"{slurm['local_wall_s'] / 60:.1f}",
        "remote": f"{found['wall_s'] / 60:.1f}",
        "jobs": str(len(found["jobs"])),
        "retries": str(found["retries"]),
        "same": f"{slurm['identical']} of {slurm['files']}",
        "version": slurm["versions"]["slurm"],
    }
    return filled(text, {"table": {"costs": costs(fleet), "slurm": disturbances(found)}, "result": results})


if __name__ == "__main__":
    if SLURM.exists():
        shutil.copyfile(SLURM, STATIC / "slurm.json")
    PAGE.write_text(
        refreshed(PAGE.read_text(encoding="utf-8"), stored("fleet"), stored("slurm")), encoding="utf-8"
    )
    with tempfile.TemporaryDirectory() as scratch:
        svg, _ = save(law_figure(stored("fleet")), Path(scratch, "fleet"))
        shutil.copyfile(svg, STATIC / "fleet.svg")
