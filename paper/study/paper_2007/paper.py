"""The paper of 2007: its files and functions, as `paper_verdict.judging` reads them."""

from pathlib import Path

from paper.study.paper_2007.computations import COMPUTATIONS
from paper.study.paper_2007.erratum_proofs import PROOFS
from paper.study.paper_2007.printed_tables import PAPER_FOLDER
from paper.study.paper_2007.results import Results
from paper.study.paper_2007.summary import highlights
from paper_verdict.judging import Paper


def sources(results: Path, folder: Path) -> dict[str, Results]:
    """Results of the simulated example and printed tables, as the computations of the claims read them."""
    return {"results": Results(results, folder)}


PAPER_2007 = Paper(
    PAPER_FOLDER,
    COMPUTATIONS,
    PROOFS,
    sources,
    highlights=highlights,
)
