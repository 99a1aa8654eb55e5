"""The paper's tables, from ``paper/2007/published``."""

from pathlib import Path
from typing import NamedTuple

from paper.study import PAPERS
from paper_verdict.files import half_unit, read_cells

PAPER_FOLDER = PAPERS / "2007"
COLUMNS = tuple(f"{cylinder}{experiment}" for experiment in "12" for cylinder in "ABC")


class PrintedNumber(NamedTuple):
    """A printed number in SI units, and half a unit in its last digit."""

    value: float
    half: float


def table1(folder: Path = PAPER_FOLDER) -> dict[tuple[str, str], str]:
    """Table 1 by cylinder and quantity, as printed."""
    return {(cell["row"], cell["column"]): cell["printed"] for cell in read_cells("table1", folder)}


def tables_2_to_5(folder: Path = PAPER_FOLDER) -> dict[tuple[str, str], PrintedNumber]:
    """Numbers of Tables 2 to 5 by column and quantity."""
    numbers: dict[tuple[str, str], PrintedNumber] = {}
    for cell in (cell for table in range(2, 6) for cell in read_cells(f"table{table}", folder)):
        value, half = float(cell["printed"]), half_unit(cell["printed"])
        scale = float(cell["scale"])
        numbers[cell["row"], cell["column"]] = PrintedNumber(value * scale, half * scale)
    return numbers
