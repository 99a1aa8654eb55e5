"""Reproduced numbers without Python: cells of CSV, JSON and NetCDF files in a folder of results."""

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Literal

from pydantic import field_validator

from paper_verdict.errors import PaperError, nearest
from paper_verdict.files import Entries, Entry, check_number, column_and_unit, read_csv
from paper_verdict.findings import MissingEvidence

VALUE_COLUMNS = ("reproduced", "value", "printed")  # of a file with a line for each cell
PERCENTILE = re.compile(r"^p(\d+(?:\.\d+)?)$")


def _std(values: Sequence[float]) -> float:
    mean = math.fsum(values) / len(values)
    return math.sqrt(math.fsum((value - mean) ** 2 for value in values) / (len(values) - 1))


REDUCTIONS: dict[str, Callable[[Sequence[float]], float]] = {
    "mean": lambda values: math.fsum(values) / len(values),
    "rms": lambda values: math.sqrt(math.fsum(value * value for value in values) / len(values)),
    "std": _std,  # with n - 1
    "min": min,
    "max": max,
    "sum": math.fsum,
    "first": lambda values: values[0],
    "last": lambda values: values[-1],
}


class Cell(Entry):
    """Where a reproduced number is: file, variable, labels, and what is done with the rest."""

    file: str
    variable: str = ""  # column of a CSV file, path of keys of a JSON file, variable of a NetCDF file
    select: Mapping[str, str | float] = {}  # coordinate or column -> label
    reduce: str = ""  # over all that is left: one of `REDUCTIONS`, or a percentile such as p90
    factor: float = 1.0  # from the file's unit to the print's
    missing: Literal["refused", "allowed"] = "refused"  # allowed: items whose cell is missing are not judged

    @field_validator("reduce")
    @classmethod
    def _known(cls, name: str) -> str:
        match = PERCENTILE.match(name)
        if name and name not in REDUCTIONS and not (match and float(match[1]) <= 100):
            known = [*REDUCTIONS, "p90"]
            raise ValueError(f"no such reduction{nearest(name, known)}")
        return name

    def __str__(self) -> str:
        labels = ", ".join(f"{name}={label}" for name, label in self.select.items())
        parts = [self.variable, f"at {labels}" if labels else "", self.reduce]
        parts.append(f"times {self.factor:g}" if self.factor != 1 else "")
        return " ".join(filter(None, parts))


