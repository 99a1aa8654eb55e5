"""Files and tables in memory as channels; `FORMATS` has a row for each format.

Readers import their libraries themselves: the help of the command line lists the formats without loading any.
"""

import gzip
import importlib
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from pneumo.errors import InputError, printable
from pneumo.fitting.record.channel import MOST_COLUMNS, MOST_ROWS, Channel, is_time, limit, table_channels
from pneumo.fitting.record.reader_process import isolated
from pneumo.fitting.record.text import read_text
from pneumo.fitting.record.units import TIMES, plain_unit
from pneumo.regular_file import regular_file

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

LARGEST_FILE = 200_000_000  # bytes
COMPRESSED, CHUNK = 15, 1 << 20  # type of a packed variable of MATLAB; bytes unpacked at once
MOST_NUMBERS = 50_000_000  # of all channels together: 400 MB
DATA, TIME = ("Data", "data", "values", "Values"), ("Time", "time", "t")


def given_channels(source: "pd.DataFrame | xr.Dataset") -> list[Channel]:
    """Channels of a data frame or dataset in memory; of a data frame, an index with a name or times too."""
    import xarray as xr

    if isinstance(source, xr.Dataset):
        return _of_dataset(source)
    index = source.index
    if index.name or index.dtype.kind in "mM":
        source = source.rename_axis(index.name or "t").reset_index()
    return table_channels((str(name), source.iloc[:, k].to_numpy()) for k, name in enumerate(source.columns))


def _of_dataset(data: "xr.Dataset") -> list[Channel]:
    """One-dimensional variables of a dataset; the time along their dimension is their clock."""
    made, clocks = list[Channel](), dict[str, Channel]()
    for name in data.variables:
        variable = data[name]
        if variable.ndim != 1:
            continue
        unit = str(variable.attrs.get("units", ""))
        channel = Channel(str(name), variable.values, plain_unit(unit))
        made.append(channel)
        own = name == variable.dims[0] and (plain_unit(unit) in TIMES or variable.dtype.kind in "mM")
        if own or is_time(str(name)):
            clocks.setdefault(str(variable.dims[0]), channel)
    dims = {str(name): str(data[name].dims[0]) for name in data.variables if data[name].ndim == 1}
    return [channel._replace(clock=clocks.get(dims[channel.name])) for channel in made]


def _netcdf(path: Path) -> list[Channel]:
    import xarray as xr
    from netCDF4 import Dataset

    with Dataset(path.absolute()) as file:  # before xarray, which loads coordinates as it opens
        limit(path, len(file.variables), MOST_COLUMNS, "variables")
        for name, dimension in file.dimensions.items():
            limit(path, dimension.size, MOST_ROWS, f"samples along {printable(name, 30)}")
        flat = [variable for variable in file.variables.values() if len(variable.dimensions) == 1]
        limit(path, sum(int(variable.size) for variable in flat), MOST_NUMBERS, "numbers")
    with xr.open_dataset(path.absolute(), engine="netcdf4", decode_times=False) as data:
        return _of_dataset(data)


def _nested(path: Path, content: Mapping[str, Any]) -> list[Channel]:
    """Channels of variables, structs and groups: vectors, columns of matrices, and known structs."""
    found = list(_members("", content, None))
    limit(path, len(found), MOST_COLUMNS, "signals")
    longest = max((len(channel.values) for channel in found), default=0)
    limit(path, longest, MOST_ROWS, "samples in a vector")
    if longest < 2:
        remedy = "save each signal as a vector of its own, such as P_A_kPa"
        raise InputError(
            f"{path}: holds no vectors of numbers: {remedy}; a timetable by table2struct(timetable2table(T),"
            " 'ToScalar', true)"
        )
    kept = [c for c in found if c.clock is not None or len(c.values) == longest]  # others are constants
    names = [channel.name for channel in kept]
    return [c._replace(name=f"{c.name}.{k + 1}") if c.name in names[:k] else c for k, c in enumerate(kept)]


