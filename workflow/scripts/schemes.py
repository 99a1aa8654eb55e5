"""Draw the schemes: figures that need no results."""

from pathlib import Path

from pneumo.jobs.wrapper import run_job
from pneumo.publish.schemes import SCHEMES
from pneumo.publish.style import save


def main(svg: list[Path]) -> None:
    for name, draw in SCHEMES.items():
        save(draw(), svg[0].parent / name)


run_job(main, globals())
