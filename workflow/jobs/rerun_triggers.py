"""Sources that a rule uses, which Snakemake watches besides the rule's inputs."""

import hashlib
import re
from functools import cache
from pathlib import Path

IMPORTED = re.compile(
    r"^ *(?:from|import) ((?:pneumo|paper|paper_verdict)\.[\w.]+)(?: import ([\w, ]+|\([^)]*))?", re.M
)
BESIDE = (
    "build.py",
    "*.[ch]",
    "*.csv",
    "*.mplstyle",
    "page.*s",
    "templates/**/*.*",
)  # what modules read in their folders

VERDICT = Path("paper-verdict/src")  # a distribution of its own


def sha256_of(*files: str) -> str:
    """Return the SHA-256 of files and their `sources`.

    As a parameter of the rule it makes Snakemake run the rule again after an edit.
    """
    digest = hashlib.sha256()
    for file in sorted(sources(*map(Path, files))):
        digest.update(f"{file.as_posix()}\0{file.stat().st_size}\0".encode() + file.read_bytes())
    return digest.hexdigest()


def sources(*files: Path) -> set[Path]:
    """Files, all of this project that they import, and the data beside those modules."""
    used, new = set[Path](), {*files}
    while new:
        used |= new
        new = set[Path]().union(*map(_used, new)) - used
    return used


@cache
def _used(file: Path) -> set[Path]:
    if file.suffix != ".py":
        return set()
    used = set[Path]().union(*map(file.parent.glob, BESIDE))
    for module, names in IMPORTED.findall(file.read_text(encoding="utf-8")):
        path = Path(*module.split("."))
        if path.parts[0] == "paper_verdict":
            path = VERDICT / path
        for each in (path, *(path / name for name in re.findall(r"\w+", names))):
            used |= {*filter(Path.is_file, (each.with_suffix(".py"), each / "__init__.py"))}
    return used
