"""The papers that are judged, by name, and the verdict that ``pneumo paper verdict`` shows.

Slow packages, which judging needs, are imported only when a paper is judged.
"""

from collections.abc import Sequence
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from paper.study import PAPERS

if TYPE_CHECKING:
    from paper_verdict.judging import Paper

PaperName = Literal["2006", "2007"]


class KnownPaper(NamedTuple):
    """Module and files of a paper."""

    module: str  # that defines the paper
    results: str  # folder of its results, inside the folder of all results
    reads: Sequence[str]  # patterns of the files of results behind its verdict


KNOWN: dict[PaperName, KnownPaper] = {
    "2006": KnownPaper(
        "paper.study.paper_2006.paper",
        ".",
        (
            *("parameters.json", "settling.nc", "seed_sets.nc"),
            *("settling/*.nc", "datum/*.nc"),
            *("published/statistics.nc", "published/replay/*.nc", "exact/statistics.nc", "exact/replay/*.nc"),
        ),
    ),
    "2007": KnownPaper("paper.study.paper_2007.paper", "2007", ("example.nc",)),
}


def paper(name: PaperName) -> "Paper":
    """Return a paper's definition: its files, computations, proofs and sources."""
    return resolve_name(f"{KNOWN[name].module}:PAPER_{name}")


def current_verdict(results: Path, name: PaperName = "2006") -> dict[str, Any]:
    """Verdict on a paper: that of ``verdict.json`` if up to date, else a new one, which is not written.

    `results` is the folder of all results.
    """
    from paper.study.stored_verdict import stored_verdict  # here, or every `pneumo --help` would import it

    known, folder = KNOWN[name], PAPERS / name
    stored = stored_verdict(results / known.results, folder, known.reads)
    if stored is not None:
        return stored
    from paper_verdict.judging import verdict  # here: it imports slow packages

    return verdict(paper(name)._replace(folder=folder), results / known.results)
