"""Draw the schemes: figures that need no results."""

from pathlib import Path

from pneumo.jobs.wrapper import logged
from pneumo.publish.schemes import SCHEMES
from pneumo.publish.style import save


def main(folder: Path) -> None:
    for name, draw in SCHEMES.items():
        save(draw(), folder / name)


if job := globals().get("snakemake"):
    with logged(job):
        main(Path(job.output[0]).parent)
