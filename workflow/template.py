"""Write a repository that judges another paper in CI: ``make template FOLDER=../my-paper``.

It holds a paper that is made up, to be replaced. PNEUMO is the requirement by which its CI installs pneumo,
such as ``pneumo @ git+ADDRESS``.
"""

import subprocess
import sys
from pathlib import Path
from shutil import copytree, ignore_patterns, which

TEMPLATE = Path(__file__).with_name("template")


def write_template(folder: Path, requirement: str) -> None:
    """Copy the template into a new folder and make that a Git repository; `SystemExit` if it holds files."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise SystemExit(f"{folder}: must be a new or an empty folder")
    copytree(TEMPLATE, folder, dirs_exist_ok=True, ignore=ignore_patterns("__pycache__", "out"))
    (folder / "requirements.txt").write_text(f"{requirement}\n", encoding="utf-8")
    if which("git"):
        subprocess.run(["git", "init", "--quiet", str(folder)], check=True)


if __name__ == "__main__":
    if len(sys.argv) != 3 or not sys.argv[1]:
        raise SystemExit("make template: needs FOLDER=PATH, a new folder")
    write_template(Path(sys.argv[1]), sys.argv[2])
    print(f"{sys.argv[1]}: run `python judge.py` there; its README.md says what to replace")
