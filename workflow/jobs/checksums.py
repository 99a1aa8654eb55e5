"""``SHA256SUMS`` of a folder of files, as ``sha256sum`` writes and checks it."""

import hashlib
from pathlib import Path

from pneumo.errors import ResultError

SUMS = "SHA256SUMS"


def write_sums(folder: Path) -> None:
    """Write ``SHA256SUMS`` of all files in a folder of results but README, logs and measured evidence.

    The digest of a file that is older than the list is kept, so that damage stays visible.
    """
    file, lines = folder / SUMS, list[str]()
    listed, written = (_listed(folder), file.stat().st_mtime_ns) if file.exists() else ({}, 0)
    for path in sorted(each for each in folder.rglob("*") if each.is_file()):
        name = path.relative_to(folder).as_posix()
        if name in (SUMS, "README.md") or name.startswith(("logs/", "evidence/")):
            continue
        kept = listed.get(name) if path.stat().st_mtime_ns <= written else None
        lines.append(f"{kept or _digest(path)}  {name}\n")
    file.write_text("".join(lines), encoding="utf-8")


def unlike_sums(folder: Path) -> tuple[int, list[str]]:
    """Return how many files ``SHA256SUMS`` lists, and the names of those that are missing or changed.

    Raises
    ------
    ResultError
        If the folder has no ``SHA256SUMS``.
    """
    if not (folder / SUMS).exists():
        raise ResultError(f"{folder}: holds no {SUMS}; `snakemake -j2` makes the results")
    listed = _listed(folder)
    unlike = [name for name, digest in listed.items() if _digest(folder / name) != digest]
    return len(listed), unlike


def _listed(folder: Path) -> dict[str, str]:
    lines = (folder / SUMS).read_text(encoding="utf-8").splitlines()
    return {name: digest for digest, _, name in (line.partition("  ") for line in lines)}


def _digest(path: Path) -> str:
    if not path.is_file():
        return "missing"
    with path.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()
