"""Text files of loggers: their layout is found by their content.

A file may begin with comments, settings or any other lines. Its table is the longest run of rows of numbers,
with a row of names above it and perhaps one of units between. Other layouts: TwinCAT Scope's blocks of a
channel each, the labelled rows of Simulink's Data Inspector and of oscilloscopes, and the lines of serial
monitors.
"""

import csv
import io
import re
from collections.abc import Iterator, Sequence
from itertools import islice, pairwise, zip_longest
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from pneumo.errors import InputError
from pneumo.fitting.record.channel import MOST_ROWS, WORDS, Channel, is_time, limit, table_channels
from pneumo.fitting.record.clocks import Setting, letters, with_stated_clock
from pneumo.fitting.record.units import is_unit, plain_unit

HEAD_LINES, SAMPLE_LINES = 200, 50  # within which the first sample must be; rows that show the layout
SEPARATORS = (",", ";", "\t", " ")
COMMENTS = ("#", "%", "//")
POINT = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
COMMA = re.compile(r"[+-]?(\d*,\d+)([eE][+-]?\d+)?")
SPACES = "\u00a0\u2009\u202f"  # as characters: Arrow, where pandas uses it, has no such escapes
GROUPED = {  # numbers with thousands separators, by decimal sign
    ".": re.compile(rf"[+-]?\d{{1,3}}([,' {SPACES}]\d{{3}})+(\.\d*)?"),
    ",": re.compile(rf"[+-]?\d{{1,3}}([.' {SPACES}]\d{{3}})+(,\d*)?"),
}
SCOPE = {"netid", "port", "sampletimems", "symbolname", "datatype"}  # labels of TwinCAT Scope's header
INSPECTOR = re.compile(r"(Unit|Interp|Type|BlockPath|PortIndex|Enum|Complexity|SignalID):\s*(.*)")
NO_NUMBERS = {"nan", "null", "none", "inf", "qnan", "ind"}
HELD = {"zoh": True, "linear": False}
NAMES = {"label", "labels", "name", "names", "tracename", "channelname"}  # labels of rows
UNITS = {"unit", "units", "verticalunits", "vunit"}
SETTING = re.compile(  # "tInc = 1e-3", "Sample rate: 1 kHz"
    r"\s*(?P<name>[^\W\d][^=:]*?)\s*[=:]\s*(?P<value>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>[A-Za-zµ/]*)\s*"
)
BRACKETS = re.compile(r"(.*?)\s*[\[(](.*)[\])]")
MOST_COLUMNS = 2_000
STAMPED = re.compile(r"[ \t]*(\d\d:\d\d:\d\d(?:[.,]\d+)?)[ \t]*->[ \t]*")  # of serial monitors
STAMP = re.compile(r"\d\d:\d\d:\d\d(?:[.,]\d+)?")
PAIR = re.compile(
    r"([^\W\d][^:=,;\t]*?)\s*[:=]\s*([+-]?[\d.](?:[^\s,;]|,(?=\d))*|nan|inf)(?:[,;\t ]+|$)", re.IGNORECASE
)
PAIRS = re.compile(rf"(?:{PAIR.pattern}){{2,}}", re.IGNORECASE)
TIME_UNITS = {"__time": "s", "x-axis": "s", "%time": "ns"}  # of PlotJuggler, ControlDesk and rostopic


class _Table(NamedTuple):
    """Where a text file's numbers begin, and how they are written."""

    line: int  # of the first sample, counted from 0
    separator: str
    width: int  # columns that have values
    most: int  # columns with empty ones
    decimal: str


