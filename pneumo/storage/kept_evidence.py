"""Evidence: files that take hours to make, in results or, where these lack them, kept with the source."""

import json
from pathlib import Path

KEPT = Path(__file__).resolve().parents[2] / "paper" / "evidence"


def evidence_file(results: Path, name: str, config_sha256: str) -> Path | None:
    """Return a file of evidence, such as ``findings.json``, that was made from a configuration.

    The one in a folder of results goes before the one that is kept with the source; None if neither is there.
    """
    files = (results / name, KEPT / name)
    return next((file for file in files if file.exists() and _made_from(file, config_sha256)), None)


def _made_from(file: Path, config_sha256: str) -> bool:
    from netCDF4 import Dataset  # here, since showing a stored verdict needs none of it

    try:
        if file.suffix == ".json":
            return json.loads(file.read_bytes())["config_sha256"] == config_sha256
        with Dataset(file.absolute()) as dataset:
            return dataset.config_sha256 == config_sha256
    except (OSError, AttributeError, LookupError, TypeError, ValueError):
        return True  # damaged or foreign: what reads it refuses it