def _members(name: str, value: Any, clock: Channel | None, unit: str = "") -> Iterator[Channel]:
    """Channels in a variable; those in structs have the members' names.

    A struct of Simulink's block To Workspace has time and signals, one of dSPACE X and Y with Name and Data,
    a time series Time and Data. In others, the time as long as a vector is its clock.
    """
    if isinstance(value, Mapping):
        time = next((value[key] for key in TIME if _is_vector(value.get(key))), None)
        if time is not None and ("signals" in value or any(key in value for key in DATA)):
            info = value.get("TimeInfo")
            of_time = info.get("Units", "s") if isinstance(info, Mapping) else "s"
            clock = Channel("Time", np.asarray(time), of_time)
        if "signals" in value:
            for signal in _listed(value["signals"]):
                yield from _members("signals", signal, clock)
        elif "X" in value and "Y" in value and any(isinstance(y, Mapping) for y in _listed(value["Y"])):
            axes = [np.asarray(x["Data"]) for x in _listed(value["X"]) if isinstance(x, Mapping)]
            for y in _listed(value["Y"]):
                k = int(y.get("XIndex", 1) or 1) - 1
                times = axes[k] if 0 <= k < len(axes) else axes[0]
                yield from _members("Y", y, Channel("Time", times, "s"))
        elif data := [value[key] for key in DATA if key in value]:
            info = value.get("DataInfo")
            named = [value.get(key) for key in ("Name", "label")]
            label = next((text for text in named if isinstance(text, str) and text), name).split("/")[-1]
            units = [
                value.get("Unit"),
                value.get("unit"),
                info.get("Units") if isinstance(info, Mapping) else "",
            ]
            yield from _members(
                label, data[0], clock, next((u for u in units if isinstance(u, str) and u), unit)
            )
        else:
            clocks = [Channel(k, np.asarray(v)) for k, v in value.items() if is_time(k) and _is_vector(v)]
            for key, member in value.items():
                size = (
                    len(member) if _is_vector(member) else np.shape(member)[:1] if _is_matrix(member) else -1
                )
                size = max(np.shape(member)) if _is_matrix(member) else size
                of = next((c for c in clocks if len(c.values) == size), None if _is_vector(member) else clock)
                yield from _members(key, member, of)
    elif isinstance(value, list):
        for member in value:
            yield from _members(name, member, clock, unit)
    elif _is_matrix(value):
        for number, column in enumerate(value.T if value.shape[0] >= value.shape[1] else value, start=1):
            yield Channel(f"{name}.{number}", column, unit, clock)
    elif _is_vector(value):
        yield Channel(name, value, plain_unit(unit), clock)


def _listed(value: Any) -> list[Any]:
    return list(value) if isinstance(value, list | np.ndarray) else [value]


