"""The paper of 2006: its files and functions, as `pneumo.verdict.judging` reads them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import xarray as xr

from paper.study.known_papers import KNOWN
from paper.study.paper_2006.computations import COMPUTATIONS
from paper.study.paper_2006.doubt_arguments import ARGUMENTS
from paper.study.paper_2006.erratum_proofs import PROOFS
from paper.study.paper_2006.printed_tables import PAPER_FOLDER
from paper.study.paper_2006.results import PrintedTables, StudyResults
from paper.study.paper_2006.summary import EXPERIMENTS, highlights
from pneumo.errors import ResultError
from pneumo.simulation.signals import STUDY_SAMPLINGS
from pneumo.storage.files import read
from pneumo.storage.kept_evidence import evidence_file
from pneumo.verdict.judging import Paper, Sources


def sources(results: Path, _: Path) -> dict[str, StudyResults]:
    """Results with each signal sampling, and the printed tables; `ResultError` for another study."""
    transports: dict[str, StudyResults] = {name: StudyResults(results, name) for name in STUDY_SAMPLINGS}
    study = transports["published"].study
    if not set(EXPERIMENTS) & set(study.experiments):
        other = f"another study, {study.name}, with the experiments {', '.join(study.experiments)}"
        raise ResultError(f"{results}: holds {other[:200]}; `snakemake -j2` makes the paper's")
    return transports | {"printed": PrintedTables(results)}


def about(sources: Sources) -> dict[str, Any]:
    """Name of the study, and when and how its full-order and settling runs failed."""
    study = sources["published"]
    failures = {"failures": study.failures("datum"), "settling_failures": study.failures("settling")}
    return {"study": study.study.name} | failures


def alternatives(results: Path, sources: Sources) -> xr.DataArray | None:
    """Reproduced number of each item, by (alternative, item), from ``assumptions.nc``; None if not run."""
    toggled = evidence_file(results, "assumptions.nc", sources["published"].study.config_sha256)
    return read(toggled, "reproduced")["reproduced"] if toggled else None


def power(results: Path, sources: Sources) -> xr.DataArray | None:
    """Whether an item agrees, by (mistake, item), from ``power.nc``; None if not run."""
    file = evidence_file(results, "power.nc", sources["published"].study.config_sha256)
    return read(file, "agrees")["agrees"].astype(bool) if file else None


def pulls(sources: Sources) -> Mapping[str, float]:
    """Deviation of each number of Tables 7, 8, 9 and Figs 9, 11 in standard deviations, by item.

    Empty if other sets of seeds were not run with this configuration.
    """
    published: StudyResults = sources["published"]
    return published.likelihood.pulls(published.numbers) if published.likelihood else {}


PAPER_2006 = Paper(
    PAPER_FOLDER,
    COMPUTATIONS,
    PROOFS,
    sources,
    about,
    highlights,
    module=__name__,
    reads=KNOWN["2006"].reads,
    command="pneumo paper explain",
    alternatives=alternatives,
    power=power,
    arguments=ARGUMENTS,
    pulls=pulls,
)
