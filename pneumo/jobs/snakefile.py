"""What the Snakefile needs from the package: a folder to itself, a checked configuration, hashes of code."""

import fcntl
import hashlib
import json
import os
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from uuid import uuid4

from pneumo.configuration.experiment import Study
from pneumo.configuration.parameters import read_yaml, study, validated
from pneumo.errors import ConfigurationError
from pneumo.hashing import code_hash, imports_of
from pneumo.jobs.wrapper import JOBS_LOCK, RUN, RUN_LOCK

BASE = Path("config/paper.yaml")
RESULTS = Path("results")
DATED = ("results", "paper", "pneumo", "workflow")  # folders of files whose times Snakemake compares


def sole_run() -> None:
    """Make this the one run in this folder for as long as its process lives, and let killed runs' jobs end.

    Ends the process with exit code 2 and one line on standard error if another run is at work, or if
    results cannot be written.
    """
    RESULTS.mkdir(exist_ok=True)
    if not os.access(RESULTS, os.W_OK):
        print(f"pneumo: {RESULTS}: cannot be written; is it mounted read-only?", file=sys.stderr)
        sys.exit(2)
    RUN_LOCK.parent.mkdir(exist_ok=True)
    lock = os.open(RUN_LOCK, os.O_RDWR | os.O_CREAT)  # a number, which nothing closes before the process ends
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        print("pneumo: another run is at work in this folder; wait for it or stop it", file=sys.stderr)
        sys.exit(2)
    os.environ[RUN] = uuid4().hex
    os.ftruncate(lock, 0)
    os.pwrite(lock, os.environ[RUN].encode(), 0)
    with JOBS_LOCK.open("a") as jobs:
        try:
            fcntl.flock(jobs, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            print("pneumo: waiting for a job of a killed run to end", file=sys.stderr)
            fcntl.flock(jobs, fcntl.LOCK_EX)
    date_back()


def date_back() -> None:
    """Date files from the future to now, in their order.

    After the clock has jumped back, Snakemake would refuse every output that is older than its input.
    """
    now = time.time_ns()
    files = [file for folder in DATED for file in Path(folder).rglob("*") if file.is_file()]
    future = {file: date for file in files if (date := file.stat().st_mtime_ns) > now}
    for age, date in enumerate(sorted(set(future.values()), reverse=True)):
        for file in (file for file in future if future[file] == date):
            os.utime(file, ns=(now - age * 1000, now - age * 1000))


def checked_study(config: Mapping[str, Any], files: Sequence[Path], options: Mapping[str, Any]) -> Study:
    """Return the study that a merged Snakemake configuration describes.

    Ends the process with exit code 2 and one line on standard error if it describes none.

    Parameters
    ----------
    config : mapping
        The merged configuration.
    files : sequence of pathlib.Path
        Configuration files given on the command line.
    options : mapping
        Values given on the command line with ``--config``.
    """
    try:
        sources = [(os.path.relpath(file), read_yaml(file)) for file in (BASE, *files)]
        return study(validated(config, [*sources, ("--config", options)]))
    except ConfigurationError as error:
        print(f"pneumo: {error}", file=sys.stderr)
        sys.exit(2)


def own_cylinders(study: Study) -> list[str]:
    """Cylinders of a study, if an experiment of it is not the paper's: then the study is the user's own."""
    papers = read_yaml(BASE)["experiments"]
    if set(study.experiments) <= set(papers):
        return []
    return list(dict.fromkeys(e.cylinder for e in study.experiments.values()))


def evidence_for(study: Study, *files: str) -> list[str]:
    """Files of evidence that are there and were made from this very configuration."""
    return [file for file in files if Path(file).exists() and _is_about(study, file)]


def fingerprints(files: Sequence[str]) -> dict[str, str]:
    """SHA-256 of each file, for a rule that reads files without asking for them."""
    return {file: hashlib.sha256(Path(file).read_bytes()).hexdigest() for file in files}


def _is_about(study: Study, file: str) -> bool:
    from netCDF4 import Dataset  # here, since few runs have evidence

    try:
        if file.endswith(".json"):
            return json.loads(Path(file).read_bytes())["config_sha256"] == study.config_sha256
        with Dataset(os.path.abspath(file)) as dataset:
            return dataset.config_sha256 == study.config_sha256
    except (OSError, AttributeError, LookupError, TypeError, ValueError):
        return True  # damaged or foreign: the job that reads it says so


def code_behind(script: str) -> str:
    """SHA-256 of every pneumo module that a workflow script imports, directly or not.

    Snakemake sees edits of a script but not of what it imports; as a rule's parameter this makes
    it rerun the rule.
    """
    return code_hash(*imports_of(Path("workflow/scripts", script)))
