"""Tables in files of text: of loggers, spreadsheets, LabVIEW and ROS.

A file may begin with comments or any other lines; its table is the first run of numbers, with a row of
names above it, and perhaps one of units between.
"""

import csv
import io
import re
from itertools import islice
from pathlib import Path
from typing import NamedTuple

from pneumo.errors import InputError
from pneumo.fit.record.table import MOST_COLUMNS, MOST_ROWS, Table, limit

HEAD_LINES = 200  # within which the first sample must be
SEPARATORS = (",", ";", "\t", " ")
WITHOUT_COMMA = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
NUMBER = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?")
PLAIN = str.maketrans({"°": "deg", "µ": "u", "μ": "u", "³": "3"})
LVM, END_OF_HEADER = "LabVIEW Measurement", "***End_of_Header***"
ROS_TIME = "%time,"  # `rostopic echo -p`: nanoseconds


class _FirstSample(NamedTuple):
    """Where a text file's numbers begin."""

    line: int  # counted from 0
    separator: str
    width: int  # number of fields
    decimal_commas: bool  # whether numbers may have them: between commas in quotes, and beside no point


def plain_unit(text: str) -> str:
    """Unit without brackets, in ASCII: `degC` for `[°C]`."""
    return text.strip().removeprefix("[").removesuffix("]").translate(PLAIN).strip()


def text_table(path: Path, content: bytes, known_units: set[str]) -> Table:
    """Table of a text file: its first run of numbers, with the names above it and perhaps units between.

    The row below the names has units if at least half of its fields are in `known_units`. `InputError` if
    there are no numbers in columns, no names above them, too many rows or columns, or if the file is no text.
    """
    import numpy as np
    import pandas as pd

    head = list(islice(io.BytesIO(content), HEAD_LINES))
    if head and head[0].startswith((b"\xff\xfe", b"\xfe\xff")):  # Excel's "Unicode text"
        encoding = "utf-16"
        lines = list(islice(io.TextIOWrapper(io.BytesIO(content), encoding), HEAD_LINES))
    else:
        try:
            encoding = "utf-8-sig"
            lines = [line.decode(encoding) for line in head]
        except UnicodeDecodeError:
            encoding = "latin-1"
            lines = [line.decode(encoding) for line in head]
    lines = [line.rstrip("\r\n") for line in lines]
    if any("\0" in line for line in lines):
        raise InputError(f"{path}: not a text file: export it as CSV, with names and units in the first row")
    first = _first_sample(path, lines)
    limit(path, first.width, MOST_COLUMNS, "columns")
    names, units = _names(path, lines[: first.line], first, known_units)
    table = pd.read_csv(
        io.BytesIO(content),
        sep=r"\s+" if first.separator == " " else first.separator,
        skiprows=first.line,
        header=None,
        names=range(max(len(names), first.width + lines[first.line].endswith(first.separator))),
        index_col=False,
        nrows=MOST_ROWS + 1,
        dtype=str,
        encoding=encoding,
        encoding_errors="replace",
        keep_default_na=False,
        skip_blank_lines=False,
    ).fillna("")
    limit(path, len(table), MOST_ROWS, "rows or more")
    empty = (table == "").all(axis=1).to_numpy()
    table = table.iloc[: len(table) - int(np.argmin(empty[::-1])), : len(names)]  # blank lines at the end
    table.columns = names
    if first.decimal_commas and (first.separator != "," or b'"' in content):
        table = table.apply(lambda column: column.str.replace(",", "."))
    if lines[0].startswith(ROS_TIME):
        units = units | {names[0]: "ns"}
    if lines[0].startswith(LVM):
        return _labview(path, lines[: first.line], Table(table, units, first.line + 1))
    return Table(table, units, first.line + 1)


def _fields(line: str, separator: str) -> list[str]:
    """Fields of a line, without comment signs, quotes and empty ones at its end."""
    line = line.lstrip("#%/ ") if line.lstrip().startswith(("#", "%", "//")) else line
    if separator == " ":
        return line.split()
    fields = [field.strip() for field in next(csv.reader([line], delimiter=separator), [])]
    while fields and not fields[-1]:
        fields.pop()
    return fields


