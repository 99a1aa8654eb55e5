"""Columns that were read from a file, and how many of them are read at most."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from pneumo.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

MOST_ROWS, MOST_COLUMNS = 2_000_000, 200


class Table(NamedTuple):
    """Columns of a file as text or numbers."""

    columns: "pd.DataFrame"
    units: dict[str, str]  # by name of the column, where the name does not contain them
    first_line: int = 0  # of the first sample; 0 where the file has no lines


def limit(path: Path, number: int, most: int, things: str) -> None:
    """Raise `InputError` if a file has more of something than is read."""
    if number > most:
        raise InputError(f"{path}: {number} {things}: must be at most {most}")
