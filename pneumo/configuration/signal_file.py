"""Signals of the user: one column of a CSV file."""

import csv
from math import isfinite
from pathlib import Path

from pneumo.errors import ConfigurationError, printable

LARGEST_SIGNAL_FILE = 20_000_000  # bytes
MOST_ROWS = 100_000  # they are stored with every result of the experiment


def read_column(file: Path, column: str, where: str) -> tuple[float, ...]:
    """Return the numbers of one column of a CSV file whose first row names the columns.

    Commas, semicolons or tabs between columns, points in numbers. `where` is the section of the configuration
    that names the file, for the error message.

    Raises
    ------
    ConfigurationError
        With one line, if the file cannot be read, has no such column, or holds anything but finite numbers.
    """

    def refuse(key: str, value: str, problem: str) -> ConfigurationError:
        return ConfigurationError(f"{where}.{key} = {printable(repr(value), 200)}: {printable(problem, 300)}")

    try:
        if file.stat().st_size > LARGEST_SIGNAL_FILE:
            raise refuse("file", str(file), f"larger than {LARGEST_SIGNAL_FILE} bytes")
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, ValueError) as error:
        if isinstance(error, ConfigurationError):
            raise
        raise refuse("file", str(file), f"cannot be read from the working directory: {error}") from None
    first = lines[0] if lines else ""
    delimiter = max(",;\t", key=first.count)
    rows = csv.reader(lines, delimiter=delimiter)
    names = [name.strip() for name in next(rows, [])]
    if column not in names:
        raise refuse("column", column, f"{file} has the columns {', '.join(names) or '(none)'}")
    place, values = names.index(column), []
    for row in rows:
        if not row:
            continue
        try:
            value = float(row[place])
            if not isfinite(value):
                raise ValueError
        except (ValueError, IndexError):
            problem = f"{file}, line {rows.line_num}: no finite number in that column"
            raise refuse("column", column, problem) from None
        values.append(value)
        if len(values) > MOST_ROWS:
            raise refuse("file", str(file), f"more than {MOST_ROWS} rows")
    if not values:
        raise refuse("file", str(file), "has no rows below the names of its columns")
    return tuple(values)
