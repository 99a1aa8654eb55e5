"""Seals of results files: the SHA-256 of the content at its end, so that no damaged or cut file is read.

NetCDF readers ignore bytes behind the end of the HDF5 data; in JSON the seal is one more member.
"""

import hashlib
import os
from pathlib import Path
from typing import BinaryIO

from pneumo.errors import DamagedError
from pneumo.regular_file import regular_file

SEALED_JSON = ("parameters.json", "verdict.json", "findings.json")
LARGEST_RESULT = 50_000_000_000  # bytes; the study's largest has 92 million
LARGEST_JSON = 100_000_000  # bytes, read as a whole
BLOCK = 1 << 20  # bytes hashed at a time

# Before and after the digits.
SEALS = {".nc": (b"\nsha256 ", b"\n"), ".json": (b',\n "sha256": "', b'"\n}\n')}


def sealed_files(folder: Path) -> list[Path]:
    """Return the files under a folder of results that end with a SHA-256: those that jobs read."""
    return sorted([*folder.rglob("*.nc"), *(file for name in SEALED_JSON for file in folder.rglob(name))])


def seal(file: Path, kind: str) -> None:
    """Append the seal, the SHA-256 of its content, to a ``.nc`` or ``.json`` file.

    The file lacks only its seal; a JSON object also its closing brace.
    """
    before, after = SEALS[kind]
    with file.open("r+b") as opened:
        digest = hashlib.file_digest(opened, "sha256").hexdigest()
        opened.write(before + digest.encode() + after)


def check_seal(path: Path) -> None:
    """Raise `DamagedError` if a sealed file's SHA-256 is missing or belongs to other content."""
    with regular_file(path, LARGEST_RESULT) as file:
        _check_end(path, file)


def unsealed(path: Path) -> bytes:
    """Return the content of a sealed JSON file without its seal, after `check_seal`."""
    with regular_file(path, LARGEST_JSON) as file:
        length = _check_end(path, file)
        file.seek(0)
        return file.read(length)


def _check_end(path: Path, file: BinaryIO) -> int:
    """Return the number of bytes before the seal."""
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
