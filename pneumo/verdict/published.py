"""The numbers that a paper printed, from the CSV files in its folder ``published``."""

import csv
from decimal import Decimal, InvalidOperation
from pathlib import Path

from pneumo.verdict import paper_file


def read_cells(name: str, folder: Path) -> list[dict[str, str]]:
    """Read the cells of a printed table or figure, such as ``figure9``; every value is a string."""
    with paper_file(folder, f"published/{name}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def recorded(file: Path) -> dict[str, str]:
    """Return a CSV file of two columns as a dictionary, first to second; empty if there is no such file."""
    if not file.exists():
        return {}
    with file.open(encoding="utf-8", newline="") as lines:
        return dict(list(csv.reader(lines))[1:])


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
    try:
        _, figures, exponent = Decimal(printed).as_tuple()
        last = Decimal(5).scaleb(int(exponent) - 1)
    except (InvalidOperation, ValueError):  # no number, or one that is not finite
        raise ValueError(f"printed = {printed!r}: not a finite number") from None
    text = "".join(map(str, figures))
    kept = text if digits is None else text[:digits] + text[digits:].rstrip("0")
    return float(last.scaleb(len(text) - len(kept)))
