"""Doubts about what a paper prints: ``doubts.yaml``, whose head explains the keys.

An erratum is proved by the paper's own numbers; a doubt is argued from the results. A doubt is shown beside
its items and changes no status.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pneumo.verdict.entries import Entry, read_entries
from pneumo.verdict.sources import Computation, MissingEvidence

FILE = "doubts.yaml"


class Doubt(Entry):
    """One entry of ``doubts.yaml`` with the outcome of its argument."""

    id: str
    where: str
    printed: str
    suspected: str
    items: Sequence[str]  # beginnings of the ids of the items that it is about
    argument: str  # computation on the results
    holds: bool | None  # whether the argument speaks for what is suspected; None if not to be judged
    evidence: str  # the numbers that were compared

    def concerns(self, item: str) -> bool:
        """Whether the doubt is about an item, by its id."""
        return item.startswith(tuple(self.items))


def read_doubts(folder: Path, computations: Mapping[str, Computation], source: Any) -> dict[str, Doubt]:
    """Read the doubts by name and run their arguments on the results, `source`; empty without a file.

    `PaperError` if an entry is wrong.
    """
    if not (folder / FILE).exists():
        return {}
    doubts: dict[str, Doubt] = {}
    for name, entry in read_entries(folder, FILE).items():
        try:
            finding = computations[entry["argument"]](source)
            outcome = {"holds": finding.holds, "evidence": finding.shown}
        except (MissingEvidence, KeyError) as error:  # as of a study with fewer experiments
            outcome = {"holds": None, "evidence": f"not to be judged: {error}"}
        doubts[name] = Doubt.read(folder / FILE, name, entry | {"id": name} | outcome)
    return doubts
