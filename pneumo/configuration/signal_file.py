"""Signals of the user: one column of a CSV file."""

import csv
from math import isfinite
from pathlib import Path

from pneumo.errors import ConfigurationError, printable

LARGEST_SIGNAL_FILE = 20_000_000  # bytes
MOST_COLUMNS = 1000
csv.field_size_limit(LARGEST_SIGNAL_FILE)
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
        with file.open("rb") as stream:  # whose size is known when it has been read: it may be a device
            content = stream.read(LARGEST_SIGNAL_FILE + 1)
        lines = content.decode("utf-8-sig").splitlines() if len(content) <= LARGEST_SIGNAL_FILE else None
    except (OSError, ValueError) as error:
        raise refuse("file", str(file), f"cannot be read from the working directory: {error}") from None
    if lines is None:
        raise refuse("file", str(file), f"must have at most {LARGEST_SIGNAL_FILE} bytes")
    first = lines[0] if lines else ""
    delimiter = max(",;\t", key=first.count)
    if first.count(delimiter) >= MOST_COLUMNS:
        raise refuse(
            "file", str(file), f"{first.count(delimiter) + 1} columns: must be at most {MOST_COLUMNS}"
        )
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
            raise refuse("file", str(file), f"more than {MOST_ROWS} rows: must be at most that")
    if not values:
        raise refuse("file", str(file), "has no rows below the names of its columns")
    return tuple(values)
