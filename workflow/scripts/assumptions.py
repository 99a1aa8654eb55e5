"""Toggle every assumption and compute Tables 5, 7, 8 and 9 anew."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pneumo.evidence.sensitivity.alternatives import ledger_alternatives
from pneumo.evidence.sensitivity.toggled_assumptions import toggled_tables
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, write
from pneumo.verdict.assumptions import AS_TAKEN
from pneumo.verdict.claims import read_claims


def main(configuration: Mapping[str, Any], claims: Path, toggled: Path, threads: int, code: str) -> None:
    paper = claims.parent
    alternatives = ledger_alternatives(configuration, paper)
    about = attributes(
        "Assumptions, toggled one at a time",
        "Every cell of Tables 5, 7, 8 and 9 under each alternative of paper/2006/assumptions.yaml",
        alternatives[AS_TAKEN].study.config_sha256,
        code,
        comment=f"{AS_TAKEN} is the study; a settling time is NaN where a run does not come to rest",
    )
    write(toggled_tables(alternatives, read_claims(paper).items, threads), toggled, about)


run_job(main, globals())