def read_text(path: Path, content: bytes) -> list[Channel]:
    """Channels of a text file; without a column of times they have the clock that the file states.

    `InputError` if there are no numbers in columns, no names above them, or too many rows or columns.
    """
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):  # Excel's "Unicode text"
        content = content.decode("utf-16", errors="replace").encode()
    for line in islice(io.BytesIO(content), HEAD_LINES + SAMPLE_LINES):
        limit(path, max(line.count(s) for s in (b",", b";", b"\t")) + 1, MOST_COLUMNS, "columns")
    content = content[:-1000] + re.sub(rb"(?i)[\s;,]+(EOF|END)\b[^\n]*\s*\Z", b"\n", content[-1000:])
    if b"\0" in content[:100_000]:
        raise InputError(f"{path}: not a text file: export it as CSV, with names and units in the first row")
    content, added = _plain_lines(content)
    head = b"".join(islice(io.BytesIO(content), HEAD_LINES + SAMPLE_LINES))
    try:
        encoding, text = "utf-8-sig", head.decode("utf-8-sig")
    except UnicodeDecodeError:
        encoding, text = "latin-1", head.decode("latin-1")
    lines = re.split(r"\r*\n", text)
    table = _first_sample(path, lines)
    above = lines[: table.line]
    header = _header(path, above, table)
    columns = _columns(path, content, table, len(header), encoding)
    first_line = table.line + 1 - added  # in the file as it is, for messages
    named = zip(header, columns, strict=False)
    channels = [c._replace(values=v, first_line=first_line) for c, v in named if not _is_setting(c.name)]
    return with_stated_clock(table_channels(channels), _settings(above, table.separator))


def _is_setting(name: str) -> bool:
    """Whether a column's name is a setting, or the name of one, below which there are no samples."""
    return SETTING.fullmatch(name) is not None or letters(name) in ("start", "increment")


def _plain_lines(content: bytes) -> tuple[bytes, int]:
    """Lines of a serial monitor as those of a table: its stamps in a column, names of pairs in a row above.

    Beside them is how many lines were added.
    The stamp before an arrow is when a line arrived; `t_us:1000,u_V:1.3` is what Arduino's plotter reads.
    """
    head = content[:20_000].decode(errors="replace").splitlines()[:HEAD_LINES]
    stamped = [line for line in head if STAMPED.match(line)]
    names = next((one for one, other in pairwise(map(_pair_names, head)) if one and one == other), [])
    if len(stamped) < 2 and not names:
        return content, 0
    separator = ";" if names else max(",;\t ", key=stamped[0].partition("->")[2].count)
    rows, header = list[str](), separator.join(names)
    above = True  # no samples yet
    for line in content.decode(errors="replace").splitlines():
        stamp = STAMPED.match(line)
        row = line[stamp.end() :] if stamp else line
        is_sample = _pair_names(line) == names if names else stamp is not None
        if names and is_sample:
            row = separator.join(value for _, value in PAIR.findall(row))
        if above and is_sample:
            while rows and not header:
                header = rows.pop().strip()
            rows.append(f"Time{separator}{header}" if stamp and header else header)
            above = False
        rows.append(f"{stamp[1]}{separator}{row}" if stamp else row)
    return "\n".join(rows).encode(), int(bool(names))


def _pair_names(line: str) -> list[str]:
    """Names of a line that has nothing but pairs of a name and a number; else none."""
    pairs = line.rpartition("->")[2].strip()
    return [name for name, _ in PAIR.findall(pairs)] if PAIRS.fullmatch(pairs) else []


def _settings(above: Sequence[str], separator: str) -> Iterator[Setting]:
    """Numbers that lines above a table state: `name = number`, a row of both, or a name above its number."""
    rows = [_fields(line, separator) for line in above]
    for row, below in zip(rows, [*rows[1:], []], strict=True):  # below the last are samples, no settings
        beside, beneath = pairwise(row), zip(row, below, strict=False)
        for name, number in [*beside, *beneath]:
            label = BRACKETS.fullmatch(name)
            if POINT.fullmatch(number):
                yield Setting(label[1] if label else name, float(number), label[2] if label else "")
        for match in filter(None, map(SETTING.fullmatch, row)):
            yield Setting(match["name"], float(match["value"]), match["unit"])