def _is_vector(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.kind in "iufb" and value.ndim == 1 and len(value) > 1


def _is_matrix(value: Any) -> bool:
    return (
        isinstance(value, np.ndarray)
        and value.dtype.kind in "iufb"
        and value.ndim == 2
        and min(value.shape) > 0
    )


def _matlab(path: Path) -> list[Channel]:
    from scipy.io import loadmat

    with path.open("rb") as file:
        if b"MATLAB 7.3" in file.read(128):
            return _hdf5(path)
    limit(path, _unpacked_size(path), LARGEST_FILE, "bytes when unpacked")
    loaded = loadmat(path, appendmat=False, simplify_cells=True)
    return _nested(path, {name: value for name, value in loaded.items() if not name.startswith("__")})


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


def _hdf5(path: Path) -> list[Channel]:
    """Channels of an HDF5 file, MATLAB's 7.3 among them; a dataset's attribute units is its unit."""
    h5py = _imported("h5py", path, "MATLAB 7.3 and HDF5", "or save(file, '-v7') in MATLAB, or export CSV")
    total = 0

    def content(item: Any, depth: int = 0) -> Any:
        nonlocal total
        if isinstance(item, h5py.Group):
            return {key: content(item[key], depth + 1) for key in item if key[0] != "#"} if depth < 9 else {}
        if not isinstance(item, h5py.Dataset):
            return None
        total += item.size
        limit(path, total, MOST_NUMBERS, "numbers")
        if item.dtype == h5py.ref_dtype:  # a cell array or an array of structs
            return [content(item.file[ref], depth + 1) for ref in item[()].ravel()] if depth < 9 else []
        kind = item.attrs.get("MATLAB_class", b"")
        if kind == b"char":
            return "".join(map(chr, item[()].ravel().tolist()))
        if item.dtype.kind not in "iufb":
            return None
        array = item[()].squeeze() if item.size > 1 else np.empty(0)
        unit = item.attrs.get("units", item.attrs.get("unit", ""))
        unit = unit.decode(errors="replace") if isinstance(unit, bytes) else str(unit)
        return {"values": array, "label": item.name.split("/")[-1], "unit": unit} if unit else array

    def transposed(value: Any) -> Any:
        """MATLAB writes an array of structs as a struct of arrays."""
        if not isinstance(value, dict):
            return [transposed(member) for member in value] if isinstance(value, list) else value
        lists = [member for member in value.values() if isinstance(member, list)]
        if value and len(lists) == len(value) and len({len(member) for member in lists}) == 1:
            return [
                transposed(dict(zip(value, row, strict=True))) for row in zip(*value.values(), strict=True)
            ]
        return {key: transposed(member) for key, member in value.items()}

    with h5py.File(path) as file:
        return _nested(path, transposed(content(file)))


def _imported(package: str, path: Path, kind: str, otherwise: str) -> Any:
    """Module of an optional package; `InputError` with the remedy where it is not installed."""
    try:
        return importlib.import_module(package)
    except ImportError:
        remedy = f"pip install 'pneumo[formats]' (here {package.partition('.')[0]}), {otherwise}"
        raise InputError(f"{path}: {kind} files are not read without a library: {remedy}") from None


def _parquet(path: Path) -> list[Channel]:
    parquet = _imported("pyarrow.parquet", path, "Parquet", "or export CSV")
    file = parquet.ParquetFile(path)
    _limit_table(path, file.metadata.num_rows, file.metadata.num_columns)
    return given_channels(file.read().to_pandas())


def _feather(path: Path) -> list[Channel]:
    feather = _imported("pyarrow.feather", path, "Feather", "or export CSV")
    table = feather.read_table(path, memory_map=True)
    _limit_table(path, table.num_rows, table.num_columns)
    return given_channels(table.to_pandas())


def _limit_table(path: Path, rows: int, columns: int) -> None:
    limit(path, rows, MOST_ROWS, "rows")
    limit(path, columns, MOST_COLUMNS, "columns")
    limit(path, rows * columns, MOST_NUMBERS, "numbers")


def _excel(path: Path) -> list[Channel]:
    """First sheet of a workbook, read as the text that saving it as CSV would give."""
    openpyxl = _imported("openpyxl", path, "Excel", "or save the sheet as CSV")
    with zipfile.ZipFile(path) as packed:
        limit(path, sum(part.file_size for part in packed.infolist()), LARGEST_FILE, "bytes when unpacked")
    sheet = openpyxl.load_workbook(path, read_only=True, data_only=True).worksheets[0]
    limit(path, sheet.max_row or 0, MOST_ROWS, "rows")
    limit(path, sheet.max_column or 0, MOST_COLUMNS, "columns")
    lines = (
        "\t".join("" if cell is None else str(cell).replace("\t", " ").replace("\n", " ") for cell in row)
        for row in sheet.iter_rows(values_only=True)
    )
    return read_text(path, "\n".join(lines).encode())


def _tdms(path: Path) -> list[Channel]:
    """Channels of a .tdms file, each with the time of its waveform or of its group."""
    tdms = _imported("nptdms", path, "TDMS", "or export it from LabVIEW as .lvm or CSV")
    made = list[Channel]()
    with tdms.TdmsFile.open(path) as file:
        groups = [group.channels() for group in file.groups()]
        limit(path, sum(map(len, groups)), MOST_COLUMNS, "channels")
        limit(path, sum(len(channel) for group in groups for channel in group), MOST_NUMBERS, "numbers")
        starts = [c.properties.get("wf_start_time") for group in groups for c in group]
        first = min((start for start in starts if isinstance(start, np.datetime64)), default=None)
        for group in groups:
            own = [Channel(c.name, c[:], str(c.properties.get("unit_string", ""))) for c in group]
            times = [channel for channel in own if is_time(channel.name)]
            for source, channel in zip(group, own, strict=True):
                properties, clock = source.properties, None
                if step := float(properties.get("wf_increment", 0.0)):
                    begin = float(properties.get("wf_start_offset", 0.0))
                    if isinstance(start := properties.get("wf_start_time"), np.datetime64):
                        begin += (start - first) / np.timedelta64(1, "s")
                    clock = Channel("Time", begin + step * np.arange(len(channel.values)), "s")
                else:
                    clock = next((t for t in times if len(t.values) == len(channel.values)), None)
                taken = channel.name in [other.name for other in made]
                name = f"{source.group_name}/{channel.name}" if taken else channel.name
                made.append(channel._replace(name=name, clock=clock))
    return made


def _mdf(path: Path) -> list[Channel]:
    """Channels of an MDF file, each with the times of its group."""
    asammdf = _imported("asammdf", path, "MDF", "or export it as CSV or .mat")
    made = list[Channel]()
    with asammdf.MDF(path) as file:
        sizes = [group.channel_group.cycles_nr for group in file.groups]
        limit(path, max(sizes, default=0), MOST_ROWS, "samples in a group")
        limit(path, sum(len(g.channels) for g in file.groups), MOST_COLUMNS, "channels")
        for signal in file.iter_channels():
            if signal.samples.ndim == 1 and signal.samples.dtype.kind in "iufb":
                clock = Channel("Time", signal.timestamps, "s")
                made.append(Channel(str(signal.name), signal.samples, str(signal.unit or ""), clock))
    return made


def _text(path: Path) -> list[Channel]:
    return read_text(path, path.read_bytes())


def _packed_text(path: Path) -> list[Channel]:
    with gzip.open(path) as file:
        content = file.read(LARGEST_FILE + 1)
    limit(path, len(content), LARGEST_FILE, "bytes or more when unpacked")
    return read_text(path, content)


class Format(NamedTuple):
    """Format of a file, by the ending of its name."""

    suffixes: tuple[str, ...]  # none: every other one
    name: str
    read: Callable[[Path], list[Channel]] | None
    remark: str  # for a format that is not read: what to do


EXTRA = "with `pip install 'pneumo[formats]'`"
FORMATS = (
    Format(
        (),
        "CSV",
        _text,
        "any separator, decimal sign and preamble; TwinCAT Scope, Simulink's Data Inspector, ControlDesk,"
        " PlotJuggler, ROS; UTF-8, UTF-16 or Latin-1",
    ),
    Format((".gz",), "packed CSV", _packed_text, "a text file packed by gzip"),
    Format((".lvm",), "LabVIEW", _text, "several segments and X columns too"),
    Format(
        (".mat",),
        "MATLAB",
        _matlab,
        f"vectors, matrices, structs (To Workspace, time series, dSPACE); 7.3 {EXTRA}",
    ),
    Format((".nc",), "NetCDF", _netcdf, "one-dimensional variables with the attribute units; times as in CF"),
    Format((".h5", ".hdf5"), "HDF5", _hdf5, f"vectors in any group; {EXTRA}"),
    Format((".parquet",), "Parquet", _parquet, EXTRA),
    Format((".feather",), "Feather", _feather, EXTRA),
    Format((".xlsx",), "Excel", _excel, f"the first sheet; {EXTRA}"),
    Format((".tdms",), "TDMS", _tdms, f"waveforms of any rates; {EXTRA}"),
    Format((".mdf", ".mf4", ".dat"), "MDF", _mdf, f"groups of any rates; {EXTRA}"),
    Format((".xls", ".ods"), "old Excel, OpenDocument", None, "save the sheet as CSV"),
    Format((".mcap", ".npz", ".bag", ".db3"), "MCAP, NumPy, ROS bags", None, "export CSV or Parquet"),
    Format((".idf",), "ControlDesk", None, "export it from ControlDesk as CSV or .mat"),
)


def read_channels(path: Path) -> list[Channel]:
    """Channels of a file in one of the `FORMATS`.

    Raises
    ------
    InputError
        If the file cannot be read, is too large, or is in an unsupported format.
    """
    suffix = path.suffix.lower()
    kind = next((form for form in FORMATS if suffix in form.suffixes), FORMATS[0])
    try:
        with regular_file(path, LARGEST_FILE) as file:
            head = file.read(8)
        if suffix == ".dat" and not head.startswith(b"MDF"):
            kind = FORMATS[0]
        if kind.read is None:
            raise InputError(f"{path}: {suffix} files are not read: {kind.remark}")
        return kind.read(path) if kind.read in (_text, _packed_text, _netcdf) else isolated(kind.read, path)
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except Exception as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or " ".join(str(error).split())
        reason = printable(reason or type(error).__name__, 200)
        raise InputError(f"{path}: not a readable {kind.name} file ({reason})") from None
