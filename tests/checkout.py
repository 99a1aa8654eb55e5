"""A copy of this checkout in another folder, for tests, faults and the bench."""

import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCES = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")


def copy_checkout(folder: Path) -> Path:
    """Copy every file that git knows or would add, thus no results; return the folder."""
    listed = subprocess.run(SOURCES, cwd=ROOT, capture_output=True, check=True).stdout.decode()
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
    return folder
