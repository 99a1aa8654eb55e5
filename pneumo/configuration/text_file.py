"""Text files that a user names: read up to a size; cells and columns of CSV files."""

import re
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pneumo.errors import ConfigurationError, printable
from pneumo.regular_file import regular_file

if TYPE_CHECKING:
    import pandas as pd

NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")  # as YAML 1.2 and CSV have it
LARGEST_CSV = 100_000_000  # bytes; a table of ten thousand cylinders has one or two million


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


def read_csv(file: Path, named: str) -> "pd.DataFrame":
    """Cells of a CSV file as text without blanks at their ends; the first row names the columns.

    Commas, semicolons or tabs between columns, whichever the first row has most of. An empty line is a row
    of empty cells. `named` is the file's name in the message of a `ConfigurationError`.
    """
    import pandas as pd  # a third of a second

    text = read_text(file, LARGEST_CSV, named)
    delimiter = max(",;\t", key=text.partition("\n")[0].count)
    try:
        cells = pd.read_csv(
            StringIO(text), sep=delimiter, header=None, dtype=object, na_filter=False, skip_blank_lines=False
        )
    except pd.errors.EmptyDataError:
        cells = pd.DataFrame([[""]], dtype=object)
    except pd.errors.ParserError as error:
        raise ConfigurationError(f"{named}: {printable(str(error).strip(), 300)}") from None
    stripped: Any = cells.apply(lambda column: column.str.strip())
    return stripped[1:].set_axis(stripped.iloc[0].tolist(), axis="columns")


def read_column(file: Path, column: str, where: str) -> tuple[float, ...]:
    """Return the numbers of one column of a CSV file whose first row names the columns.

    Commas, semicolons or tabs between columns, points in numbers. `where` is the section of the configuration
    that names the file, for the line of a `ConfigurationError`.
    """
    cells = read_csv(file.absolute(), f"{where}.file = {printable(repr(str(file)), 200)}")
    cells = cells[(cells != "").any(axis="columns")]
    if column not in cells:
        problem = f"{file} has the columns {', '.join(cells.columns) or '(none)'}"
    elif cells.columns.tolist().count(column) > 1:
        problem = f"{file} has two columns of that name"
    elif cells.empty:
        problem = f"{file} has no rows below the names of its columns"
    else:
        texts: Any = cells[column]
        numbers = texts.where(texts.str.fullmatch(NUMBER), "nan").astype(float)
        wrong = ~np.isfinite(numbers)
        if not wrong.any():
            return tuple(numbers.tolist())
        problem = f"{file}, line {wrong.idxmax() + 1}: must be a finite number in that column"
    raise ConfigurationError(f"{where}.column = {printable(repr(column), 200)}: {printable(problem, 300)}")
