"""What a paper is called, where its results are, and what its places are: ``paper.yaml``."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Self

from paper_verdict.errors import PaperError
from paper_verdict.files import Entry, read_optional


class Place(Entry):
    """What the overview says of a table or figure."""

    says: str = ""  # of one without items: inputs, a scheme
    link: str = ""  # to its picture or data, from the page
    draws: Sequence[str] = ()  # of a figure without items: patterns of the ids that it shows
    linear: bool = False  # whether its axis is, though its numbers span decades


class About(Entry):
    """Content of ``paper.yaml``; every key may be left out."""

    title: str
    authors: str = ""
    journal: str = ""
    doi: str = ""
    how: str = ""  # sentence on the reproduction
    meaning: str = ""  # what the verdict means for readers who use the paper; links as [words](address)
    tolerances: str = ""  # when and where they were chosen
    proofs: str = ""  # where the functions of the proofs are
    footer: str = ""
    others: Mapping[str, str] = {}  # names and addresses of other verdicts
    results: str = "reproduced"  # folder, relative to the paper's
    places: Mapping[str, Place] = {}  # Table 3, Fig. 1 ...

    @classmethod
    def of(cls, folder: Path) -> Self:
        """Read the file of a paper's folder; the title is the folder's name without one."""
        if not folder.is_dir():
            raise PaperError(f"{folder}: no such folder; paper-verdict init {folder} makes one")
        file = folder / "paper.yaml"
        entry = read_optional(file)
        entry.setdefault("title", folder.resolve().name)
        return cls.read(file, "paper", entry)
