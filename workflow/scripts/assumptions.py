"""Toggle every assumption and compute Tables 5, 7, 8 and 9 anew."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pneumo.evidence.toggles import cases, reproduced
from pneumo.jobs.wrapper import logged
from pneumo.storage.files import write
from pneumo.verdict.assumptions import AS_TAKEN
from pneumo.verdict.claims import read_claims


def main(configuration: Mapping[str, Any], paper: Path, output: str, threads: int, code: str) -> None:
    alternatives = cases(configuration, paper)
    attributes = {
        "title": "Assumptions, toggled one at a time",
        "summary": "Every cell of Tables 5, 7, 8 and 9 under each alternative of paper/2006/assumptions.yaml",
        "comment": f"{AS_TAKEN} is the study; a settling time is NaN where a run does not come to rest",
        "config_sha256": alternatives[AS_TAKEN].study.config_sha256,
        "code_sha256": code,
    }
    write(reproduced(alternatives, read_claims(paper).items, threads), output, attributes)


if job := globals().get("snakemake"):
    with logged(job):
        claims, code = Path(job.input.claims), job.params.code
        main(job.params.configuration, claims.parent, job.output[0], job.threads, code)
