"""Signals from a user's file: one column of a CSV file."""

from pathlib import Path
from typing import Any

import numpy as np

from pneumo.configuration.text_file import NUMBER, read_csv
from pneumo.errors import ConfigurationError, printable


def columns_of(file: Path, named: str) -> list[str]:
    """Names of the columns in the first row of a CSV file; `named` is the file's name in error messages."""
    return read_csv(file.absolute(), named).columns.tolist()


def read_column(file: Path, column: str, where: str) -> tuple[float, ...]:
    """Return the numbers of one column of a CSV file whose first row names the columns.

    Commas, semicolons or tabs between columns, points in numbers. `where` is the section of the configuration
    that names the file, for the error message.

    Raises
    ------
    ConfigurationError
        With one line, if the file cannot be read, the column is missing, or a value is not a finite number.
    """
    cells = read_csv(file.absolute(), f"{where}.file = {printable(repr(str(file)), 200)}")
    cells = cells[(cells != "").any(axis="columns")]
    problem = f"{file} has no rows below the names of its columns" if cells.empty else ""
    if column not in cells:
        problem = f"{file} has the columns {', '.join(cells.columns) or '(none)'}"
    elif cells.columns.tolist().count(column) > 1:
        problem = f"{file} has two columns of that name"
    if not problem:
        texts: Any = cells[column]
        numbers = texts.where(texts.str.fullmatch(NUMBER), "nan").astype(float)
        wrong = ~np.isfinite(numbers)
        if not wrong.any():
            return tuple(numbers.tolist())
        problem = f"{file}, line {wrong.idxmax() + 1}: must be a finite number in that column"
    raise ConfigurationError(f"{where}.column = {printable(repr(column), 200)}: {printable(problem, 300)}")
