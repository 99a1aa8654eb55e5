"""Judge every published number and claim of a paper."""

import json
from pathlib import Path

from pneumo.jobs.wrapper import run_job
from pneumo.papers.known_papers import PaperName, paper
from pneumo.storage.files import write_json
from pneumo.verdict.judging import verdict


def main(name: PaperName, claims: Path, judged: Path) -> None:
    found = verdict(judged.parent, paper(name)._replace(folder=claims.parent))
    write_json(json.dumps(found, ensure_ascii=False, indent=1, allow_nan=False) + "\n", judged)


run_job(main, globals())
