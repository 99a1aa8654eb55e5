"""Files in a paper's folder: entries of YAML files, and printed numbers in the CSV files of ``published``."""

import csv
from decimal import Decimal
from pathlib import Path
from typing import Any, Self

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast where PyYAML has libyaml


class PaperError(ValueError):
    """A file of the paper is missing, or has an unknown key, a repeated or an unknown name."""


def _text(folder: Path, name: str) -> str:
    if not (folder / name).is_file():
        raise PaperError(f"{folder / name}: no such file; a source checkout has it beside the package")
    return (folder / name).read_text(encoding="utf-8")


def read_entries(folder: Path, name: str) -> dict[str, Any]:
    """Read a YAML file of a paper's folder; `PaperError` if it is missing."""
    return yaml.load(_text(folder, name), LOADER)  # noqa: S506 - a safe one, either way


def read_cells(name: str, folder: Path) -> list[dict[str, str]]:
    """Read the cells of a printed table or figure, such as ``figure9``; every value is a string."""
    return list(csv.DictReader(_text(folder, f"published/{name}.csv").splitlines()))


def recorded(file: Path) -> dict[str, str]:
    """Return a CSV file of two columns as a dictionary, first to second; empty if there is no such file."""
    if not file.exists():
        return {}
    return dict(list(csv.reader(_text(file.parent, file.name).splitlines()))[1:])


class Entry(BaseModel):
    """One entry of a YAML file; its subclasses list the keys."""

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

    @classmethod
    def read_all(cls, folder: Path, file: str) -> dict[str, Self]:
        """Read the entries of a file by name; `PaperError` if it is missing or an entry is wrong."""
        entries = read_entries(folder, file).items()
        return {name: cls.read(folder / file, name, entry) for name, entry in entries}


def half_unit(printed: str, digits: int | None = None) -> float:
    """Half a unit in the last printed digit: the largest error of rounding.

    Where the authors rounded to some `digits` and filled up with zeros, these zeros do not count as digits.

    Examples
    --------
    >>> half_unit("1.02e4"), half_unit("140"), half_unit("-0.047")
    (50.0, 0.5, 0.0005)
    >>> half_unit("3000", digits=2), half_unit("46.0", digits=2), half_unit("27.5", digits=2)
    (50.0, 0.5, 0.05)
    """
    _, figures, exponent = Decimal(printed).as_tuple()
    last = Decimal(5).scaleb(int(exponent) - 1)
    text = "".join(map(str, figures))
    kept = text if digits is None else text[:digits] + text[digits:].rstrip("0")
    return float(last.scaleb(len(text) - len(kept)))
