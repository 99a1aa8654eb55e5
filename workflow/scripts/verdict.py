"""Judge every published number and claim."""

import json
from pathlib import Path

from pneumo.jobs.wrapper import logged
from pneumo.papers.paper_2006.paper import PAPER_2006
from pneumo.storage.files import write_json
from pneumo.verdict.judging import verdict


def main(results: Path, paper: Path, output: str) -> None:
    found = verdict(results, PAPER_2006._replace(folder=paper))
    write_json(json.dumps(found, ensure_ascii=False, indent=1, allow_nan=False) + "\n", output)


if job := globals().get("snakemake"):
    with logged(job):
        main(Path(job.input.parameters).parent, Path(job.input.claims).parent, job.output[0])
