"""Seals of results files: the SHA-256 of the content at its end, so that no damaged or cut file is read.

NetCDF readers ignore bytes behind the end of the HDF5 data; in JSON the seal is one more member. Pages,
figures and tables have no seal: the log of the job that made them has their SHA-256.
"""

import hashlib
import os
import re
from collections.abc import Iterable
from pathlib import Path
from typing import BinaryIO

from pneumo.errors import DamagedError
from pneumo.regular_file import regular_file

LISTED = re.compile(r"^([0-9a-f]{64})  (results(?:-[^/]+)?/.+)$", re.MULTILINE)
SEALED_JSON = ("parameters.json", "verdict.json", "findings.json")
LARGEST_RESULT = 50_000_000_000  # bytes; the study's largest has 92 million
LARGEST_JSON = 100_000_000  # bytes, read as a whole
BLOCK = 1 << 20  # bytes hashed at a time

# Before and after the digits.
SEALS = {".nc": (b"\nsha256 ", b"\n"), ".json": (b',\n "sha256": "', b'"\n}\n')}


def sealed_files(folder: Path) -> list[Path]:
    """Files under a folder of results that end with their SHA-256: those that jobs read, sorted."""
    return sorted([*folder.rglob("*.nc"), *(file for name in SEALED_JSON for file in folder.rglob(name))])


def hashes_without_seal(files: Iterable[Path]) -> str:
    """Lines as from ``sha256sum`` for those of the files that do not contain their own SHA-256."""
    others = (
        file for file in files if file.suffix != ".nc" and file.name not in SEALED_JSON and file.is_file()
    )
    return "".join(f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file}\n" for file in others)


def manifest(results: Path) -> dict[Path, str]:
    """SHA-256 of each page, figure and table when it was made, from the logs of the jobs."""
    logs = sorted(results.glob("logs/**/*.log"), key=lambda log: log.stat().st_mtime)
    lines = (
        line for log in logs for line in LISTED.findall(log.read_text(encoding="utf-8", errors="replace"))
    )
    return {results.joinpath(*Path(name).parts[1:]): digest for digest, name in lines}


def sha256_lines(files: Iterable[Path], root: Path) -> str:
    """Lines for ``sha256sum --check``, run in the folder `root`, of files below it, sorted by name."""
    lines: list[str] = []
    for file in sorted(files):
        with regular_file(file, LARGEST_RESULT) as opened:
            digest = hashlib.sha256(opened.read()).hexdigest()
        lines.append(f"{digest}  {file.relative_to(root)}\n")
    return "".join(lines)


def changed(results: Path) -> list[DamagedError]:
    """Errors, one for each page, figure or table of `manifest` that has changed or is missing."""
    errors: list[DamagedError] = []
    for file, digest in manifest(results).items():
        if not file.exists():
            errors.append(DamagedError(file, "missing: the log of its job lists it"))
            continue
        with regular_file(file, LARGEST_RESULT) as opened:
            if hashlib.sha256(opened.read()).hexdigest() != digest:
                errors.append(DamagedError(file, "damaged: its SHA-256 is not the one in the log of its job"))
    return errors


def without_hash(results: Path) -> list[Path]:
    """Files of results whose SHA-256 is neither in themselves nor in a log; logs and README are left out."""
    known = {*sealed_files(results), *manifest(results), results / "README.md"}
    files = {f for f in results.rglob("*") if f.is_file() and not f.is_relative_to(results / "logs")}
    return sorted(files - known)


def seal(file: Path, kind: str) -> None:
    """Append to a file the SHA-256 of its content; `kind` is ".nc" or ".json".

    A JSON file is given without its closing brace, which is appended too.
    """
    before, after = SEALS[kind]
    with file.open("r+b") as opened:
        digest = hashlib.file_digest(opened, "sha256").hexdigest()
        opened.write(before + digest.encode() + after)


def check_seal(path: Path) -> None:
    """Raise `DamagedError` if the SHA-256 at the end of a file is missing or not that of its content."""
    with regular_file(path, LARGEST_RESULT) as file:
        _check_end(path, file)


def unsealed(path: Path) -> bytes:
    """Content of a JSON file before the SHA-256 at its end, which is checked."""
    with regular_file(path, LARGEST_JSON) as file:
        length = _check_end(path, file)
        file.seek(0)
        return file.read(length)


def _check_end(path: Path, file: BinaryIO) -> int:
    """Check the SHA-256 at the end of a file; return the number of bytes before it."""
    before, after = SEALS[path.suffix]
    length = max(0, os.fstat(file.fileno()).st_size - len(before) - 64 - len(after))
    digest, rest = hashlib.sha256(), length
    while block := file.read(min(BLOCK, rest)):
        digest.update(block)
        rest -= len(block)
    end = file.read(len(before) + 64 + len(after))
    if not (end.startswith(before) and end.endswith(after)):
        raise DamagedError(path, "does not end with its SHA-256: truncated, or not made by this workflow")
    if end != before + digest.hexdigest().encode() + after:
        raise DamagedError(path, "damaged: its SHA-256 is not the one written at its end")
    return length
