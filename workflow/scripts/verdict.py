"""Judge every published number and claim of a paper, and write the verdict as a page."""

import json
from pathlib import Path

from paper.study.kept_evidence import made
from paper.study.known_papers import PaperName, paper
from paper.study.pages.verdict_page import verdict_page
from paper_verdict.judging import verdict
from pneumo.storage.files import write_text
from workflow.jobs.wrapper import run_job


def main(name: PaperName, claims: Path, evidence: list[Path], judged: Path, page: Path) -> None:
    content = verdict(paper(name)._replace(folder=claims.parent), judged.parent)
    text = json.dumps(content, ensure_ascii=False, indent=1, allow_nan=False) + "\n"
    write_text(text, judged)
    rests_on = [made(file) for file in evidence]
    write_text(verdict_page(json.loads(text), claims.parent, rests_on), page)


run_job(main, globals())