def _fields(line: str, separator: str) -> list[str]:
    """Fields of a line, without comment signs, quotes and empty ones at its end."""
    line = line.lstrip("#%/ ") if line.lstrip().startswith(COMMENTS) and "%time" not in line else line
    if separator == " ":
        return line.split()
    try:
        row = next(csv.reader([line], delimiter=separator, skipinitialspace=separator != "\t"), [])
    except csv.Error:  # a field of more than 131,072 characters
        return []
    fields = [field.strip() for field in row]
    while fields and not fields[-1]:
        fields.pop()
    return fields


def _is_number(text: str) -> bool:
    patterns = (POINT, COMMA, *GROUPED.values())
    return text[:1] in "+-.,0123456789" and any(pattern.fullmatch(text) for pattern in patterns)


def _first_sample(path: Path, lines: Sequence[str]) -> _Table:
    """First line of the longest run of lines that are mostly numbers, and how they are written.

    The separator is that by which most fields of this line are numbers.
    """

    def numeric(line: str, separator: str) -> tuple[float, int]:
        fields = [field for field in _fields(line, separator) if field]
        count = sum(map(_is_number, fields))
        mostly = count >= 2 and 2 * count + _is_number(fields[0]) > len(fields)
        return (count / len(fields), len(fields)) if mostly else (0.0, 0)

    runs, words = list[list[int]](), True  # line numbers; whether the line before was no row of numbers
    for index, line in enumerate(lines):
        if line.lstrip().startswith(COMMENTS) or not line.strip():
            continue
        if any(numeric(line, separator)[1] for separator in SEPARATORS):
            if words:
                runs.append([])
            runs[-1].append(index)
            words = False
        elif not {word.lower() for word in re.findall(r"[^\W\d]{2,}", line)} <= WORDS.keys() | NO_NUMBERS:
            words = True  # else a row of numbers with many empty fields
    runs = [run for run in runs if run[0] < HEAD_LINES]
    if not runs:
        problem = f"no numbers in columns within the first {HEAD_LINES} lines"
        raise InputError(f"{path}: {problem}: export CSV with names and units in the first row")
    run = max(runs, key=len)
    index = run[0]
    # Of several the first: a tab, not spaces.
    separator = max(SEPARATORS, key=lambda s: numeric(lines[run[-1]], s))
    first = [_fields(lines[k], separator)[0] for k in run[:2]]
    if len(run) > 1 and re.match(r"[^\W\d]", first[0]) and not re.match(r"[^\W\d]", first[1]):
        index = run[1]  # names that are numbers, but for that of the time
    rows = [_fields(row, separator) for row in lines[index : index + SAMPLE_LINES]]
    width = max(map(len, rows)) if separator != " " else len(rows[0])
    most = max(width, lines[index].count(separator) + 1) if separator != " " else width
    return _Table(index, separator, width, most, _decimal([cell for row in rows for cell in row]))


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


