"""Run the simulated example of 2007 in every reading."""

from pathlib import Path

from paper.study.paper_2007.simulated_example import example
from pneumo.storage.files import attributes, write
from workflow.jobs.wrapper import run_job


def main(response: Path) -> None:
    summary = "A closed chamber pushed to mid-stroke, and what the seven steps make of it, by reading"
    write(example(), response, attributes("Simulated example", summary, "none"))


run_job(main, globals())