def _first_sample(path: Path, lines: list[str]) -> _FirstSample:
    """First line that is mostly numbers, with the separator that gives the most fields there."""
    ends = [index for index, line in enumerate(lines) if line.startswith(END_OF_HEADER)]
    for index, line in enumerate(lines):
        if ends and index < ends[-1]:
            continue
        samples: list[_FirstSample] = []
        for separator in SEPARATORS:
            fields = [] if line.startswith(("#", "%", "//")) else _fields(line, separator)
            pointed = any("." in field and WITHOUT_COMMA.fullmatch(field) for field in fields)
            commas = separator != "," or not pointed  # else those in quotes part thousands
            pattern = NUMBER if commas else WITHOUT_COMMA
            numbers = sum(bool(pattern.fullmatch(field)) for field in fields)
            if numbers >= 2 and 2 * numbers >= sum(bool(field) for field in fields):
                samples.append(_FirstSample(index, separator, len(fields), commas))
        if samples:
            return max(samples, key=lambda sample: sample.width)
    raise InputError(
        f"{path}: no numbers in columns within the first {HEAD_LINES} lines: export the record as CSV,"
        " with names and units in the first row"
    )


def _names(
    path: Path, above: list[str], first: _FirstSample, known: set[str]
) -> tuple[list[str], dict[str, str]]:
    """Names of the columns, and their units from a row between names and numbers, if there is one."""
    width, rows, halves = first.width, [], False
    # Spaces part names last: they are within names more often than other separators.
    separators = sorted(dict.fromkeys((first.separator, *SEPARATORS[:3])), key=lambda s: s == " ")
    for line in above:
        splits = [_fields(line, separator) for separator in separators]
        halves |= first.separator == "," and 2 * len(splits[0]) == width
        # One more than numbers: LabVIEW has a column of comments that may be left out below.
        rows += [fields for fields in splits if width <= len(fields) <= width + 1][:1]
    if not rows:
        remedy = "write names and units there, such as P_A_kPa"
        if halves:
            remedy = (
                f"one has {width // 2}: decimal commas and commas between columns? export with semicolons"
            )
        raise InputError(f"{path}: no row of {width} names above the numbers: {remedy}")
    below = [plain_unit(field) for field in rows[-1]]
    has_units = len(rows) > 1 and 2 * sum(unit in known for unit in below) >= sum(map(bool, below))
    fields = rows[-2] if has_units else rows[-1]
    names: list[str] = []
    for number, field in enumerate(fields):
        name = field or f"column {number + 1}"
        names.append(f"{name}.{number + 1}" if name in names else name)
    return names, dict(zip(names, below, strict=False)) if has_units else {}


def _labview(path: Path, above: list[str], table: Table) -> Table:
    """Table with the units of an .lvm file's header, and with times from it if their column is empty."""
    import numpy as np

    header: dict[str, list[str]] = {}
    for line in above:
        key, *values = line.replace(",", ".").split("\t") if "\t" in line else line.split(",")
        header[key.strip()] = [value.strip() for value in values]

    def first(key: str) -> str:
        return next(iter(header.get(key, [])), "")

    if first("X_Columns") == "Multi" or first("Multi_Headings") == "Yes":
        raise InputError(
            f"{path}: each channel has its own X column, or there are headings between the rows: export the"
            " file again with one header, and with one X column or none"
        )
    columns, (time, *channels) = table.columns, list(table.columns.columns)
    units = dict(zip(channels, map(plain_unit, header.get("Y_Unit_Label", [])), strict=False))
    if bool((columns[time] == "").to_numpy().all()) and first("Delta_X"):
        step = float(first("Delta_X"))
        columns = columns.assign(**{time: float(first("X0") or 0) + step * np.arange(len(columns))})
    return Table(columns, units | table.units | {time: "s"}, table.first_line)