class Values:
    """Numbers in a folder of results; files are read once."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.csv = cache(read_csv)
        self.json = cache(_read_json)
        self.netcdf = cache(_open_netcdf)

    def number(self, cell: Cell, unit: str, place: str) -> float:
        """The number of a cell; `MissingEvidence` if it is missing and may be, else `PaperError`.

        `unit` is that of the print, empty if it has none; `place` is the claim's, for messages.
        """
        try:
            values, own_unit = self._read(cell)
            if own_unit and unit and own_unit != unit and cell.factor == 1:
                raise PaperError(
                    f"{self.folder / cell.file}: {cell.variable} is in {own_unit}, the print in {unit};"
                    " give factor, or correct the unit"
                )
            return _reduced(values, cell, self.folder / cell.file) * cell.factor
        except _Missing as error:
            if cell.missing == "allowed":
                raise MissingEvidence(str(error)) from None
            raise PaperError(f"{error} (asked for at {place})") from None

    def in_table(self, file: str, row: str, column: str, keys: Mapping[str, str]) -> Cell:
        """The cell at the same row and column as in the printed table, in either layout of such files."""
        rows = self._rows(file)
        head = list(rows[0]) if rows else []
        if "row" in head and "column" in head:
            variable = next((name for name in VALUE_COLUMNS if name in head), "")
            if not variable:
                raise PaperError(f"{self.folder / file}:1: has no column 'value'{nearest('value', head)}")
            labels = {"row": row, "column": column} | {k: v for k, v in keys.items() if k in head}
            return Cell(file=file, variable=variable, select=labels)
        return Cell(file=file, variable=column, select={head[0]: row} if head else {})

    def _rows(self, file: str) -> list[Entries]:
        path = self.folder / file
        if not path.is_file():
            raise _missing_file(path)
        return self.csv(path)

    def _read(self, cell: Cell, several: bool = False) -> tuple[list[float], str]:
        """Numbers of a cell, more than one where `several` or a reduction allow it, and their unit."""
        path = self.folder / cell.file
        if not path.is_file():
            raise _missing_file(path)
        if path.suffix == ".csv":
            return _of_rows(self.csv(path), cell, path, several)
        if path.suffix == ".json":
            return _of_json(self.json(path), cell, path, several), ""
        if path.suffix in (".nc", ".nc4", ".cdf"):
            return _of_netcdf(self.netcdf(path), cell, path)
        raise PaperError(f"{path}: cannot be read; write .csv, .json or .nc")

    def series(self, file: str, variable: str, select: Mapping[str, str | float]) -> list[float]:
        """All values of a variable at some labels, in their order."""
        return self._read(Cell(file=file, variable=variable, select=select), several=True)[0]


class _Missing(PaperError):
    """A file, row, column or number that is not there."""


def _missing_file(path: Path) -> "_Missing":
    beside = [each.name for each in sorted(path.parent.glob("*"))] if path.parent.is_dir() else []
    return _Missing(f"{path}: no such file{nearest(path.name, beside)}")


def _same(label: Any, wanted: str | float) -> bool:
    """Whether two labels are equal, as texts or as numbers."""
    if str(label) == str(wanted):
        return True
    try:
        return math.isclose(float(label), float(wanted), rel_tol=1e-9)
    except (TypeError, ValueError):
        return False


def _of_rows(rows: Sequence[Entries], cell: Cell, path: Path, several: bool) -> tuple[list[float], str]:
    """Numbers of a column in the rows with some labels, and the unit of the column."""
    heads = {column_and_unit(head)[0]: head for head in (rows[0] if rows else [])}
    for name in (*cell.select, cell.variable):
        if name not in heads and name not in heads.values():
            raise _Missing(f"{path}:1: no column {name!r}{nearest(name, heads)}")
    labels = {heads.get(name, name): label for name, label in cell.select.items()}
    found = [row for row in rows if all(_same(row[name], label) for name, label in labels.items())]
    if not found:
        for name, label in labels.items():
            if not any(_same(row[name], label) for row in rows):
                near = nearest(str(label), [row[name] for row in rows])
                raise _Missing(f"{path}: no row with {name} = {label}{near}")
        wanted = ", ".join(f"{name} = {label}" for name, label in labels.items())
        raise _Missing(f"{path}: no row with {wanted}; there are rows with each of them")
    if len(found) > 1 and not (several or cell.reduce):
        lines = " and ".join(str(row.line) for row in found[:2])
        wanted = ", ".join(f"{name} = {label}" for name, label in labels.items()) or "no selection"
        raise PaperError(
            f"{path}:{found[1].line}: lines {lines} have {wanted}; remove one, select more, or give reduce"
        )
    head = heads.get(cell.variable, cell.variable)
    values: list[float] = []
    for row in found:
        text = row[head]
        if not text:
            raise _Missing(f"{row.place}: {head}: is empty; write the reproduced number")
        if text.casefold() not in ("nan", "inf", "-inf"):
            check_number(text, f"{row.place}: {head}", numbers_only=True)
        values.append(float(text))
    units = {row.get("unit", "") for row in found}
    unit = column_and_unit(head)[1] or (units.pop() if len(units) == 1 else "")
    return values, unit


def _read_json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise PaperError(f"{path}: is no JSON: {error}") from None


def _of_json(content: Any, cell: Cell, path: Path, several: bool) -> list[float]:
    """Numbers at a path of keys, or of a key in those of a list of records that have some labels."""
    node = content
    keys = cell.variable.split(".") if cell.variable else []
    while keys and not _is_records(node):
        if not isinstance(node, dict):
            raise _Missing(f"{path}: {cell.variable}: nothing below {keys[0]!r}")
        # A key may hold points, as 1.35 does: the longest that is there.
        key = next((k for n in range(len(keys), 0, -1) if (k := ".".join(keys[:n])) in node), None)
        if key is None:
            raise _Missing(f"{path}: {cell.variable}: no key {keys[0]!r}{nearest(keys[0], node)}")
        node = node[key]
        keys = keys[key.count(".") + 1 :]
    if _is_records(node):
        rows: list[Entries] = []
        for number, record in enumerate(node, 1):
            row = Entries({name: "" if value is None else str(value) for name, value in record.items()})
            row.file = path
            row.line = number
            rows.append(row)
        return _of_rows(rows, cell.model_copy(update={"variable": ".".join(keys)}), path, several)[0]
    numbers = node if isinstance(node, list) else [node]
    if not numbers or not all(
        isinstance(each, (int, float)) and not isinstance(each, bool) for each in numbers
    ):
        raise PaperError(f"{path}: {cell.variable}: is no number: {str(node)[:60]}")
    return [float(each) for each in numbers]


def _is_records(node: Any) -> bool:
    return isinstance(node, list) and bool(node) and all(isinstance(each, dict) for each in node)


def _open_netcdf(path: Path) -> Any:
    try:
        from netCDF4 import Dataset
    except ImportError:
        raise PaperError(f"{path}: reading NetCDF needs: pip install 'paper-verdict[netcdf]'") from None
    try:
        return Dataset(path)
    except OSError as error:
        raise PaperError(f"{path}: is no NetCDF file: {error}") from None


def _of_netcdf(dataset: Any, cell: Cell, path: Path) -> tuple[list[float], str]:
    """Numbers of a variable at some labels, and its unit."""
    if cell.variable not in dataset.variables:
        raise _Missing(f"{path}: no variable {cell.variable!r}{nearest(cell.variable, dataset.variables)}")
    variable = dataset.variables[cell.variable]
    index: list[Any] = [slice(None)] * variable.ndim
    for name, label in cell.select.items():
        if name not in variable.dimensions:
            near = nearest(name, variable.dimensions)
            raise _Missing(f"{path}: {cell.variable} has no dimension {name!r}{near}")
        axis = variable.dimensions.index(name)
        labels = (
            dataset.variables[name][:].tolist() if name in dataset.variables else range(variable.shape[axis])
        )
        at = [i for i, each in enumerate(labels) if _same(each, label)]
        if not at:
            raise _Missing(f"{path}: no {name} = {label}{nearest(str(label), map(str, labels))}")
        index[axis] = at[0]
    values = variable[tuple(index)]
    values = values.filled(math.nan) if hasattr(values, "filled") and values.dtype.kind == "f" else values
    return [float(each) for each in values.reshape(-1).tolist()], str(getattr(variable, "units", ""))


def _reduced(values: Sequence[float], cell: Cell, path: Path) -> float:
    if not values:
        raise PaperError(f"{path}: {cell}: there are no numbers")
    if not cell.reduce:
        if len(values) > 1:
            raise PaperError(
                f"{path}: {cell}: are {len(values)} numbers; select more, or give reduce, such as mean"
            )
        return values[0]
    if any(map(math.isnan, values)):
        return math.nan
    if match := PERCENTILE.match(cell.reduce):
        return percentile(values, float(match[1]))
    if cell.reduce == "std" and len(values) < 2:
        raise PaperError(f"{path}: {cell}: std needs two numbers, there is one")
    return REDUCTIONS[cell.reduce](values)


def percentile(values: Sequence[float], percent: float) -> float:
    """Percentile, linear between the sorted values (Hyndman and Fan's rule 7).

    Examples
    --------
    >>> percentile([4.0, 1.0, 2.0], 75)
    3.0
    """
    ordered = sorted(values)
    place = percent / 100 * (len(ordered) - 1)
    below = math.floor(place)
    above = min(below + 1, len(ordered) - 1)
    return ordered[below] + (place - below) * (ordered[above] - ordered[below])


def deviation(values: Sequence[float]) -> float:
    """Standard deviation, with n - 1."""
    return _std(values)
