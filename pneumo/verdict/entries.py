"""Entries of a paper's YAML files; an entry with an unknown, missing or wrong key raises one error."""

from pathlib import Path
from typing import Any, Self

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from pneumo.verdict import PaperError, paper_file

LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast where PyYAML has libyaml


def read_entries(folder: Path, name: str) -> dict[str, Any]:
    """Read a YAML file of a paper's folder; `PaperError` if it is missing."""
    text = paper_file(folder, name).read_text(encoding="utf-8")
    return yaml.load(text, LOADER)  # noqa: S506 - a safe one, either way


class Entry(BaseModel):
    """One entry of a file; its subclasses list the keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)

    @classmethod
    def read(cls, file: Path, name: str, entry: Any) -> Self:
        """Check an entry of a file; `PaperError` if a key is unknown, missing or holds a wrong value."""
        try:
            return cls.model_validate(entry)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, (name, *first["loc"])))
            value = "" if first["type"] in ("missing", "extra_forbidden") else f" = {first['input']!r}"
            raise PaperError(f"{file}: {place}{value}: {first['msg']}") from None
