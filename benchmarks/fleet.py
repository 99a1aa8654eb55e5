"""What a fleet costs by its number of cylinders: ``python -m benchmarks.fleet --planned 10 100 --run 10``.

Planning is a dry run of a table with so many rows. Runs are of full length: two experiments of 20 s with five
seeds, the ten models at nine n. Times are of the processor, so that another load counts little.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from tests.checkout import copy_checkout
from tests.fleet import SHORT, write_fleet

NODES, CORES = 100, 4  # of the estimate: a job of the Slurm profile has a node's four cores
LARGEST = 10_000


class Cost(NamedTuple):
    """What a process and all that it waited for took."""

    wall_s: float
    cpu_s: float
    peak_MB: float  # of the largest process
    jobs: int


def snakemake(folder: Path, *arguments: str) -> Cost:
    """Plan or run the fleet in a copy of the checkout."""
    command = [sys.executable, "-m", "snakemake", "-j2", "--configfile", "fleet.yaml", *arguments]
    environment = os.environ | {"PYTHONPATH": str(folder)}
    begin = time.perf_counter()
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(
            command, cwd=folder, env=environment, stdout=output, stderr=subprocess.STDOUT
        )
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - begin
        output.seek(0)
        text = output.read()
    if status:
        raise SystemExit(text[-2000:])
    total = re.search(r"^total +(\d+)$", text, re.MULTILINE)
    cpu = usage.ru_utime + usage.ru_stime
    return Cost(wall, cpu, usage.ru_maxrss / 1e3, int(total.group(1)) if total else 0)


def size_of(folder: Path, pattern: str) -> int:
    """Bytes of all files that fit a pattern."""
    return sum(file.stat().st_size for file in folder.glob(pattern))


def main() -> None:
    """Print both tables and the estimate."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--planned", type=int, nargs="*", default=[10, 100, 1000, LARGEST])
    parser.add_argument("--run", type=int, nargs="*", default=[10])
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="fleet-") as scratch:
        folder = copy_checkout(Path(scratch, "checkout"))
        print("| cylinders | jobs | planning, wall (s) | planning, processor (s) | main process (MB) |")
        print("|---|---|---|---|---|")
        for count in options.planned:
            write_fleet(folder, count)
            cost = snakemake(folder, "-n", "--quiet", "rules")
            row = f"| {count} | {cost.jobs} | {cost.wall_s:.1f} | {cost.cpu_s:.1f} | {cost.peak_MB:.0f} |"
            print(row, flush=True)
        print("\n| cylinders run | core-seconds each | in all (s) | blocks (kB each) | index (kB each) |")
        print("|---|---|---|---|---|")
        if options.run:  # compile first
            write_fleet(folder, 1, SHORT)
            snakemake(folder)
        each = 0.0
        for count in options.run:
            write_fleet(folder, count)
            cost = snakemake(folder, "--forceall")
            each, results = cost.cpu_s / count, folder / "results"
            blocks, index = (size_of(results, pattern) for pattern in ("fleet/*.nc", "fleet.*"))
            kB = f"{blocks / count / 1e3:.1f} | {index / count / 1e3:.1f}"
            print(f"| {count} | {each:.2f} | {cost.cpu_s:.0f} | {kB} |", flush=True)
            for file in results.glob("fleet/*.nc"):
                file.unlink()
        if each:
            hours = each * LARGEST / 3600
            minutes = each * LARGEST / (NODES * CORES) / 60
            print(f"\n{LARGEST} cylinders: {hours:.1f} core-hours, {minutes:.1f} min of {NODES} nodes")


if __name__ == "__main__":
    main()
