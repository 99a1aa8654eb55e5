"""Assumptions where the paper leaves something open: ``assumptions.yaml``, whose head explains the keys."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pneumo.verdict.entries import Entry, read_entries


class Assumption(Entry):
    """One entry of ``assumptions.yaml``."""

    open: str
    value: Any
    unit: str = ""
    config: Sequence[str] = ()
    code: str = ""
    basis: str
    alternatives: dict[str, dict[str, Any] | str]
    left_out: Mapping[str, str] = {}


def read_assumptions(folder: Path) -> dict[str, Assumption]:
    """Read the assumptions by name; `PaperError` if the file is missing or an entry is wrong."""
    file = "assumptions.yaml"
    return {n: Assumption.read(folder / file, n, entry) for n, entry in read_entries(folder, file).items()}
