"""The verdict stored in a folder of results, if it was made from the files that are there now.

Imports nothing slow: showing a stored verdict takes less time than the imports for judging.
"""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pneumo.errors import DamagedError
from pneumo.hashing import code_hash
from pneumo.regular_file import regular_file
from pneumo.storage.kept_evidence import KEPT
from pneumo.storage.seal import LARGEST_RESULT, unsealed

OF_PAPER = ("*.yaml", "published/*.csv", "seed_deviations.csv")  # what a verdict reads
OF_EVIDENCE = ("assumptions.nc", "seed_sets.nc")
SEAL = 100  # bytes at the end of a results file, among them its SHA-256


def hashes_behind_verdict(results: Path, paper: Path, module: str, reads: Sequence[str]) -> dict[str, str]:
    """Return the hashes of code and inputs of a verdict, by their names in ``verdict.json``.

    The code is the module that makes the verdict, with all that it imports; the inputs are the paper's files
    and the seals of the results that match one of the patterns `reads`.
    """
    digest = hashlib.sha256()
    for folder, patterns in ((paper, OF_PAPER), (results, reads), (KEPT, OF_EVIDENCE)):
        for file in sorted(file for pattern in patterns for file in folder.glob(pattern)):
            content = file.read_bytes() if folder == paper else _end(file)
            digest.update(str(file.relative_to(folder)).encode() + b"\0" + content + b"\0")
    return {"code_sha256": code_hash(module), "inputs_sha256": digest.hexdigest()}


def _end(file: Path) -> bytes:
    with regular_file(file, LARGEST_RESULT) as opened:
        opened.seek(max(0, file.stat().st_size - SEAL))
        return opened.read()


def stored_verdict(results: Path, paper: Path, module: str, reads: Sequence[str]) -> dict[str, Any] | None:
    """Content of ``verdict.json``; None if it is missing, damaged or made from other files or code.

    The arguments are those of `hashes_behind_verdict`.
    """
    try:
        stored: dict[str, Any] = json.loads(unsealed(results / "verdict.json") + b"}")
    except (OSError, DamagedError, ValueError):
        return None
    current = hashes_behind_verdict(results, paper, module, reads).items()
    return stored if current <= stored.items() else None
