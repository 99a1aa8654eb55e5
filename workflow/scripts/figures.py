"""Draw Figures 7 to 11 and the time traces."""

from pathlib import Path

from paper.study.figures.saved_figures import save_figures
from workflow.jobs.wrapper import run_job


def main(svg: list[Path]) -> None:
    save_figures(svg[0].parents[1])


run_job(main, globals())
