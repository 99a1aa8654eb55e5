"""Judge every published number and claim."""

import json
from pathlib import Path

from pneumo.jobs.wrapper import run_job
from pneumo.papers.paper_2006.paper import PAPER_2006
from pneumo.storage.files import write_json
from pneumo.verdict.judging import verdict


def main(parameters: Path, claims: Path, judged: Path) -> None:
    found = verdict(parameters.parent, PAPER_2006._replace(folder=claims.parent))
    write_json(json.dumps(found, ensure_ascii=False, indent=1, allow_nan=False) + "\n", judged)


run_job(main, globals())
