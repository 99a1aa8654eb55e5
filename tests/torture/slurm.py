"""Run studies through the Slurm profile on a real Slurm of one node; compare the bytes with a local run.

``python -m tests.torture.slurm`` runs the smoke study. ``--cylinders 200`` runs a table of so many in blocks,
while a job is killed, another goes over its time limit and the node is drained. Its runs take `SHORT_S`: this
is about scheduling, not about numbers. Needs Snakemake's slurm executor, and what `slurm_node` does.
"""

import argparse
import json
import tempfile
import time
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pneumo.storage.files import write_text
from tests.fleet import SHORT, SHORT_S, write_fleet
from tests.torture.slurm_disturbances import DISTURBANCES, RETRIED, Disturbance, jobs, output_of
from tests.torture.slurm_node import cluster, why_not
from tests.torture.study import Study

OPTIONS = (
    *("--profile", "workflow/profiles/slurm", "--cores", "2"),
    *("--slurm-no-account", "--slurm-status-command", "squeue"),
    *("--slurm-init-seconds-before-status-checks", "2", "--seconds-between-status-checks", "1"),
)
LIMIT = ("timeout", "-k", "10", "3600")


def study(folder: Path, options: argparse.Namespace) -> Study:
    """Study of the configuration, or of short runs of a fleet in blocks."""
    if not options.cylinders:
        return Study(folder, options.config)
    fleet = Study(folder, "fleet.yaml")
    write_fleet(folder, options.cylinders, f"{SHORT}\n  block_size: {options.block}")
    return fleet


def on_slurm(remote: Study, log: Path, disturbances: Mapping[str, Disturbance]) -> dict[str, Any]:
    """Run a study on Slurm, disturb it, and return what happened; `log` takes Snakemake's output."""
    start = time.perf_counter()
    with log.open("w") as output:
        run = remote.start(*OPTIONS, before=LIMIT, output=output.fileno())
        try:
            done_to = {what: disturb(run)._asdict() for what, disturb in disturbances.items()}
            run.wait()
        finally:
            run.terminate()
    wall = time.perf_counter() - start
    if run.wait():
        raise SystemExit(log.read_text(encoding="utf-8"))
    all_jobs = jobs("all")
    retries = len(all_jobs) - len({job.task for job in all_jobs})
    listed = [job._asdict() for job in all_jobs]
    return {"wall_s": round(wall), "retries": retries, "disturbed": done_to, "jobs": listed}


def main() -> None:
    """Run the study both ways and compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--config", default="config/smoke.yaml", help="configuration on top of the paper's")
    parser.add_argument("--cylinders", type=int, default=0, help="instead: a table of so many, disturbed")
    parser.add_argument("--block", type=int, default=20, help="cylinders of the table in a job")
    parser.add_argument("--evidence", type=Path, help="JSON file for what was found")
    options = parser.parse_args()
    if reason := why_not():
        raise SystemExit(f"slurm-test: not run: {reason}")
    if options.cylinders:
        print(f"{options.cylinders} cylinders, runs of {SHORT_S} s: about scheduling, not about numbers")
    with tempfile.TemporaryDirectory(prefix="slurm-") as scratch:
        local, remote = (study(Path(scratch, name), options) for name in ("local", "remote"))
        start = time.perf_counter()
        done = local.run()
        if done.code:
            raise SystemExit(done.output)
        local_s = round(time.perf_counter() - start)
        print(f"local run: {local_s} s", flush=True)
        with cluster(Path(scratch)):
            disturbed = on_slurm(remote, Path(scratch, "log"), DISTURBANCES if options.cylinders else {})
            versions = {"slurm": output_of("sbatch", "--version").split()[-1]}
        versions |= {name: version(name) for name in ("snakemake", "snakemake-executor-plugin-slurm")}
        expected, hashes = local.hashes(), remote.hashes()
    same = sum(hashes.get(name) == digest for name, digest in expected.items())
    jobs, retries = len(disturbed["jobs"]), disturbed["retries"]
    print(f"run on Slurm: {disturbed['wall_s']} s, {jobs} jobs, {retries} of them retries")
    print(*(f"{what}: {job['task']}" for what, job in disturbed["disturbed"].items()), sep="\n")
    print(f"{same} of {len(expected)} files identical", flush=True)
    if options.evidence:
        size = {"cylinders": options.cylinders, "per_job": options.block, "simulated_s_per_run": SHORT_S}
        files = {"files": len(expected), "identical": same}
        record = {**size, **files, "local_wall_s": local_s, "slurm": disturbed, "versions": versions}
        write_text(json.dumps(record, indent=1) + "\n", options.evidence)
    if hashes != expected or disturbed["retries"] < (RETRIED if options.cylinders else 0):
        raise SystemExit("slurm-test: not the same files, or no retries")


if __name__ == "__main__":
    main()
