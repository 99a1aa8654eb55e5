"""Draw one figure from one file of results."""

from pathlib import Path
from pkgutil import resolve_name

from pneumo.publish.style import save
from pneumo.storage.files import read
from workflow.jobs.wrapper import run_job


def main(results: Path, draw: str, figure: list[Path]) -> None:
    save(resolve_name(draw)(read(results)), figure[0].with_suffix(""))


run_job(main, globals())
