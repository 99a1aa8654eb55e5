"""The whole study, run as a user runs it, in a copy of this folder: anew, and with nothing to do."""

import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from tests.checkout import copy_checkout

ARGUMENTS = ("-m", "snakemake", "-j2")
STARTED = re.compile(r"^Job (\d+): ")
FINISHED = re.compile(r"^Finished jobid: (\d+) \(Rule: (\w+)\)")


def snakemake(folder: Path, *arguments: str) -> dict[str, Any]:
    """Run the workflow.

    Returns
    -------
    dict
        ``wall_s``; ``stages_s``, from the start of each job to its end; ``peak_memory_gib`` of the
        biggest process.
    """
    environment = os.environ | {"PYTHONPATH": str(folder)}
    begin = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, *ARGUMENTS, *arguments],
        cwd=folder,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    started, stages, lines = {}, {}, []
    for line in process.stderr:
        now = time.perf_counter() - begin
        lines.append(line)
        if match := STARTED.match(line):
            started[match.group(1)] = now
        elif (match := FINISHED.match(line)) and match.group(1) in started:  # rule all has no job
            stages[match.group(2)] = now - started[match.group(1)]
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - begin
    if status:
        raise RuntimeError(f"snakemake stopped with an error:\n{''.join(lines[-30:])}")
    return {"wall_s": wall, "stages_s": stages, "peak_memory_gib": usage.ru_maxrss / 2**20}


def run_study(*arguments: str) -> dict[str, Any]:
    """Run the study in a temporary folder twice: anew, and with nothing to do.

    Parameters
    ----------
    *arguments : str
        More for snakemake: another configuration.
    """
    with tempfile.TemporaryDirectory(prefix="pneumo-bench-") as temporary:
        folder = copy_checkout(Path(temporary, "pneumo"))
        runs = {name: snakemake(folder, *arguments) for name in ("all", "nothing to do")}
        stages = runs["all"]["stages_s"]
        size = sum(file.stat().st_size for file in (folder / "results").rglob("*") if file.is_file())
    return {
        "wall_s": {name: run["wall_s"] for name, run in runs.items()},
        "stages_s": stages,
        "replay_wall_s": stages["replay"] + stages["statistics"],
        "peak_memory_gib": max(run["peak_memory_gib"] for run in runs.values()),
        "results_mb": size / 1e6,
    }
