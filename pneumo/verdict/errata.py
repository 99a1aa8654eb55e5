"""Errata of a paper: ``errata.yaml``, each entry with the outcome of its proof.

A proof is a function that uses the paper's own numbers and formulas and no result of ours. It runs with
every verdict.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import yaml

from pneumo.verdict import paper_file

Proof = Callable[[], tuple[bool, str]]


class Erratum(NamedTuple):
    """One entry of ``errata.yaml`` with the outcome of its proof.

    Attributes
    ----------
    id, kind, where, printed, meant : str
        Name, sort, place, what stands there and what must be meant.
    values : mapping
        Claim -> number that takes the printed one's place.
    proof : str
        Name of the function that proves it.
    passes : bool
        Whether the printed form fails and the meant one holds.
    evidence : str
        The numbers that the proof compared.
    """

    id: str
    kind: str
    where: str
    printed: str
    meant: str
    values: Mapping[str, str]
    proof: str
    passes: bool
    evidence: str


def read_errata(folder: Path, proofs: Mapping[str, Proof]) -> dict[str, Erratum]:
    """Read the errata by name and run their proofs.

    Parameters
    ----------
    folder : pathlib.Path
        Folder of ``errata.yaml``.
    proofs : mapping of str to callable
        Functions by the name that ``errata.yaml`` gives under ``proof``; each returns `Erratum.passes`
        and `Erratum.evidence`.
    """
    content = yaml.safe_load(paper_file(folder, "errata.yaml").read_text(encoding="utf-8"))
    errata: dict[str, Erratum] = {}
    for name, entry in content.items():
        passes, evidence = proofs[entry["proof"]]()
        errata[name] = Erratum(**{"id": name, "values": {}, "passes": passes, "evidence": evidence} | entry)
    return errata
