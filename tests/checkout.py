"""A copy of this checkout in another folder, for tests, faults and the bench."""

import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
PNEUMO = (
    sys.executable,
    "-c",
    "from pneumo.cli.commands import main; main()",
)  # in a process
SOURCES = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
MADE = (
    "jupyter_execute",
    ".venv",
    ".snakemake",
    "results",
    "site",
    "build",
    "dist",
    "pneumo.egg-info",
    "__pycache__",
)


def sources() -> list[str]:
    """Files that git knows or would add; where the sdist was unpacked, all but what was made there."""
    if (ROOT / ".git").exists():
        listed = subprocess.run(SOURCES, cwd=ROOT, capture_output=True, check=True).stdout.decode()
        return [name for name in listed.split("\0") if name and (ROOT / name).is_file()]
    files = (file.relative_to(ROOT) for file in ROOT.rglob("*") if file.is_file())
    return ["results/README.md", *(str(file) for file in files if not set(file.parts) & set(MADE))]


def copy_checkout(folder: Path) -> Path:
    """Copy every file of the project; return the folder."""
    for name in sources():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    return folder


def edit(file: Path, old: str, new: str) -> str:
    """Replace a text that the file has by another; return what was there before."""
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")
    return text
