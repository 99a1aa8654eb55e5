"""Assumptions where the paper leaves something open: ``assumptions.yaml``, whose head explains the keys."""

from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from pneumo.verdict import PAPER_FOLDER, PaperError, paper_file

AS_TAKEN = "as_taken"  # name of the unchanged study among the alternatives


class Assumption(BaseModel):
    """One entry of ``assumptions.yaml``."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    open: str
    value: Any
    unit: str = ""
    config: list[str] = []
    code: str = ""
    basis: str
    alternatives: dict[str, dict[str, Any] | str]
    left_out: dict[str, str] = {}


def read_assumptions(folder: Path = PAPER_FOLDER) -> dict[str, Assumption]:
    """Read the assumptions by name.

    Raises
    ------
    PaperError
        If the file is missing, or an entry has an unknown or a missing key.
    """
    file = paper_file(folder, "assumptions.yaml")
    assumptions: dict[str, Assumption] = {}
    for name, entry in yaml.safe_load(file.read_text(encoding="utf-8")).items():
        try:
            assumptions[name] = Assumption.model_validate(entry)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, (name, *first["loc"])))
            raise PaperError(f"{file}: {place}: {first['msg']}") from None
    return assumptions
