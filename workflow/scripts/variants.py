"""Run the study under other assumptions and other physics."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pneumo.evidence.sensitivity.alternatives import grid_alternatives
from pneumo.evidence.sensitivity.refinement_variants import CUT_TO, study_variants
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, write
from pneumo.verdict.assumptions import AS_TAKEN


def main(configuration: Mapping[str, Any], assumptions: Path, cells: Path, threads: int, code: str) -> None:
    studies = grid_alternatives(configuration, assumptions.parent)
    about = attributes(
        "Refinements of the models under other assumptions and physics",
        "MSE of M5 to M10 under each alternative, ratios of refinements, how often they pay",
        studies[AS_TAKEN].study.config_sha256,
        code,
        comment=f"{AS_TAKEN} is the study with runs cut as the others'",
        longest_s=CUT_TO,
    )
    write(study_variants(studies, threads), cells, about)


run_job(main, globals())
