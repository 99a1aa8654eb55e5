"""Draw the figure of measured records of closed chambers."""

from pathlib import Path

from paper.study.figures.measurements_figure import measurements_figure
from pneumo.publish.style import save
from pneumo.storage.files import read
from workflow.jobs.wrapper import run_job


def main(cells: Path, figure: list[Path]) -> None:
    save(measurements_figure(read(cells)), figure[0].with_suffix(""))


run_job(main, globals())
