"""A copy of the checkout in a scratch folder, and its study: run it, disturb it, compare the bytes."""

import hashlib
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from tests.checkout import PNEUMO, copy_checkout

NOT_COMPARED = {"logs", "evidence", "SHA256SUMS", "README.md"}  # times, hosts, measurements


def compared_files(results: Path) -> list[str]:
    """Return the names of all files of a study that must not change, relative to its folder."""
    files = (file.relative_to(results) for file in results.rglob("*") if file.is_file())
    return sorted(str(file) for file in files if not NOT_COMPARED & set(file.parts))


class Done(NamedTuple):
    """How a run ended."""

    code: int
    output: str

    @property
    def refusal(self) -> str:
        """The last line for the user, or nothing."""
        lines = [line for line in self.output.splitlines() if line.startswith("pneumo: ")]
        return lines[-1].removeprefix("pneumo: ") if lines else ""


class Study:
    """A checkout's copy in a new folder and the study in it.

    The files of `config`, with spaces between, are merged over the paper's, `environment` over this process's
    variables.
    """

    def __init__(self, folder: Path, config: str, environment: Mapping[str, str] | None = None):
        files = config.split()
        self.folder = copy_checkout(folder)
        self.results = folder / "-".join(["results", *(Path(file).stem for file in files)])
        self.results.mkdir(exist_ok=True)
        self.command = [sys.executable, "-m", "snakemake", "--rerun-incomplete"]
        self.command += ["--configfile", *files] if files else []
        python_path = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
        self.environment = os.environ | {"PYTHONPATH": python_path} | dict(environment or {})
        self.options: dict[str, Any] = {"cwd": self.folder, "env": self.environment, "text": True}

    def start(
        self, *arguments: str, before: tuple[str, ...] = (), output: int = subprocess.DEVNULL
    ) -> subprocess.Popen[str]:
        """Start a run in a process group of its own; two jobs by default."""
        command = [*before, *self.command, *(arguments or ("-j2",))]
        own_group: dict[str, Any] = {"stderr": subprocess.STDOUT, "start_new_session": True}
        return subprocess.Popen(command, stdout=output, **own_group, **self.options)

    def run(self, *arguments: str, before: tuple[str, ...] = ()) -> Done:
        """Run to the end."""
        run = self.start(*arguments, before=before, output=subprocess.PIPE)
        output, _ = run.communicate()
        return Done(run.returncode, output)

    def pneumo(self, *arguments: str) -> Done:
        """Run a command of the package on this copy."""
        done = subprocess.run([*PNEUMO, *arguments], capture_output=True, **self.options)
        return Done(done.returncode, done.stdout + done.stderr)

    def hashes(self) -> dict[str, str]:
        """SHA-256 of every file of results that must not change."""
        names = compared_files(self.results)
        return {name: hashlib.sha256((self.results / name).read_bytes()).hexdigest() for name in names}

    def clear(self) -> None:
        """Remove results and the workflow's memory."""
        for entry in self.results.iterdir():
            if entry.name != "README.md":
                shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
        shutil.rmtree(self.folder / ".snakemake", ignore_errors=True)


def stop(run: subprocess.Popen[str], number: signal.Signals, *, with_jobs: bool, after: float) -> bool:
    """Signal a run after some seconds, alone or with its jobs; return whether it was still running."""
    try:
        run.wait(timeout=after)
        return False
    except subprocess.TimeoutExpired:
        os.killpg(run.pid, number) if with_jobs else run.send_signal(number)
        run.wait()
        return True
