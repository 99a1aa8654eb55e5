"""Sources that a rule uses, which Snakemake watches besides the rule's inputs."""

import hashlib
from functools import cache
from pathlib import Path

# Folders and files behind every simulated number.
SIMULATION = (
    *("pneumo/core", "pneumo/physics", "pneumo/catalogue", "pneumo/configuration"),
    *("pneumo/simulation", "pneumo/storage", "paper/study/stored_runs.py"),
)
# And behind what is judged, drawn or written.
ASSESSMENT = (
    *SIMULATION,
    *(f"pneumo/{room}" for room in ("statistics", "verdict", "equations", "linear", "export", "fitting")),
    *("pneumo/selection", "pneumo/publish", "paper/study"),
)
COMPILED = {".pyc", ".so", ".pyd"}


@cache
def sha256_of(*paths: str) -> str:
    """Return the SHA-256 of files, and of all sources in folders, that a rule uses without naming them.

    As a parameter of the rule it makes Snakemake run the rule again after an edit.
    """
    if len(paths) != 1:
        return hashlib.sha256("".join(map(sha256_of, paths)).encode()).hexdigest()
    path, digest = Path(*paths), hashlib.sha256()
    for file in sorted(filter(Path.is_file, path.rglob("*"))) if path.is_dir() else [path]:
        if file.suffix not in COMPILED:
            digest.update(f"{file.as_posix()}\0{file.stat().st_size}\0".encode() + file.read_bytes())
    return digest.hexdigest()
