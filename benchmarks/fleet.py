"""Cost of a fleet: ``python -m benchmarks.fleet`` measures it and writes docs/static/fleet.json.

Planning is a dry run of a table with so many rows. Runs are of full length: two experiments of 20 s with five
seeds, the ten models at nine n; blocks of different sizes separate the cost of a job from that of a cylinder.
Sizes are those of these runs and of a larger fleet of short runs, which store as many cells. Seconds are
processor time, which other load hardly changes; `benchmarks.fleet_law` fits the law.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.bench import cpu
from benchmarks.fleet_law import law, minutes, rows
from benchmarks.fleet_table import SHORT, write_fleet
from pneumo.storage.files import write_text
from tests.checkout import ROOT, copy_checkout

LARGE_BLOCK = 20
RUNS = ((5, 1), (5, 5), (10, 10), (20, 10))  # cylinders, and how many of them are a block
LARGE = 200  # cylinders of the fleet whose size counts


def snakemake(folder: Path, *arguments: str) -> dict[str, Any]:
    """Plan or run the fleet in a copy of the checkout; return time and memory with its subprocesses."""
    command = [sys.executable, "-m", "snakemake", "-j2", "--configfile", "fleet.yaml", *arguments]
    path = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])
    launched = [sys.executable, str(Path(__file__).with_name("used.py")), *command]
    done = subprocess.run(
        launched, cwd=folder, env=os.environ | {"PYTHONPATH": path}, check=True, stdout=subprocess.PIPE
    )
    report = json.loads(done.stdout)
    if report["code"]:
        raise SystemExit(report["output"][-2000:])
    # Snakemake prints its table of jobs twice.
    table = dict(re.findall(r"^(fleet_block|fleet_index) +(\d+)$", report["output"], re.MULTILINE))
    return report["costs"] | {"jobs": sum(map(int, table.values()))}


def planned(folder: Path, count: int) -> dict[str, Any]:
    """Return the cost of planning."""
    write_fleet(folder, count)
    return {"cylinders": count} | snakemake(folder, "-n", "--quiet", "rules")


def run(folder: Path, count: int, lines: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the cost of a run, and the size of its results."""
    write_fleet(folder, count, lines)
    results = folder / "results"
    for file in results.glob("fleet/*.nc"):
        file.unlink()
    cost = {"cylinders": count} | snakemake(folder, "--forceall")
    size: dict[str, Any] = {"cylinders": count, "blocks": cost["jobs"] - 1}
    for name, pattern in (("blocks_kB", "fleet/*.nc"), ("index_kB", "fleet.*")):
        size[name] = sum(file.stat().st_size for file in results.glob(pattern)) / 1e3
    return cost, size


def main() -> None:
    """Measure, write and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--planned", type=int, nargs="+", default=[10, 100, 1000, 10_000])
    parser.add_argument("--json", type=Path, default=ROOT / "docs/static/fleet.json")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="fleet-") as scratch:
        folder = copy_checkout(Path(scratch, "checkout"))
        measured: dict[str, Any] = {"cpu": cpu(), "planned": [planned(folder, n) for n in options.planned]}
        print(*measured["planned"], sep="\n", flush=True)
        write_fleet(folder, 1, SHORT)
        snakemake(folder)  # compile first
        measured |= {"runs": [], "sizes": []}
        for count, block in RUNS:
            cost, size = run(folder, count, f"\n  block_size: {block}")
            measured["runs"].append(cost | {"per_job": block})
            print(measured["runs"][-1], size, flush=True)
            measured["sizes"].append(size)
        measured["sizes"].append(run(folder, LARGE, f"{SHORT}\n  block_size: {LARGE_BLOCK}")[1])
    write_text(json.dumps(measured, indent=1) + "\n", options.json)
    print(law(measured), *rows(measured), f"{minutes(measured):.1f} min on a cluster", sep="\n")


if __name__ == "__main__":
    main()
