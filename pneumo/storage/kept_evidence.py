"""Evidence: files that take hours to make, in results or, where these lack them, kept with the source."""

import json
from collections.abc import Mapping
from pathlib import Path

from pneumo.regular_file import regular_file
from pneumo.storage.seal import LARGEST_JSON, LARGEST_RESULT, sha256_lines

KEPT = Path(__file__).resolve().parents[2] / "paper" / "evidence"
LIST = "SHA256SUMS"  # of the kept files, in the form of ``sha256sum``
NO_CONFIGURATION = "none: "  # begins `config_sha256` of evidence that no configuration made


def evidence_file(results: Path, name: str, config_sha256: str = "") -> Path | None:
    """Path of a file of evidence, such as ``findings.json``; None if there is none.

    It is the file in the folder of results or, without one there, the file kept in paper/evidence/. With
    `config_sha256`, files that were made from another configuration are ignored.
    """
    files = (file for file in (results / name, KEPT / name) if file.exists())
    return next((file for file in files if not config_sha256 or _made_from(file, config_sha256)), None)


def kept_files(folder: Path) -> list[Path]:
    """Files of evidence in a folder, sorted."""
    return sorted(file for file in folder.iterdir() if file.suffix in (".nc", ".json"))


def removed_unless_kept(damaged: Path) -> str:
    """Remove a damaged file, unless it is kept evidence, which takes hours to make; return the remedy."""
    if damaged.resolve().is_relative_to(KEPT):
        return f"`git checkout {KEPT.parent.name}/{KEPT.name}` restores it"
    damaged.unlink(missing_ok=True)
    return "removed, the next run makes it again"


def unlike_list(folder: Path) -> list[str]:
    """Names of kept files that are missing, not listed, or changed since they were listed, sorted."""
    with regular_file(folder / LIST, LARGEST_JSON) as opened:
        listed = set(opened.read().decode().splitlines())
    found = set(sha256_lines(kept_files(folder), folder).splitlines())
    return sorted({line.partition("  ")[2] for line in listed ^ found})


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
    with regular_file(file, LARGEST_JSON if file.suffix == ".json" else LARGEST_RESULT) as opened:
        if file.suffix == ".json":
            return json.load(opened)
    from netCDF4 import Dataset  # here, since showing a stored verdict needs none of it

    with Dataset(file.absolute()) as dataset:
        return dataset.__dict__
