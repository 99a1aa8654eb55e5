"""A copy of this checkout in another folder, for tests, faults and the bench."""

import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
PNEUMO = (sys.executable, "-c", "from pneumo.cli import main; main()")
SOURCES = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
CACHES = (".venv", ".snakemake", "pneumo.egg-info", "paper_verdict.egg-info", "__pycache__")
MADE = {"results", "site", "jupyter_execute", "build", "dist", *CACHES}


def sources() -> list[str]:
    """Files that git lists or would add; in an unpacked sdist all but generated ones."""
    if (ROOT / ".git").exists():
        listed = subprocess.run(SOURCES, cwd=ROOT, capture_output=True, check=True).stdout.decode()
        return [name for name in listed.split("\0") if name and (ROOT / name).is_file()]
    files = (file.relative_to(ROOT) for file in ROOT.rglob("*") if file.is_file())
    return ["results/README.md", *(str(file) for file in files if not MADE & set(file.parts))]


def copy_checkout(folder: Path) -> Path:
    """Copy every file of the project, and the core as it is compiled; return the folder."""
    for name in (*sources(), *(str(file.relative_to(ROOT)) for file in ROOT.glob("pneumo/core/_core*.so"))):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    return folder


def edit(file: Path, old: str, new: str) -> str:
    """Replace text in a file; return the file's text from before."""
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")
    return text
