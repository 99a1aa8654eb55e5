"""Text files that a user names: read up to a size; CSV files split into fields."""

import csv
import re
from pathlib import Path
from typing import Any

from pneumo.errors import ConfigurationError, printable
from pneumo.regular_file import regular_file

NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")  # as YAML 1.2 and CSV have it
csv.field_size_limit(100_000_000)  # the largest file read here


def read_text(file: Path, largest: int, named: str) -> str:
    """Text of a file; `ConfigurationError` if it cannot be read or has more than `largest` bytes.

    `named` is the file's name in the message of the error.
    """
    try:
        with regular_file(file, largest) as stream:
            return stream.read(largest).decode("utf-8-sig")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise ConfigurationError(f"{named}: cannot be read: {printable(reason, 300)}") from None


def csv_rows(text: str) -> Any:
    """Reader of the rows of a CSV text, whose first line decides the separator: comma, semicolon or tab."""
    lines = text.splitlines()
    return csv.reader(lines, delimiter=max(",;\t", key=(lines[0] if lines else "").count))
