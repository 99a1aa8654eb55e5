"""Seals of results files: the SHA-256 of the content at its end, so that no damaged or cut file is read.

NetCDF readers ignore bytes behind the end of the HDF5 data; in JSON the seal is one more member.
"""

import hashlib
from pathlib import Path

from pneumo.errors import DamagedError

# Before and after the digits.
SEALS = {".nc": (b"\nsha256 ", b"\n"), ".json": (b',\n "sha256": "', b'"\n}\n')}


def seal(file: Path, kind: str) -> None:
    """Append the seal, the SHA-256 of its content, to a ``.nc`` or ``.json`` file.

    The file lacks only its seal; a JSON object also its closing brace.
    """
    before, after = SEALS[kind]
    with file.open("r+b") as opened:
        digest = hashlib.file_digest(opened, "sha256").hexdigest()
        opened.write(before + digest.encode() + after)


def unsealed(path: Path) -> bytes:
    """Return a sealed file's content; `DamagedError` if the seal is missing or belongs to other content."""
    before, after = SEALS[path.suffix]
    content = path.read_bytes()
    cut = max(0, len(content) - len(before) - 64 - len(after))
    body, end = content[:cut], content[cut:]
    if not (end.startswith(before) and end.endswith(after)):
        raise DamagedError(path, "does not end with its SHA-256: truncated, or not made by this workflow")
    if end != before + hashlib.sha256(body).hexdigest().encode() + after:
        raise DamagedError(path, "damaged: its SHA-256 is not the one written at its end")
    return body
