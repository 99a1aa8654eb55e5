"""Copy the schemes beside the other figures."""

import shutil
from pathlib import Path

from workflow.jobs.wrapper import run_job


def main(schemes: list[Path], figures: list[Path]) -> None:
    for scheme, figure in zip(schemes, figures, strict=True):
        shutil.copyfile(scheme, figure)


run_job(main, globals())
