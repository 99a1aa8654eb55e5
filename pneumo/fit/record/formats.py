"""Tables of a measurement from files of text, spreadsheets and instruments; `FORMATS` has a row for each.

A text file may begin with comments or any other lines; its table is the first run of numbers, with a row of
names above it, and perhaps one of units between. Readers import their libraries themselves: the help of the
command line lists the formats without loading any.
"""

import csv
import gzip
import importlib
import io
import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Mapping
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from pneumo.errors import InputError, printable
from pneumo.regular_file import regular_file

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

MOST_ROWS, MOST_COLUMNS = 2_000_000, 200
LARGEST_FILE = 200_000_000  # bytes
HEAD_LINES = 200  # within which the first sample must be
SEPARATORS = (",", ";", "\t", " ")
NUMBER = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?")
WITHOUT_COMMA = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")  # where commas separate columns
PLAIN = str.maketrans({"°": "deg", "µ": "u", "μ": "u", "³": "3"})
LVM, END_OF_HEADER = "LabVIEW Measurement", "***End_of_Header***"
ROS_TIME = "%time,"  # `rostopic echo -p`: nanoseconds
COMPRESSED, CHUNK = 15, 1 << 20  # type of a packed variable of MATLAB; bytes unpacked at once


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
    import xarray as xr
    from netCDF4 import Dataset

    with Dataset(path.absolute()) as file:  # before xarray, which loads coordinates as it opens
        _limit(path, len(file.variables), MOST_COLUMNS, "variables")
        for name, dimension in file.dimensions.items():
            _limit(path, dimension.size, MOST_ROWS, f"samples along {printable(name, 30)}")
    with xr.open_dataset(path.absolute(), engine="netcdf4", decode_times=False) as data:
        return _one_dimensional(data)


def _of_longest(path: Path, signals: Mapping[str, Any], units: dict[str, str]) -> Table:
    """Table of the longest vectors; shorter ones are constants or other recordings."""
    import pandas as pd

    longest = max((len(signal) for signal in signals.values()), default=0)
    _limit(path, longest, MOST_ROWS, "samples in a vector")
    if longest < 2:
        raise InputError(
            f"{path}: holds no vectors of numbers: save each signal as a vector of its own, such as P_A_kPa"
        )
    kept = {name: signal for name, signal in signals.items() if len(signal) == longest}
    _limit(path, len(kept), MOST_COLUMNS, "signals")
    return Table(pd.DataFrame(kept), units)


def given_table(source: "pd.DataFrame | xr.Dataset") -> Table:
    """Table from one in memory; the index of a data frame is a column if it has a name."""
    import xarray as xr

    if isinstance(source, xr.Dataset):
        return _one_dimensional(source)
    return Table(source.reset_index() if source.index.name else source, {})


def _one_dimensional(data: "xr.Dataset") -> Table:
    """`Table` of a dataset's one-dimensional variables."""
    import pandas as pd

    signals = [name for name in data.variables if data[name].ndim == 1]
    units = {str(n): str(data[n].attrs.get("units", "")).replace(" s-1", "/s") for n in signals}
    return Table(pd.DataFrame({str(n): data[n].values for n in signals}), units)


def _matlab(path: Path, _known_units: set[str]) -> Table:
    """Vectors, columns of matrices and members of structs of a .mat file, if as long as the longest."""
    from scipy.io import loadmat

    with path.open("rb") as file:
        if b"MATLAB 7.3" in file.read(128):
            return _matlab_hdf5(path)
    _limit(path, _unpacked_size(path), LARGEST_FILE, "bytes when unpacked")
    loaded = loadmat(path, appendmat=False, struct_as_record=False, squeeze_me=True)
    signals: dict[str, Any] = {}
    units: dict[str, str] = {}
    for name, value in loaded.items():
        if not name.startswith("__"):
            _add_signals(name, value, signals, units)
    return _of_longest(path, signals, units)


def _unpacked_size(path: Path) -> int:
    """Bytes that a .mat file has once its compressed variables are unpacked, or just over `LARGEST_FILE`."""
    total = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(128)
        if len(head) < 128 or head[124:128] not in (b"\0\1IM", b"\1\0MI"):
            return total  # version 4 compresses nothing
        order = "<" if head[126:128] == b"IM" else ">"
        while len(tag := file.read(8)) == 8 and total <= LARGEST_FILE:
            kind, size = struct.unpack(f"{order}II", tag)
            unpack, packed = zlib.decompressobj(), file.read(size)
            while kind == COMPRESSED and packed and total <= LARGEST_FILE:
                total += len(unpack.decompress(packed, CHUNK))
                packed = unpack.unconsumed_tail
    return total


