"""What makes Snakemake run a rule again beside its inputs: imported code, and evidence found in results."""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path

from pneumo.configuration.experiment import Study
from pneumo.hashing import code_hash, imports_of


def code_behind(script: str, *modules: str) -> str:
    """Return the SHA-256 of every pneumo module that a workflow script imports, directly or not.

    Snakemake sees edits of a script but not of what it imports; with the hash as a parameter it runs the rule
    again. `modules` are those that the script imports by name at run time.
    """
    return code_hash(*imports_of(Path("workflow/scripts", script)), *modules)


def evidence_for(study: Study, *files: str) -> list[str]:
    """Return the files of evidence that exist and were made from this configuration."""
    return [file for file in files if Path(file).exists() and _made_from(study, file)]


def fingerprints(files: Sequence[str]) -> dict[str, str]:
    """Return the SHA-256 of each file, for a rule that reads files which are not its inputs."""
    return {file: hashlib.sha256(Path(file).read_bytes()).hexdigest() for file in files}


def _made_from(study: Study, file: str) -> bool:
    from netCDF4 import Dataset  # here, since few runs have evidence

    try:
        if file.endswith(".json"):
            return json.loads(Path(file).read_bytes())["config_sha256"] == study.config_sha256
        with Dataset(Path(file).absolute()) as dataset:
            return dataset.config_sha256 == study.config_sha256
    except (OSError, AttributeError, LookupError, TypeError, ValueError):
        return True  # damaged or foreign: the job that reads it refuses it
