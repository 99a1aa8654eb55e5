"""What the verdict would notice: items lost by known mistakes."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pneumo.evidence.sensitivity.verdict_power import power
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, read_study, write
from pneumo.verdict.claims import read_claims


def main(
    configuration: Mapping[str, Any], parameters: Path, claims: Path, agrees: Path, threads: int, code: str
) -> None:
    study = read_study(parameters)
    agreement = power(parameters.parent, study, configuration, read_claims(claims.parent), threads)
    summary = "Whether each item of the verdict agrees with the paper when a known mistake is made"
    write(agreement, agrees, attributes("Power of the verdict", summary, study.config_sha256, code))


run_job(main, globals())
