"""Errata of a paper: ``errata.yaml``, whose head explains the keys, each with the outcome of its proof.

A proof is a function that uses the paper's own numbers and formulas and no result of ours. It runs with
every verdict.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

from pneumo.verdict.entries import Entry, read_entries

Proof = Callable[[], tuple[bool, str]]  # whether it passes, and its evidence


class Erratum(Entry):
    """One entry of ``errata.yaml`` with the outcome of its proof."""

    id: str
    kind: str
    where: str
    printed: str
    meant: str
    values: Mapping[str, str] = {}  # claim -> number that takes the printed one's place
    proof: str
    passes: bool  # whether the printed form fails and the meant one holds
    evidence: str  # the numbers that the proof compared


def read_errata(folder: Path, proofs: Mapping[str, Proof]) -> dict[str, Erratum]:
    """Read the errata by name and run the `proofs` that they name under ``proof``."""
    errata: dict[str, Erratum] = {}
    for name, entry in read_entries(folder, "errata.yaml").items():
        passes, evidence = proofs[entry["proof"]]()
        outcome = {"id": name, "passes": passes, "evidence": evidence}
        errata[name] = Erratum.read(folder / "errata.yaml", name, entry | outcome)
    return errata
