"""Tables of a measurement from files: text, LabVIEW .lvm, MATLAB .mat, NetCDF. `FORMATS` has a row for each.

A text file may begin with comments or any other lines; its table is the first run of numbers, with a row of
names above it, and perhaps one of units between. Readers import their libraries themselves: the help of the
command line lists the formats without loading any.
"""

import csv
import re
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from pneumo.errors import InputError, printable

if TYPE_CHECKING:
    import pandas as pd

MOST_ROWS, MOST_COLUMNS = 2_000_000, 200
LARGEST_FILE = 200_000_000  # bytes
HEAD_LINES = 200  # within which the first sample must be
SEPARATORS = (",", ";", "\t", " ")
NUMBER = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?")
WITHOUT_COMMA = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")  # where commas separate columns
PLAIN = str.maketrans({"°": "deg", "µ": "u", "μ": "u", "³": "3"})
LVM, END_OF_HEADER = "LabVIEW Measurement", "***End_of_Header***"
NUMERIC = {f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)} | {"double", "single"}


class Table(NamedTuple):
    """Columns of a file as text or numbers."""

    columns: "pd.DataFrame"
    units: dict[str, str]  # by name of the column, where the name does not contain them
    first_line: int = 0  # of the first sample; 0 where the file has no lines


class _FirstSample(NamedTuple):
    """Where a text file's numbers begin."""

    line: int  # counted from 0
    separator: str
    width: int  # number of fields


def plain_unit(text: str) -> str:
    """Unit without brackets, in ASCII: `degC` for `[°C]`."""
    return text.strip().removeprefix("[").removesuffix("]").translate(PLAIN).strip()


def _limit(path: Path, number: int, most: int, things: str) -> None:
    if number > most:
        raise InputError(f"{path}: {number} {things}: must be at most {most}")


def _netcdf(path: Path, _known_units: set[str]) -> Table:
    import pandas as pd
    import xarray as xr
    from netCDF4 import Dataset

    with Dataset(path.absolute()) as file:  # before xarray, which loads coordinates as it opens
        _limit(path, len(file.variables), MOST_COLUMNS, "variables")
        for name, dimension in file.dimensions.items():
            _limit(path, dimension.size, MOST_ROWS, f"samples along {printable(name, 30)}")
    with xr.open_dataset(path.absolute(), engine="netcdf4", decode_times=False) as data:
        signals = [name for name in data.variables if data[name].ndim == 1]
        units = {str(n): str(data[n].attrs.get("units", "")).replace(" s-1", "/s") for n in signals}
        return Table(pd.DataFrame({str(n): data[n].values for n in signals}), units)


def _matlab(path: Path, _known_units: set[str]) -> Table:
    """Vectors of a .mat file, the longest and those of its length."""
    import numpy as np
    import pandas as pd
    from scipy.io import loadmat, whosmat

    with path.open("rb") as file:
        if b"MATLAB 7.3" in file.read(128):
            raise InputError(
                f"{path}: MATLAB 7.3 files are not read: save(file, '-v7') in MATLAB writes one that is"
            )
    listed = whosmat(path, appendmat=False)  # sizes, before anything is loaded
    _limit(path, len(listed), MOST_COLUMNS, "variables")
    sizes = {
        name: int(np.prod(shape, dtype=float))
        for name, shape, kind in listed
        if kind in NUMERIC and sum(n != 1 for n in shape) == 1
    }
    longest = max(sizes.values(), default=0)
    _limit(path, longest, MOST_ROWS, "samples in a vector")
    names = [name for name, size in sizes.items() if size == longest]
    if not names:
        raise InputError(
            f"{path}: holds no vectors of numbers: save each signal as a vector of its own, such as P_A_kPa"
        )
    loaded = loadmat(path, appendmat=False, variable_names=names)
    return Table(pd.DataFrame({name: loaded[name].ravel() for name in names}), {})


