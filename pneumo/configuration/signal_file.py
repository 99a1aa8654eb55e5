"""Signals from a user's file: one column of a CSV file."""

from math import isfinite, nan
from pathlib import Path

from pneumo.configuration.text_file import NUMBER, csv_rows, read_text
from pneumo.errors import ConfigurationError, printable

LARGEST_SIGNAL_FILE = 20_000_000  # bytes
MOST_COLUMNS = 1000
MOST_ROWS = 100_000  # they are stored with every result of the experiment


def columns_of(file: Path, named: str) -> list[str]:
    """Names of the columns in the first row of a CSV file; `named` is the file's name in error messages."""
    rows = csv_rows(read_text(file.absolute(), LARGEST_SIGNAL_FILE, named))
    return [name.strip() for name in next(rows, [])]


def read_column(file: Path, column: str, where: str) -> tuple[float, ...]:
    """Return the numbers of one column of a CSV file whose first row names the columns.

    Commas, semicolons or tabs between columns, points in numbers. `where` is the section of the configuration
    that names the file, for the error message.

    Raises
    ------
    ConfigurationError
        With one line, if the file cannot be read, the column is missing, or a value is not a finite number.
    """

    def refuse(key: str, value: str, problem: str) -> ConfigurationError:
        return ConfigurationError(f"{where}.{key} = {printable(repr(value), 200)}: {printable(problem, 300)}")

    named = f"{where}.file = {printable(repr(str(file)), 200)}"
    rows = csv_rows(read_text(file.absolute(), LARGEST_SIGNAL_FILE, named))
    names = [name.strip() for name in next(rows, [])]
    if len(names) > MOST_COLUMNS:
        raise refuse("file", str(file), f"has {len(names)} columns; must have at most {MOST_COLUMNS}")
    if column not in names:
        raise refuse("column", column, f"{file} has the columns {', '.join(names) or '(none)'}")
    place, values = names.index(column), []
    for row in rows:
        if not row:
            continue
        try:
            value = float(row[place]) if NUMBER.fullmatch(row[place].strip()) else nan
            if not isfinite(value):
                raise ValueError
        except (ValueError, IndexError):
            problem = f"{file}, line {rows.line_num}: must be a finite number in that column"
            raise refuse("column", column, problem) from None
        values.append(value)
        if len(values) > MOST_ROWS:
            raise refuse("file", str(file), f"must have at most {MOST_ROWS} rows")
    if not values:
        raise refuse("file", str(file), "has no rows below the names of its columns")
    return tuple(values)
