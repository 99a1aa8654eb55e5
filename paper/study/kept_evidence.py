"""Evidence: files that take hours to make, in results or, where these lack them, kept with the source."""

import json
import os
from collections.abc import Mapping
from pathlib import Path

from pneumo.configuration.experiment import Study
from pneumo.regular_file import LARGEST_RESULT, regular_file

KEPT = Path(__file__).resolve().parents[1] / "evidence"
NO_CONFIGURATION = "none: "  # begins `config_sha256` of evidence that no configuration made


def evidence_file(results: Path, name: str, config_sha256: str = "") -> Path | None:
    """Path of a file of evidence, such as ``findings.json``; None if there is none.

    It is the file in the folder of results or, without one there, the file kept in paper/evidence/. With
    `config_sha256`, files that were made from another configuration are ignored.
    """
    files = (file for file in (results / name, KEPT / name) if file.exists())
    return next((file for file in files if not config_sha256 or _made_from(file, config_sha256)), None)


def evidence_for(results: str, study: Study, name: str) -> list[str]:
    """Return the file of evidence that was made from this configuration in a list, which may be empty."""
    file = evidence_file(Path(results), name, study.config_sha256)
    return [] if file is None else [os.path.relpath(file)]


def kept_or_made(results: str, study: Study, name: str) -> str:
    """Return the path of evidence made from this configuration, else where it will be made."""
    return (evidence_for(results, study, name) or [f"{results}/{name}"])[0]


def made(file: Path) -> str:
    """Text that says when and from which configuration a file of evidence was made."""
    about = _about(file)
    day, configuration = about.get("date_created"), about["config_sha256"]
    parts = [f"made on {day}" if day else "made in this folder"]
    if not configuration.startswith(NO_CONFIGURATION):
        parts.append(f"from the configuration {configuration[:8]}")
    return f"{file.name}: {' '.join(parts)}"


def _made_from(file: Path, config_sha256: str) -> bool:
    try:
        source = _about(file)["config_sha256"]
        return source == config_sha256 or source.startswith(NO_CONFIGURATION)
    except (OSError, AttributeError, LookupError, TypeError, ValueError):
        return True  # damaged or foreign: what reads it refuses it


def _about(file: Path) -> Mapping[str, str]:
    """Attributes of a file of evidence: hashes of its configuration and code, perhaps its date."""
    with regular_file(file, LARGEST_RESULT) as opened:
        if file.suffix == ".json":
            return json.load(opened)
    from netCDF4 import Dataset  # here, since showing a stored verdict needs none of it

    with Dataset(file.absolute()) as dataset:
        return dataset.__dict__
