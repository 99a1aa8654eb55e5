"""Errata of a paper: ``errata.yaml``, each with the outcome of its proof.

A proof is a function of the paper's own numbers and formulas, and the only thing that can say that the paper
is wrong. That of a misprint that is only suspected argues from the results: it explains, and proves nothing.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from paper_verdict.errors import PaperError, nearest
from paper_verdict.files import Entries, Entry, check_number, read_optional

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
    def is_proof(self) -> bool:
        """Whether it is proved from printed numbers alone, not suspected from results."""
        return not self.items

    @property
    def cause(self) -> str:
        """Why items differ, where the proof passes."""
        return self.evidence if self.is_proof else f"suspected: {self.meant}; {self.evidence}"


def read_errata(folder: Path, proofs: Mapping[str, Proof], results: Any = None) -> dict[str, Erratum]:
    """Read the errata by name and run the `proofs` that they name under ``proof``.

    Suspected misprints are left out without `results`, the first of a paper's sources.
    """
    file = folder / "errata.yaml"
    errata: dict[str, Erratum] = {}
    for name, entry in read_optional(file).items():
        untried = {"id": name, "passes": None, "evidence": ""}
        erratum = Erratum.read(file, name, _with(entry, untried))
        place = f"{entry.place}: {name}"
        if erratum.proof not in proofs:
            near = nearest(erratum.proof, proofs)
            raise PaperError(f"{place}: proof = {erratum.proof!r}: no such function in computations.py{near}")
        if erratum.is_proof or results is not None:
            passes, evidence = _outcome(erratum, proofs[erratum.proof], results, place)
            errata[name] = erratum.model_copy(update={"passes": passes, "evidence": evidence})
    return errata


def _with(entry: Any, more: Mapping[str, Any]) -> Any:
    if not isinstance(entry, Entries):
        return entry
    whole = Entries({**entry, **more})
    whole.file = entry.file
    whole.line = entry.line
    return whole


def _outcome(erratum: Erratum, proof: Proof, results: Any, place: str) -> tuple[bool | None, str]:
    outcome: Any
    try:
        outcome = proof() if erratum.is_proof else proof(results)
    except LookupError as error:
        if erratum.is_proof or isinstance(error, (KeyError, IndexError)):
            error.add_note(f"{place}: proof {erratum.proof}")
            raise
        return None, f"not to be judged: {error}"
    except Exception as error:
        error.add_note(f"{place}: proof {erratum.proof}")
        raise
    match outcome:
        case (bool(passes), str(evidence)):
            return passes, evidence
        case (passes, str(evidence)) if hasattr(passes, "item"):  # of NumPy
            return bool(passes), evidence
        case _:
            raise PaperError(
                f"{place}: proof {erratum.proof}: returned {repr(outcome)[:60]};"
                " return whether the print is wrong, and its evidence as a text"
            )


def check_errata(errata: Mapping[str, Erratum], printed: Mapping[str, str], file: Path) -> None:
    """Refuse errata of unknown items, or with a meant number that is none or the printed one.

    `printed` has the print of every item.
    """
    for name, erratum in errata.items():
        for item, meant in erratum.values.items():
            if item not in printed:
                raise PaperError(f"{file}: {name}.values: {item!r}: no such item{nearest(item, printed)}")
            check_number(meant, f"{file}: {name}.values.{item}", numbers_only=True)
            if meant == printed[item]:
                raise PaperError(f"{file}: {name}.values.{item} = {meant!r}: is what is printed")
        for start in erratum.items:
            if not any(item.startswith(start) for item in printed):
                raise PaperError(f"{file}: {name}.items: {start!r}: begins no item{nearest(start, printed)}")
