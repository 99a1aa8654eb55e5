"""Rank the models on each cylinder and write the page."""

from pathlib import Path

from paper.study.stored_runs import read_study
from pneumo.publish.pages.study_page import study_page
from pneumo.selection.answer import answers
from pneumo.storage.files import read, write_text
from workflow.jobs.wrapper import run_job


def main(parameters: Path, cells: list[Path], page: Path) -> None:
    found = [answer for file in cells for answer in answers(read(file))]
    write_text(study_page(read_study(parameters), found), page)


run_job(main, globals())
