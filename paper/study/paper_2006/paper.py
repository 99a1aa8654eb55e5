"""The paper of 2006: its files and functions, as `paper_verdict.judging` reads them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from paper.study import PAPERS
from paper.study.paper_2006.computations import COMPUTATIONS
from paper.study.paper_2006.erratum_proofs import PROOFS
from paper.study.paper_2006.printed_tables import PAPER_FOLDER
from paper.study.paper_2006.results import PrintedTables, StudyResults
from paper.study.paper_2006.summary import EXPERIMENTS, highlights
from paper.study.paper_2006.suspected_misprints import ARGUMENTS
from paper.study.samplings import STUDY_SAMPLINGS
from paper_verdict.judging import Paper, Sources
from pneumo.configuration.experiment import plain
from pneumo.configuration.parameters import load, study
from pneumo.errors import ResultError

RUNS = {  # kind of run -> what its failure means
    "datum": "is left out of every average",
    "settling": "has no settling times",
}


def sources(results: Path, _: Path) -> dict[str, StudyResults]:
    """Results with each signal sampling, and the printed tables; `ResultError` for another study."""
    transports: dict[str, StudyResults] = {name: StudyResults(results, name) for name in STUDY_SAMPLINGS}
    made = transports["published"].study
    if not set(EXPERIMENTS) & set(made.experiments):
        other = f"another study, {made.name}, with the experiments {', '.join(made.experiments)}"
        raise ResultError(f"{results}: holds {other[:200]}; `snakemake -j2` makes the paper's")
    return transports | {"printed": PrintedTables(results)}


def about(sources: Sources) -> dict[str, Any]:
    """Name of a study that is not the paper's, and when and how its full-order and settling runs failed."""
    results = sources["published"]
    failures = {
        f"{name} {meaning}": reason
        for kind, meaning in RUNS.items()
        for name, reason in results.failures(kind).items()
    }
    study = results.study.name
    return {"study": "" if study == "paper" else study, "failures": failures}


def changed(sources: Sources) -> str:
    """Names of the experiments whose parameters are not those of ``config/paper.yaml``, in words."""
    config = PAPERS.parent / "config/paper.yaml"
    if not config.is_file():
        return ""
    own, printed = sources["published"].study.experiments, study(load(config)).experiments
    names = [name for name in own if name in printed and plain(own[name]) != plain(printed[name])]
    return f"the parameters of {', '.join(names)} are not the paper's" if names else ""


def chi_square(sources: Sources, items: Sequence[str]) -> float | None:
    """Chi-square of numbers of Tables 7, 8, 9 and Figs 9, 11; None for others, or without other seeds."""
    published: StudyResults = sources["published"]
    return published.likelihood.of_items(published.numbers, items) if published.likelihood else None


PAPER_2006 = Paper(
    PAPER_FOLDER,
    COMPUTATIONS,
    PROOFS | ARGUMENTS,
    sources,
    highlights=highlights,
    about=about,
    changed=changed,
    chi_square=chi_square,
)
