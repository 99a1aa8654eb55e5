"""Run the study under other assumptions and other physics."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pneumo.evidence.variants import LONGEST, alternatives, study_variants
from pneumo.jobs.wrapper import logged
from pneumo.storage.files import write
from pneumo.verdict.assumptions import AS_TAKEN


def main(configuration: Mapping[str, Any], paper: Path, output: str, threads: int, code: str) -> None:
    found = alternatives(configuration, paper)
    attributes = {
        "title": "Refinements of the models under other assumptions and physics",
        "summary": "MSE of M5 to M10 under each alternative, ratios of refinements, how often they pay",
        "comment": f"{AS_TAKEN} is the study with runs cut as the others'",
        "longest_s": LONGEST,
        "config_sha256": found[AS_TAKEN].study.config_sha256,
        "code_sha256": code,
    }
    write(study_variants(found, threads), output, attributes)


if job := globals().get("snakemake"):
    with logged(job):
        paper = Path(job.input.assumptions).parent
        main(job.params.configuration, paper, job.output[0], job.threads, job.params.code)
