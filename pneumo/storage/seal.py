"""A results file ends with the SHA-256 of all before it: nothing damaged, cut or foreign is read as truth.

NetCDF readers pass over what stands behind the last byte that HDF5 knows of; in JSON it is one more member.
"""

import hashlib
from pathlib import Path

from pneumo.errors import DamagedError

SEALS = {".nc": (b"\nsha256 ", b"\n"), ".json": (b',\n "sha256": "', b'"\n}\n')}  # around the digits


def seal(file: Path, kind: str) -> None:
    """Append the seal to a file that is being written.

    Parameters
    ----------
    file : pathlib.Path
        Complete but for its seal; a JSON object lacks its closing brace.
    kind : str
        ``.nc`` or ``.json``.
    """
    before, after = SEALS[kind]
    with file.open("r+b") as opened:
        digest = hashlib.file_digest(opened, "sha256").hexdigest()
        opened.write(before + digest.encode() + after)


def unsealed(path: Path) -> bytes:
    """Content of a sealed file without its seal.

    Raises
    ------
    DamagedError
        If the seal is missing or belongs to other content.
    """
    before, after = SEALS[path.suffix]
    content = path.read_bytes()
    cut = max(0, len(content) - len(before) - 64 - len(after))
    body, end = content[:cut], content[cut:]
    if not (end.startswith(before) and end.endswith(after)):
        raise DamagedError(path, "does not end with its SHA-256: truncated, or not made by this workflow")
    if end != before + hashlib.sha256(body).hexdigest().encode() + after:
        raise DamagedError(path, "damaged: its SHA-256 is not the one written at its end")
    return body
