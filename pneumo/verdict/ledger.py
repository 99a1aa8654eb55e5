"""What the paper leaves open and what is taken: ``paper/2006/assumptions.yaml``, whose head explains the keys."""

from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from pneumo.errors import PneumoError
from pneumo.verdict.claims import FOLDER

AS_TAKEN = "as_taken"  # stands among the alternatives for the study itself


class AssumptionsError(PneumoError, ValueError):
    """A ledger of assumptions that does not hold together; its text is one line."""


class Assumption(BaseModel):
    """One entry of the ledger."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    open: str
    value: Any
    unit: str = ""
    config: list[str] = []
    code: str = ""
    basis: str
    alternatives: dict[str, dict[str, Any] | str]
    left_out: dict[str, str] = {}


def read_assumptions(folder: Path = FOLDER) -> dict[str, Assumption]:
    """Read the ledger.

    Raises
    ------
    AssumptionsError
        If an entry has an unknown or a missing key.
    """
    file = folder / "assumptions.yaml"
    ledger = {}
    for name, entry in yaml.safe_load(file.read_text(encoding="utf-8")).items():
        try:
            ledger[name] = Assumption.model_validate(entry)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, (name, *first["loc"])))
            raise AssumptionsError(f"{file}: {place}: {first['msg']}") from None
    return ledger