def _add_signals(name: str, value: Any, signals: dict[str, Any], units: dict[str, str]) -> None:
    """Add the numeric vectors in a variable of MATLAB, by their own names; structs name their members.

    A struct of Simulink's block To Workspace has time and signals, one of dSPACE X and Y with Name and Data.
    """
    import numpy as np

    members = {field: getattr(value, field) for field in getattr(value, "_fieldnames", ())}
    if "signals" in members and "values" in getattr(members["signals"], "_fieldnames", ("values",)):
        _add_signals("Time", members.pop("time", np.empty(0)), signals, units)
        units["Time"] = "s"
    if "Data" in members or "values" in members:
        data = members.get("Data", members.get("values"))
        named = [members.get(field) for field in ("Name", "label")]
        label = next((text for text in named if isinstance(text, str) and text), "")
        label = (label or ("Time" if name == "X" else name)).split("/")[-1]
        if label == "Time":
            units["Time"] = "s"
        if isinstance(unit := members.get("Unit"), str):
            units[label] = unit
        return _add_signals(label, data, signals, units)
    for field, member in members.items():
        _add_signals(field, member, signals, units)
    array = np.asarray(value) if isinstance(value, np.ndarray) else np.empty(0)
    if array.dtype == object:
        for member in array.ravel():
            _add_signals(name, member, signals, units)
    elif array.dtype.kind in "iuf" and array.ndim == 1 and len(array) > 1:
        signals.setdefault(name, array)
    elif array.dtype.kind in "iuf" and array.ndim == 2:
        for number, column in enumerate(array.T if array.size < len(array) ** 2 else array, start=1):
            signals.setdefault(f"{name}.{number}", column)
    return None


