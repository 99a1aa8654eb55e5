"""Text files of loggers: their layout is found by their content.

A file may begin with comments or any other lines. Its table is the first run of numbers, with a row of names
above it and perhaps one of units between. Other layouts: TwinCAT Scope's blocks of a channel each, and the
labelled rows of Simulink's Data Inspector.
"""

import csv
import io
import re
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pneumo.errors import InputError
from pneumo.fitting.record.channel import MOST_COLUMNS, MOST_ROWS, Channel, is_time, limit, table_channels
from pneumo.fitting.record.units import is_unit, plain_unit

HEAD_LINES, SAMPLE_LINES = 200, 50  # within which the first sample must be; rows that show the layout
SEPARATORS = (",", ";", "\t", " ")
COMMENTS = ("#", "%", "//")
POINT = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
COMMA = re.compile(r"[+-]?(\d*,\d+)([eE][+-]?\d+)?")
GROUPED = {  # numbers with thousands separators, by decimal sign
    ".": re.compile(r"[+-]?\d{1,3}([,' \u00a0\u2009\u202f]\d{3})+(\.\d*)?"),
    ",": re.compile(r"[+-]?\d{1,3}([.' \u00a0\u2009\u202f]\d{3})+(,\d*)?"),
}
SCOPE = {"netid", "port", "sampletime[ms]", "symbolname", "data-type"}  # labels of TwinCAT Scope's header
INSPECTOR = re.compile(r"(Unit|Interp|Type|BlockPath|PortIndex|Enum|Complexity|SignalID):\s*(.*)")
HELD = {"zoh": True, "linear": False}


class _Table(NamedTuple):
    """Where a text file's numbers begin, and how they are written."""

    line: int  # of the first sample, counted from 0
    separator: str
    widths: tuple[int, int]  # fewest and most fields of a row
    decimal: str


def read_text(path: Path, content: bytes) -> list[Channel]:
    """Channels of a text file.

    Raises
    ------
    InputError
        If there are no numbers in columns, no names above them, or too many rows or columns.
    """
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):  # Excel's "Unicode text"
        content = content.decode("utf-16", errors="replace").encode()
    content = content[:-1000] + re.sub(rb"[\s;,]+(EOF|END)[\s;,]*\Z", b"\n", content[-1000:])
    head = list(islice(io.BytesIO(content), HEAD_LINES + SAMPLE_LINES))
    try:
        encoding = "utf-8-sig"
        lines = [line.decode(encoding) for line in head]
    except UnicodeDecodeError:
        encoding = "latin-1"
        lines = [line.decode(encoding) for line in head]
    lines = [line.rstrip("\r\n") for line in lines]
    if any("\0" in line for line in lines):
        raise InputError(f"{path}: not a text file: export it as CSV, with names and units in the first row")
    table = _first_sample(path, lines)
    limit(path, table.widths[0], MOST_COLUMNS, "columns")
    above = [_fields(line, table.separator) for line in lines[: table.line]]
    if scope := _scope_names(above):
        names, units, time_unit = scope
        held: list[bool | None] = []
    else:
        names, units, held = _names(path, lines[: table.line], table)
        inspector = any(is_time(name) for name in names) and bool(held)
        time_unit = (
            "s"
            if inspector or "__time" in names or names[0].lower() == "x-axis"
            else "ns"
            if names[0] == "%time"
            else ""
        )
    columns = _columns(path, content, table, len(names), encoding)
    return table_channels(zip(names, columns, strict=False), units, held, table.line + 1, time_unit)


def _fields(line: str, separator: str) -> list[str]:
    """Fields of a line, without comment signs, quotes and empty ones at its end."""
    line = line.lstrip("#%/ ") if line.lstrip().startswith(COMMENTS) and "%time" not in line else line
    if separator == " ":
        return line.split()
    try:
        fields = [field.strip() for field in next(csv.reader([line], delimiter=separator), [])]
    except csv.Error:  # a field of more than 131,072 characters
        return []
    while fields and not fields[-1]:
        fields.pop()
    return fields


def _is_number(text: str) -> bool:
    patterns = (POINT, COMMA, *GROUPED.values())
    return text[:1] in "+-.,0123456789" and any(pattern.fullmatch(text) for pattern in patterns)


def _first_sample(path: Path, lines: Sequence[str]) -> _Table:
    """First line that is mostly numbers, with the separator by which most of its fields are numbers."""
    for index, line in enumerate(lines[:HEAD_LINES]):
        if line.lstrip().startswith(COMMENTS):
            continue
        best = (0.0, 0, "")
        for separator in SEPARATORS:
            fields = [field for field in _fields(line, separator) if field]
            count = sum(map(_is_number, fields))
            half = 2 * count == len(fields) and _is_number(fields[0]) if fields else False
            if count >= 2 and (2 * count > len(fields) or half):
                candidate = (count / len(fields), len(fields), separator)
                best = (
                    candidate if candidate[:2] > best[:2] else best
                )  # of several the first: a tab, not spaces
        if best[2]:
            separator = best[2]
            rows = [_fields(row, separator) for row in lines[index : index + SAMPLE_LINES]]
            widest = max(line.count(separator) + 1, len(rows[0])) if separator != " " else len(rows[0])
            narrowest = max(map(len, rows)) if separator != " " else len(rows[0])
            cells = [cell for row in rows for cell in row]
            return _Table(index, separator, (narrowest, max(widest, narrowest)), _decimal(cells))
    raise InputError(
        f"{path}: no numbers in columns within the first {HEAD_LINES} lines: export the record as CSV,"
        " with names and units in the first row"
    )


