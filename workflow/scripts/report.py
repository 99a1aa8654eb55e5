"""Write the page to explore the study with."""

from pathlib import Path

from paper.study.kept_evidence import made
from paper.study.pages.report_page import report_page, stored_parts
from paper.study.stored_runs import read_json, read_study
from pneumo.storage.files import write_text
from workflow.jobs.wrapper import run_job


def main(
    parameters: Path,
    verdict: list[Path],
    findings: list[Path],
    manuscript: bool,
    page: Path,
) -> None:
    """Write the page; `verdict` and `findings` list at most one file each."""
    study, statements = read_study(parameters), None
    judged = read_json(verdict[0]) if verdict else None
    for file in findings:
        statements = read_json(file)
        statements["made"] = made(file)
    text = report_page(study, stored_parts(study, parameters.parent), judged, statements, manuscript)
    write_text(text, page)


run_job(main, globals())