def _text(path: Path, known_units: set[str]) -> Table:
    import numpy as np
    import pandas as pd

    with path.open("rb") as file:
        head = list(islice(file, HEAD_LINES))
    if head and head[0].startswith((b"\xff\xfe", b"\xfe\xff")):  # Excel's "Unicode text"
        encoding = "utf-16"
        with path.open(encoding=encoding) as file:
            lines = list(islice(file, HEAD_LINES))
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
    _limit(path, first.width, MOST_COLUMNS, "columns")
    names, units = _names(path, lines[: first.line], first, known_units)
    table = pd.read_csv(
        path,
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
    _limit(path, len(table), MOST_ROWS, "rows or more")
    empty = (table == "").all(axis=1).to_numpy()
    table = table.iloc[: len(table) - int(np.argmin(empty[::-1])), : len(names)]  # blank lines at the end
    table.columns = names
    if first.separator != ",":
        table = table.apply(lambda column: column.str.replace(",", "."))
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
    """First line that is mostly numbers, split where that gives the most of them."""
    ends = [index for index, line in enumerate(lines) if line.startswith(END_OF_HEADER)]
    for index, line in enumerate(lines):
        if ends and index < ends[-1]:
            continue
        widths: dict[str, int] = {}
        for separator in SEPARATORS:
            fields = [] if line.startswith(("#", "%", "//")) else _fields(line, separator)
            pattern = WITHOUT_COMMA if separator == "," else NUMBER
            numbers = sum(bool(pattern.fullmatch(field)) for field in fields)
            if numbers >= 2 and 2 * numbers >= sum(bool(field) for field in fields):
                widths[separator] = len(fields)
        if widths:
            separator = max(widths, key=lambda s: widths[s])
            return _FirstSample(index, separator, widths[separator])
    raise InputError(
        f"{path}: no numbers in columns within the first {HEAD_LINES} lines: export the record as CSV,"
        " with names and units in the first row"
    )


def _names(
    path: Path, above: list[str], first: _FirstSample, known: set[str]
) -> tuple[list[str], dict[str, str]]:
    """Names of the columns, and their units from a row between names and numbers, if there is one."""
    width, rows = first.width, []
    for line in above:
        splits = (_fields(line, separator) for separator in dict.fromkeys((first.separator, *SEPARATORS[:3])))
        # One more than numbers: LabVIEW has a column of comments that may be left out below.
        rows += [fields for fields in splits if width <= len(fields) <= width + 1][:1]
    if not rows:
        raise InputError(
            f"{path}: no row of {width} names above the numbers: write names and units there, such as P_A_kPa"
        )
    below = [plain_unit(field) for field in rows[-1]]
    has_units = len(rows) > 1 and 2 * sum(unit in known for unit in below) >= sum(map(bool, below))
    fields = rows[-2] if has_units else rows[-1]
    names: list[str] = []
    for number, field in enumerate(fields):
        name = field or f"column {number + 1}"
        names.append(f"{name}.{number + 1}" if name in names else name)
    return names, dict(zip(names, below, strict=False)) if has_units else {}


def _labview(path: Path, above: list[str], table: Table) -> Table:
    """Table with the units of an .lvm file's header, and with time where there is no column of it."""
    import numpy as np

    header: dict[str, list[str]] = {}
    for line in above:
        key, *values = line.replace(",", ".").split("\t") if "\t" in line else line.split(",")
        header[key.strip()] = [value.strip() for value in values]

    def first(key: str) -> str:
        return next(iter(header.get(key, [])), "")

    if first("X_Columns") == "Multi" or first("Multi_Headings") == "Yes":
        raise InputError(
            f"{path}: X columns for each channel or headings for each segment: write the file with one header"
            " and one X column at most"
        )
    columns, (time, *channels) = table.columns, list(table.columns.columns)
    units = dict(zip(channels, map(plain_unit, header.get("Y_Unit_Label", [])), strict=False))
    if bool((columns[time] == "").to_numpy().all()) and first("Delta_X"):
        step = float(first("Delta_X"))
        columns = columns.assign(**{time: float(first("X0") or 0) + step * np.arange(len(columns))})
    return Table(columns, units | table.units | {time: "s"}, table.first_line)


class Format(NamedTuple):
    """Format of a file, by the ending of its name."""

    suffixes: tuple[str, ...]  # none: every other one
    name: str
    read: Callable[[Path, set[str]], Table] | None
    remark: str  # for a format that is not read: what to do


FORMATS = (
    Format((), "CSV", _text, "separated by commas, semicolons, tabs or spaces; UTF-8, UTF-16 or Latin-1"),
    Format((".lvm",), "LabVIEW", _text, "one header, and one X column at most"),
    Format((".mat",), "MATLAB", _matlab, "up to version 7; a vector for each signal"),
    Format((".nc",), "NetCDF", _netcdf, "one-dimensional variables with the attribute units"),
    Format((".xls", ".xlsx"), "Excel", None, "save the sheet as CSV"),
    Format((".tdms",), "TDMS", None, "export it from LabVIEW as .lvm or CSV"),
    Format((".mdf", ".mf4"), "MDF", None, "export it as CSV or .mat"),
    Format((".idf",), "ControlDesk", None, "export it from ControlDesk as CSV or .mat"),
)


def read_table(path: Path, known_units: set[str]) -> Table:
    """Table of a file in one of the `FORMATS`.

    Of text, a row below the names is one of units where half of it is in `known_units`. `InputError` if the
    file cannot be read, is too large, or is in an unsupported format.
    """
    suffix = path.suffix.lower()
    kind = next((form for form in FORMATS if suffix in form.suffixes), FORMATS[0])
    try:
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: must be a file of at most {LARGEST_FILE} bytes")
        _limit(path, path.stat().st_size, LARGEST_FILE, "bytes")
        if kind.read is None:
            raise InputError(f"{path}: {suffix} files are not read: {kind.remark}")
        return kind.read(path, known_units)
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, ValueError, LookupError, RuntimeError, TypeError, csv.Error) as error:
        text = printable(" ".join(str(error).split()), 200)
        raise InputError(f"{path}: not a readable {kind.name} file ({text})") from None