def _decimal(cells: Sequence[str]) -> str:
    """Decimal sign of numbers: that of those with both signs, or else the one that parts no thousands."""
    for cell in cells:
        if "," in cell and "." in cell and _is_number(cell):
            return max(",.", key=cell.rfind)
    commas = [cell for cell in cells if COMMA.fullmatch(cell)]
    points = [cell for cell in cells if "." in cell and POINT.fullmatch(cell)]
    if commas and points:
        return "," if any(not GROUPED["."].fullmatch(cell) for cell in commas) else "."
    return "," if commas else "."


def _names(path: Path, above: Sequence[str], table: _Table) -> tuple[list[str], list[str], list[bool | None]]:
    """Names of the columns, their units and rules from rows between names and numbers, if there are any."""
    (width, most), rows, halves = table.widths, list[list[str]](), False
    labels = dict[str, list[str]]()
    # Spaces part names last: they are within names more often than other separators.
    separators = sorted(dict.fromkeys((table.separator, *SEPARATORS[:3])), key=lambda s: s == " ")
    for line in above:
        splits = [_fields(line, separator) for separator in separators]
        halves |= table.separator == "," and 2 * len(splits[0]) == width
        matches = [INSPECTOR.fullmatch(field) for field in splits[0]]
        if any(matches) and all(match or not field for match, field in zip(matches, splits[0], strict=True)):
            label = next(match[1] for match in matches if match)
            labels[label] = [match[2] if match else "" for match in matches]
            continue
        # One more than numbers: LabVIEW has a column of comments that may be left out below.
        rows += [fields for fields in splits if width <= len(fields) <= most + 1][:1]
    if not rows:
        remedy = "write names and units there, such as P_A_kPa"
        if halves:
            remedy = (
                f"one has {width // 2}: decimal commas and commas between columns? export with semicolons"
            )
        raise InputError(f"{path}: no row of {width} names above the numbers: {remedy}")
    below = [plain_unit(field) for field in rows[-1]]
    has_units = len(rows) > 1 and 2 * sum(map(is_unit, below)) >= sum(map(bool, below))
    fields = rows[-2] if has_units else rows[-1]
    names = [field or f"column {number + 1}" for number, field in enumerate(fields)]
    units = below if has_units else list(map(plain_unit, labels.get("Unit", [])))
    rules: list[bool | None] = [HELD.get(rule) for rule in labels.get("Interp", [])]
    return names, units, rules if labels else []


def _scope_names(above: Sequence[Sequence[str]]) -> tuple[list[str], list[str], str] | None:
    """Names and units of TwinCAT Scope's export; its time columns are called Time.

    Each column of times has labels above it, those of values what the labels name.
    """
    rows = {row[0].lower(): row for row in above if len(row) > 1}
    if len(SCOPE & {*rows}) < 2 or "name" not in rows:
        return None
    titles = [row for row in above if row and row[0] == rows["name"][0]]
    label, row = titles[-1][0], titles[-1]
    units = rows.get("unit", [])
    names = ["Time" if name == label else name or f"column {k + 1}" for k, name in enumerate(row)]
    given = ["" if name == "Time" or k >= len(units) else units[k] for k, name in enumerate(names)]
    return names, given, "ms"


def _columns(path: Path, content: bytes, table: _Table, count: int, encoding: str) -> list[np.ndarray]:
    """Columns of a table as numbers, or as text where a field is none."""
    import pandas as pd

    frame = pd.read_csv(
        io.BytesIO(content),
        sep=r"\s+" if table.separator == " " else table.separator,
        decimal=table.decimal,
        skiprows=table.line,
        header=None,
        names=range(max(count, table.widths[1])),
        index_col=False,
        nrows=MOST_ROWS + 1,
        encoding=encoding,
        encoding_errors="replace",
        keep_default_na=False,
        na_values=["", "nan", "NaN", "NAN"],
        skip_blank_lines=False,
        low_memory=False,
    )
    limit(path, len(frame), MOST_ROWS, "rows or more")
    return [_plain(frame.iloc[:, k].to_numpy(), table.decimal) for k in range(min(count, frame.shape[1]))]


def _plain(values: np.ndarray, decimal: str) -> np.ndarray:
    """Column whose numbers have no thousands separators, and a point for a decimal comma."""
    if values.dtype.kind != "O":
        return values
    group = re.compile(r"[^\d+.-]" if decimal == "." else r"[^\d+,-]")

    def plain(text: object) -> object:
        if not isinstance(text, str):
            return "" if text is None or text != text else text
        text = text.strip()
        if GROUPED[decimal].fullmatch(text):
            text = group.sub("", text)
        return text.replace(",", ".") if decimal == "," and COMMA.fullmatch(text) else text

    return np.array([plain(value) for value in values], dtype=object)