def _matlab_hdf5(path: Path) -> Table:
    h5py = _imported("h5py", path, "MATLAB 7.3", "or save(file, '-v7') in MATLAB")
    signals: dict[str, Any] = {}

    def add(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or name.startswith("#") or item.dtype.kind not in "iuf":
            return
        _limit(path, item.size, MOST_ROWS * MOST_COLUMNS, "numbers in a matrix")
        _add_signals(name.split("/")[-1], item[()].squeeze(), signals, {})

    with h5py.File(path) as file:
        file.visititems(add)
    return _of_longest(path, signals, {"time": "s"} if "time" in signals else {})


def _imported(package: str, path: Path, kind: str, otherwise: str) -> Any:
    """Module of an optional package; `InputError` with the remedy where it is not installed."""
    try:
        return importlib.import_module(package)
    except ImportError:
        remedy = f"pip install 'pneumo[formats]' (here {package.partition('.')[0]}), {otherwise}"
        raise InputError(f"{path}: {kind} files are not read without a library: {remedy}") from None


def _parquet(path: Path, _known_units: set[str]) -> Table:
    parquet = _imported("pyarrow.parquet", path, "Parquet", "or export CSV")
    file = parquet.ParquetFile(path)
    _limit(path, file.metadata.num_rows, MOST_ROWS, "rows")
    _limit(path, file.metadata.num_columns, MOST_COLUMNS, "columns")
    return Table(file.read().to_pandas(), {})


def _feather(path: Path, _known_units: set[str]) -> Table:
    feather = _imported("pyarrow.feather", path, "Feather", "or export CSV")
    table = feather.read_table(path, memory_map=True)
    _limit(path, table.num_rows, MOST_ROWS, "rows")
    _limit(path, table.num_columns, MOST_COLUMNS, "columns")
    return Table(table.to_pandas(), {})


def _excel(path: Path, known_units: set[str]) -> Table:
    """First sheet of a workbook, read as the text that saving it as CSV would give."""
    openpyxl = _imported("openpyxl", path, "Excel", "or save the sheet as CSV")
    try:
        sheet = openpyxl.load_workbook(path, read_only=True, data_only=True).worksheets[0]
        _limit(path, sheet.max_row or 0, MOST_ROWS, "rows")
        lines = [
            "\t".join("" if cell is None else str(cell) for cell in row)
            for row in sheet.iter_rows(values_only=True)
        ]
    except (zipfile.BadZipFile, KeyError) as error:
        raise ValueError(str(error)) from None
    return _text_table(path, "\n".join(lines).encode(), known_units)


def _tdms(path: Path, _known_units: set[str]) -> Table:
    """Channels of a .tdms file by name, and the time of their waveform where no channel has it."""
    tdms = _imported("nptdms", path, "TDMS", "or export it from LabVIEW as .lvm or CSV")
    signals: dict[str, Any] = {}
    units: dict[str, str] = {}
    with tdms.TdmsFile.open(path) as file:
        for channel in (channel for group in file.groups() for channel in group.channels()):
            _limit(path, len(channel), MOST_ROWS, "samples in a channel")
            signals[channel.name] = channel[:]
            units[channel.name] = str(channel.properties.get("unit_string", ""))
            if "wf_increment" in channel.properties:
                signals.setdefault("Time", channel.time_track())
                units["Time"] = "s"
    return _of_longest(path, signals, units)


def _mdf(path: Path, _known_units: set[str]) -> Table:
    """Channels of an MDF file on one time axis, that of the fastest group."""
    asammdf = _imported("asammdf", path, "MDF", "or export it as CSV or .mat")
    with asammdf.MDF(path) as file:
        units = {str(channel.name): str(channel.unit) for channel in file.iter_channels()}
        table = file.to_dataframe(time_from_zero=True)
    _limit(path, len(table), MOST_ROWS, "rows")
    table.insert(0, "Time", table.index.to_numpy())
    return Table(table.reset_index(drop=True), units | {"Time": "s"})


def _text(path: Path, known_units: set[str]) -> Table:
    return _text_table(path, path.read_bytes(), known_units)


def _packed_text(path: Path, known_units: set[str]) -> Table:
    with gzip.open(path) as file:
        content = file.read(LARGEST_FILE + 1)
    _limit(path, len(content), LARGEST_FILE, "bytes or more when unpacked")
    return _text_table(path, content, known_units)


def _text_table(path: Path, content: bytes, known_units: set[str]) -> Table:
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
    _limit(path, first.width, MOST_COLUMNS, "columns")
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
    _limit(path, len(table), MOST_ROWS, "rows or more")
    empty = (table == "").all(axis=1).to_numpy()
    table = table.iloc[: len(table) - int(np.argmin(empty[::-1])), : len(names)]  # blank lines at the end
    table.columns = names
    if first.separator != ",":
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
            f"{path}: each channel has its own X column, or there are headings between the rows: export the"
            " file again with one header, and with one X column or none"
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


EXTRA = "with `pip install 'pneumo[formats]'`"
FORMATS = (
    Format((), "CSV", _text, "separated by commas, semicolons, tabs or spaces; UTF-8, UTF-16 or Latin-1"),
    Format((".gz",), "packed CSV", _packed_text, "a text file packed by gzip"),
    Format((".lvm",), "LabVIEW", _text, "one header, and one X column at most"),
    Format((".mat",), "MATLAB", _matlab, f"vectors, matrices, structs (To Workspace, dSPACE); 7.3 {EXTRA}"),
    Format((".nc",), "NetCDF", _netcdf, "one-dimensional variables with the attribute units"),
    Format((".parquet",), "Parquet", _parquet, EXTRA),
    Format((".feather",), "Feather", _feather, EXTRA),
    Format((".xlsx",), "Excel", _excel, f"the first sheet; {EXTRA}"),
    Format((".tdms",), "TDMS", _tdms, EXTRA),
    Format((".mdf", ".mf4"), "MDF", _mdf, EXTRA),
    Format((".xls", ".ods"), "old Excel, OpenDocument", None, "save the sheet as CSV"),
    Format(
        (".h5", ".hdf5", ".mcap", ".npz", ".bag"), "HDF5, MCAP, NumPy, ROS", None, "export CSV or Parquet"
    ),
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
        with regular_file(path, LARGEST_FILE):
            pass
        if kind.read is None:
            raise InputError(f"{path}: {suffix} files are not read: {kind.remark}")
        return kind.read(path, known_units)
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (
        OSError,
        ValueError,
        LookupError,
        RuntimeError,
        TypeError,
        EOFError,
        csv.Error,
        zlib.error,
    ) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or " ".join(str(error).split())
        raise InputError(f"{path}: not a readable {kind.name} file ({printable(reason, 200)})") from None