def _header(path: Path, above: Sequence[str], table: _Table) -> list[Channel]:
    """Channels without values: names, and units and rules from rows between names and numbers."""
    rows, inspector, halves = list[list[str]](), dict[str, list[str]](), False
    # Spaces part names last: they are within names more often than other separators.
    separators = sorted(dict.fromkeys((table.separator, *SEPARATORS[:3])), key=lambda s: s == " ")
    for line in above:
        splits = [_fields(line, separator) for separator in separators]
        halves |= table.separator == "," and 2 * len(splits[0]) == table.width
        matches = [INSPECTOR.fullmatch(field) for field in splits[0]]
        label = next((match[1] for match in matches if match), "")
        if label and all(match or not field for match, field in zip(matches, splits[0], strict=True)):
            inspector[letters(label)] = [match[2] if match else "" for match in matches]
        else:
            # One more than numbers: a column of comments may be left out below.
            shorter = (_without_settings(fields, table.width) for fields in splits)
            rows += [fields for fields in shorter if table.width <= len(fields) <= table.most + 1][:1]
    if not rows:
        remedy = "write names and units there, such as P_A_kPa"
        if halves:
            half = table.width // 2
            remedy = f"one has {half}: decimal commas and commas between columns? export with semicolons"
        raise InputError(f"{path}: no row of {table.width} names above the numbers: {remedy}")
    by_label = {letters(row[0]): _entries(row) for row in rows} | inspector
    below = list(map(plain_unit, _entries(rows[-1])))
    has_units = len(rows) > 1 and 2 * sum(map(is_unit, below)) >= sum(map(bool, below))
    fields = rows[-2] if has_units else rows[-1]
    scope = len(SCOPE & by_label.keys()) > 1
    named = NAMES & by_label.keys() - (set() if scope else {letters(fields[0])})
    labels_of = next((by_label[key] for key in named), [])
    units_of = next((by_label[key] for key in UNITS & by_label.keys() - {letters(rows[-1][0])}), [])
    if labels_of and not is_time(fields[0]):  # rows of settings only
        fields, has_units = labels_of, has_units and not units_of
    unnamed = "Time" if scope else "column {}"
    names = [field or unnamed.format(number) for number, field in enumerate(fields, start=1)]
    names = ["Time" if STAMP.fullmatch(name) else name for name in names]
    time_unit = next((TIME_UNITS[n.lower()] for n in names if n.lower() in TIME_UNITS), "")
    time_unit = "s" if inspector else "ms" if scope else time_unit
    time_unit = time_unit or next(iter(re.findall(r"(?i)horizontal units?\W+(\w+)", "\n".join(above))), "")
    units = below if has_units else map(plain_unit, units_of)
    held = map(HELD.get, by_label.get("interp", []))
    described = islice(zip_longest(names, units, held, labels_of), len(names))
    made = [(label or name, unit or "", rule, name if label else "") for name, unit, rule, label in described]
    return [
        Channel(name, np.empty(0), unit or (time_unit if is_time(name) else ""), held=rule, other=other)
        for name, unit, rule, other in made
    ]


def _entries(row: list[str]) -> list[str]:
    """Fields of a row whose label names it, empty where the label is, as for TwinCAT's columns of times."""
    return ["" if field == row[0] else field for field in row] if letters(row[0]) in NAMES | UNITS else row


def _without_settings(fields: list[str], width: int) -> list[str]:
    """Fields of a row above the numbers, without a start and an increment behind the names or units."""
    end = len(fields)
    while end > width and (fields[end - 1].lower() in ("start", "increment") or _is_number(fields[end - 1])):
        end -= 1
    return fields[:end]


def _columns(path: Path, content: bytes, table: _Table, count: int, encoding: str) -> list[np.ndarray]:
    """Columns of a table as numbers, or as text where a field is none."""
    frame = pd.read_csv(
        io.BytesIO(content),
        sep=r"\s+" if table.separator == " " else table.separator,
        decimal=table.decimal,
        skiprows=table.line,
        header=None,
        names=range(max(count, table.most)),
        index_col=False,
        nrows=MOST_ROWS + 1,
        encoding=encoding,
        encoding_errors="replace",
        keep_default_na=False,
        na_values=["", "nan", "NaN", "NAN"],
        skip_blank_lines=False,
        skipinitialspace=table.separator != "\t",
        low_memory=False,
    )
    limit(path, len(frame), MOST_ROWS, "rows or more")
    return [_plain(frame.iloc[:, k], table.decimal) for k in range(min(count, frame.shape[1]))]


def _plain(column: pd.Series, decimal: str) -> np.ndarray:
    """Values of a column; in text, numbers without thousands separators, and a point for a decimal comma."""
    if column.dtype.kind in "iufb":
        return column.to_numpy()
    text = column.astype(object).where(column.notna(), "").astype(str).str.strip()
    ungrouped = text.str.replace(rf"[^\d{decimal}+-]", "", regex=True)
    text = text.mask(text.str.fullmatch(GROUPED[decimal]), ungrouped)
    if decimal == ",":
        text = text.mask(text.str.fullmatch(COMMA), text.str.replace(",", "."))
    return text.to_numpy(dtype=object)
