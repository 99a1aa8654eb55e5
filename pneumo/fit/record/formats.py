"""Tables of a measurement from files of text, spreadsheets and instruments; `FORMATS` has a row for each.

Readers import their libraries themselves: the help of the command line lists the formats without loading any.
"""

import csv
import gzip
import importlib
import struct
import zipfile
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from pneumo.errors import InputError, printable
from pneumo.fit.record.table import MOST_COLUMNS, MOST_ROWS, Table, limit
from pneumo.fit.record.text_table import text_table
from pneumo.regular_file import regular_file

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

LARGEST_FILE = 200_000_000  # bytes
COMPRESSED, CHUNK = 15, 1 << 20  # type of a packed variable of MATLAB; bytes unpacked at once


def _netcdf(path: Path, _known_units: set[str]) -> Table:
    import xarray as xr
    from netCDF4 import Dataset

    with Dataset(path.absolute()) as file:  # before xarray, which loads coordinates as it opens
        limit(path, len(file.variables), MOST_COLUMNS, "variables")
        for name, dimension in file.dimensions.items():
            limit(path, dimension.size, MOST_ROWS, f"samples along {printable(name, 30)}")
    with xr.open_dataset(path.absolute(), engine="netcdf4", decode_times=False) as data:
        return _one_dimensional(data)


def _of_longest(path: Path, signals: Mapping[str, Any], units: dict[str, str]) -> Table:
    """Table of the longest vectors; shorter ones are constants or other recordings."""
    import pandas as pd

    longest = max((len(signal) for signal in signals.values()), default=0)
    limit(path, longest, MOST_ROWS, "samples in a vector")
    if longest < 2:
        raise InputError(
            f"{path}: holds no vectors of numbers: save each signal as a vector of its own, such as P_A_kPa"
        )
    kept = {name: signal for name, signal in signals.items() if len(signal) == longest}
    limit(path, len(kept), MOST_COLUMNS, "signals")
    return Table(pd.DataFrame(kept), units)


def given_table(source: "pd.DataFrame | xr.Dataset") -> Table:
    """Table of a data frame or dataset in memory; the index of a data frame is a column if it has a name."""
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
    limit(path, _unpacked_size(path), LARGEST_FILE, "bytes when unpacked")
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
    """Add the numeric vectors in a variable of MATLAB to `signals`; those in structs have the members' names.

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
        limit(path, item.size, MOST_ROWS * MOST_COLUMNS, "numbers in a matrix")
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
    limit(path, file.metadata.num_rows, MOST_ROWS, "rows")
    limit(path, file.metadata.num_columns, MOST_COLUMNS, "columns")
    return Table(file.read().to_pandas(), {})


def _feather(path: Path, _known_units: set[str]) -> Table:
    feather = _imported("pyarrow.feather", path, "Feather", "or export CSV")
    table = feather.read_table(path, memory_map=True)
    limit(path, table.num_rows, MOST_ROWS, "rows")
    limit(path, table.num_columns, MOST_COLUMNS, "columns")
    return Table(table.to_pandas(), {})


def _excel(path: Path, known_units: set[str]) -> Table:
    """First sheet of a workbook, read as the text that saving it as CSV would give."""
    openpyxl = _imported("openpyxl", path, "Excel", "or save the sheet as CSV")
    try:
        sheet = openpyxl.load_workbook(path, read_only=True, data_only=True).worksheets[0]
        limit(path, sheet.max_row or 0, MOST_ROWS, "rows")
        lines = [
            "\t".join("" if cell is None else str(cell) for cell in row)
            for row in sheet.iter_rows(values_only=True)
        ]
    except (zipfile.BadZipFile, KeyError) as error:
        raise ValueError(str(error)) from None
    return text_table(path, "\n".join(lines).encode(), known_units)


def _tdms(path: Path, _known_units: set[str]) -> Table:
    """Channels of a .tdms file by name, and the time of their waveform where no channel has it."""
    tdms = _imported("nptdms", path, "TDMS", "or export it from LabVIEW as .lvm or CSV")
    signals: dict[str, Any] = {}
    units: dict[str, str] = {}
    with tdms.TdmsFile.open(path) as file:
        for channel in (channel for group in file.groups() for channel in group.channels()):
            limit(path, len(channel), MOST_ROWS, "samples in a channel")
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
    limit(path, len(table), MOST_ROWS, "rows")
    table.insert(0, "Time", table.index.to_numpy())
    return Table(table.reset_index(drop=True), units | {"Time": "s"})


def _text(path: Path, known_units: set[str]) -> Table:
    return text_table(path, path.read_bytes(), known_units)


def _packed_text(path: Path, known_units: set[str]) -> Table:
    with gzip.open(path) as file:
        content = file.read(LARGEST_FILE + 1)
    limit(path, len(content), LARGEST_FILE, "bytes or more when unpacked")
    return text_table(path, content, known_units)


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

    In a text file, the row below the names has units if at least half of its fields are in `known_units`.
    `InputError` if the file cannot be read, is too large, or is in an unsupported format.
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
