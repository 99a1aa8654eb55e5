"""Errata of a paper: ``errata.yaml``, whose head explains the keys, each with the outcome of its proof.

A proof is a function of the paper's own numbers and formulas. That of a misprint that is only suspected
argues from the results: it is shown beside its items and changes none.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from paper.verdict.published import Entry, read_entries

Proof = Callable[..., tuple[bool, str]]  # whether it passes, and its evidence


class Erratum(Entry):
    """One entry of ``errata.yaml`` with the outcome of its proof."""

    id: str
    kind: str
    where: str
    printed: str
    meant: str
    values: Mapping[str, str] = {}  # claim -> number that takes the printed one's place
    items: Sequence[str] = ()  # of a suspected misprint: beginnings of the ids of the items that it is about
    proof: str
    # Whether the printed form fails and the meant one holds; None if the results that it needs are missing.
    passes: bool | None
    evidence: str  # the numbers that the proof compared

    @property
    def cause(self) -> str:
        """Why items differ, where the proof passes."""
        return f"suspected: {self.meant}; {self.evidence}" if self.items else self.evidence


def read_errata(folder: Path, proofs: Mapping[str, Proof], results: Any = None) -> dict[str, Erratum]:
    """Read the errata by name and run the `proofs` that they name under ``proof``.

    Suspected misprints are left out without `results`, the first of a paper's sources.
    """
    errata: dict[str, Erratum] = {}
    for name, entry in read_entries(folder, "errata.yaml").items():
        proof = proofs[entry["proof"]]
        if "items" not in entry:
            passes, evidence = proof()
        elif results is None:
            continue
        else:
            try:
                passes, evidence = proof(results)
            except LookupError as error:  # as of a study with fewer experiments
                passes, evidence = None, f"not to be judged: {error}"
        outcome = {"id": name, "passes": passes, "evidence": evidence}
        errata[name] = Erratum.read(folder / "errata.yaml", name, entry | outcome)
    return errata
