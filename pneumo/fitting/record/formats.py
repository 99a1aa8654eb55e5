"""Files and tables in memory as channels; `FORMATS` has a row for each format.

Readers import their libraries themselves: the help of the command line lists the formats without loading any.
"""

import dataclasses
import gzip
import importlib
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from pneumo.errors import InputError, printable
from pneumo.fitting.record.channel import (
    MOST_COLUMNS,
    MOST_ROWS,
    Channel,
    distinct,
    is_time,
    limit,
    table_channels,
)
from pneumo.fitting.record.reader_process import isolated
from pneumo.fitting.record.text import read_text
from pneumo.fitting.record.units import TIMES, plain_unit
from pneumo.regular_file import regular_file

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

LARGEST_FILE = 200_000_000  # bytes
MOST_NUMBERS = 50_000_000  # of all channels together: 400 MB
DATA, TIME = ("Data", "data", "values", "Values"), ("Time", "time", "t")  # members of MATLAB's structs


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
    flat = {str(name): data[name] for name in data.variables if data[name].ndim == 1}
    made = {
        name: Channel(name, variable.values, plain_unit(str(variable.attrs.get("units", ""))))
        for name, variable in flat.items()
    }
    clocks = dict[Any, Channel]()
    for name, channel in made.items():
        (dim,) = flat[name].dims
        coordinate = name == dim and (channel.unit in TIMES or channel.values.dtype.kind in "mM")
        if coordinate or is_time(name):
            clocks.setdefault(dim, channel)
    return [channel._replace(clock=clocks.get(flat[name].dims[0])) for name, channel in made.items()]


def _netcdf(path: Path) -> list[Channel]:
    import xarray as xr

    with xr.open_dataset(path, engine="netcdf4", decode_times=False) as data:
        return _of_dataset(data)


def _nested(path: Path, content: dict[str, Any]) -> list[Channel]:
    """Channels of variables, structs and groups: vectors, columns of matrices, and known structs."""
    found = list(_members("", content, None))
    longest = max((len(channel.values) for channel in found), default=0)
    if longest < 2:
        raise InputError(
            f"{path}: holds no vectors of numbers: save each signal as a vector of its own, such as P_A_kPa"
        )
    return distinct([c for c in found if c.clock or len(c.values) == longest])  # others are constants


def _members(name: str, value: Any, clock: Channel | None, unit: str = "") -> Iterator[Channel]:
    """Channels in a variable; those in structs have the members' names.

    A struct of Simulink's block To Workspace has time and signals, one of dSPACE X and Y with Name and Data,
    a time series Time and Data. In others, the time as long as a vector is its clock.
    """
    import pandas as pd

    if isinstance(value, pd.DataFrame):  # MATLAB's table or timetable
        attributes = value.attrs.get("varUnits") or value.attrs.get("VariableUnits") or []
        units = dict(zip(value.columns, attributes, strict=False))
        if value.index.dtype.kind in "mM":
            clock = Channel(str(value.index.name or "Time"), value.index.to_numpy())
        columns = {str(key): value[key].to_numpy() for key in value}
        for channel in _members(name, columns, clock):
            yield channel._replace(unit=channel.unit or plain_unit(units.get(channel.name, "")))
    elif isinstance(value, dict) and "X" in value and "Y" in value:
        axes = [Channel("Time", axis["Data"], "s") for axis in _listed(value["X"])]
        for signal in _listed(value["Y"]):
            axis = int(signal.get("XIndex", 1)) - 1
            yield from _members("Y", signal, axes[axis if axis < len(axes) else 0])
    elif isinstance(value, dict):
        vectors = {key: member for key, member in value.items() if np.ndim(member) == 1}
        data = next((value[key] for key in DATA if key in value), None)
        own = next((key for key in TIME if key in vectors), None)
        if own and (data is not None or "signals" in value):
            clock = Channel(own, vectors[own], _text_of(value, "TimeInfo", "Units") or "s")
        if data is not None:
            label = _text_of(value, "Name") or _text_of(value, "label") or name
            unit = _text_of(value, "Unit") or _text_of(value, "unit") or _text_of(value, "DataInfo", "Units")
            yield from _members(label.split("/")[-1], data, clock, unit)
            return
        clocks = [Channel(key, vector) for key, vector in vectors.items() if is_time(key)]
        for key, member in value.items():
            size = max(np.shape(member), default=0) if isinstance(member, np.ndarray) else 0
            yield from _members(key, member, next((c for c in clocks if len(c.values) == size), clock))
    elif isinstance(value, list):
        for member in value:
            yield from _members(name, member, clock)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "iufbmM":
        if value.ndim == 2 and value.size:
            columns = value.T if value.shape[0] >= value.shape[1] else value
            for number, column in enumerate(columns, start=1):
                yield Channel(f"{name}.{number}", column, unit, clock)
        elif value.ndim == 1 and len(value) > 1:
            yield Channel(name, value, plain_unit(unit), clock)


def _text_of(value: Any, *keys: str) -> str:
    """Text in a struct of structs, empty if there is none."""
    for key in keys:
        value = value.get(key) if isinstance(value, dict) else None
    return value if isinstance(value, str) else ""


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def _matlab(path: Path) -> list[Channel]:
    from scipy.io import loadmat

    try:
        loaded = loadmat(path, appendmat=False)
    except NotImplementedError:  # version 7.3
        loaded = {}
    if not loaded or "__function_workspace__" in loaded:
        matio = _imported("matio", path, "MATLAB 7.3, tables and timetables", "or save vectors with '-v7'")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of objects that are no tables
            loaded = matio.load_from_mat(str(path), add_table_attrs=True)
    return _nested(path, {name: _plain(value) for name, value in loaded.items() if name[:2] != "__"})


def _plain(value: Any) -> Any:
    """MATLAB's structs as dicts, cells and arrays of structs as lists, vectors with one dimension."""
    if not isinstance(value, np.ndarray):
        return value
    if value.dtype.names:
        structs = [{key: _plain(struct[key]) for key in value.dtype.names} for struct in value.ravel()]
        return structs[0] if len(structs) == 1 else structs
    if value.dtype.kind == "O":
        return [_plain(cell) for cell in value.ravel()]
    if value.dtype.kind == "U":
        return "".join(value.ravel())
    return value.squeeze()


def _hdf5(path: Path) -> list[Channel]:
    """Channels of an HDF5 file; a dataset's attribute units is its unit."""
    h5py = _imported("h5py", path, "HDF5", "or export CSV")

    def content(item: Any) -> Any:
        if isinstance(item, h5py.Group):
            return {key: content(item[key]) for key in item}
        if not isinstance(item, h5py.Dataset) or item.dtype.kind not in "iufb" or item.size < 2:
            return None
        limit(path, item.size, MOST_NUMBERS, "numbers")
        unit = item.attrs.get("units", item.attrs.get("unit", ""))
        unit = unit.decode(errors="replace") if isinstance(unit, bytes) else str(unit)
        values = item[()].squeeze()
        return {"values": values, "label": item.name, "unit": unit} if unit else values

    with h5py.File(path) as file:
        return _nested(path, content(file))


def _imported(package: str, path: Path, kind: str, otherwise: str) -> Any:
    """Module of an optional package; `InputError` with the remedy where it is not installed."""
    try:
        return importlib.import_module(package)
    except ImportError:
        remedy = f"pip install 'pneumo[formats]' (here {package.partition('.')[0]}), {otherwise}"
        raise InputError(f"{path}: {kind} files are not read without a library: {remedy}") from None


def _arrow(path: Path) -> list[Channel]:
    import pandas as pd

    _imported("pyarrow", path, "Parquet and Feather", "or export CSV")
    return given_channels((pd.read_feather if path.suffix.lower() == ".feather" else pd.read_parquet)(path))


def _excel(path: Path) -> list[Channel]:
    """First sheet of a workbook, read as the text that saving it as CSV would give."""
    openpyxl = _imported("openpyxl", path, "Excel", "or save the sheet as CSV")
    sheet = openpyxl.load_workbook(path, read_only=True, data_only=True).worksheets[0]
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
        starts = [c.properties.get("wf_start_time") for group in groups for c in group]
        first = min((start for start in starts if isinstance(start, np.datetime64)), default=None)
        for group in groups:
            own = [Channel(c.name, c[:], str(c.properties.get("unit_string", ""))) for c in group]
            times = [channel for channel in own if is_time(channel.name)]
            for source, channel in zip(group, own, strict=True):
                properties = source.properties
                clock = next((t for t in times if len(t.values) == len(channel.values)), None)
                if properties.get("wf_increment"):
                    start = properties.get("wf_start_time")
                    known = isinstance(start, np.datetime64)
                    begin = (start - first) / np.timedelta64(1, "s") if known else 0.0
                    clock = Channel("Time", begin + source.time_track(), "s")
                made.append(channel._replace(clock=clock))
    return distinct(made)


def _mdf(path: Path) -> list[Channel]:
    """Channels of an MDF file, each with the times of its group."""
    asammdf = _imported("asammdf", path, "MDF", "or export it as CSV or .mat")
    with asammdf.MDF(path) as file:
        return [
            Channel(s.name, s.samples, str(s.unit or ""), Channel("Time", s.timestamps, "s"))
            for s in file.iter_channels()
            if s.samples.ndim == 1 and s.samples.dtype.kind in "iufb"
        ]


def _labview(path: Path) -> list[Channel]:
    """Channels of an .lvm file; a segment that counts its time anew follows the one before it by one step."""
    lvm_read = _imported("lvm_read", path, "LabVIEW", "or export CSV")
    content = lvm_read.read(str(path), read_from_pickle=False, dump_file=False)
    parts = dict[str, list[tuple[np.ndarray, np.ndarray]]]()
    units = dict[str, str]()
    for number in range(content["Segments"]):
        for name, unit, t, values in _segment(content[number]):
            before = parts.setdefault(name, [])
            units.setdefault(name, unit)
            if before and len(last := before[-1][0]) > 1 and t[0] <= last[-1]:
                t = t - t[0] + 2 * last[-1] - last[-2]
            before.append((t, values))
    joined = {name: [np.concatenate(arrays) for arrays in zip(*p, strict=True)] for name, p in parts.items()}
    return [
        Channel(name, values, units[name], Channel("X_Value", t, "s")) for name, (t, values) in joined.items()
    ]


def _segment(segment: dict[str, Any]) -> Iterator[tuple[str, str, np.ndarray, np.ndarray]]:
    """Name, unit, times and values of each channel that has samples in a segment of an .lvm file."""
    times, names = np.empty(0), segment["Channel names"]
    signals = [name for name in names if name not in ("X_Value", "Comment")]
    for name, column in zip(names, segment["data"].T, strict=False):
        if name == "X_Value":
            times = column
        if name not in signals or not np.isfinite(column).any():
            continue
        values = column[: np.flatnonzero(np.isfinite(column))[-1] + 1]
        t, k = times[: len(values)], signals.index(name)
        if not np.isfinite(t).any():
            t = segment["X0"][k] + segment["Delta_X"][k] * np.arange(len(values))
        labels = segment.get("Y_Unit_Label", [])
        labels = labels[::2] if names.count("X_Value") > 1 else labels  # each time has an entry too
        yield name, plain_unit(labels[k]) if k < len(labels) else "", t, values


def _bag(path: Path) -> list[Channel]:
    """Numbers in the messages of a bag, by topic, at the times in their headers, or else of their logging."""
    highlevel = _imported("rosbags.highlevel", path, "ROS", "or export CSV, as PlotJuggler does")
    typesys = importlib.import_module("rosbags.typesys")
    topics = dict[str, tuple[list[int], list[int], dict[str, list[Any]]]]()
    with highlevel.AnyReader([path], default_typestore=typesys.get_typestore(typesys.Stores.LATEST)) as bag:
        limit(path, bag.message_count, MOST_ROWS, "messages")
        for connection, logged, content in bag.messages():
            message = bag.deserialize(content, connection.msgtype)
            stamp = getattr(getattr(message, "header", None), "stamp", None)
            stamps, times, columns = topics.setdefault(connection.topic, ([], [], {}))
            stamps.append(stamp.sec * 10**9 + stamp.nanosec if stamp else 0)
            times.append(logged)
            for name, number in _numbers_of("", message):
                columns.setdefault(name, []).append(number)
    return [
        Channel(topic + name, np.array(values), "", Channel("Time", np.array(clock), "ns"))
        for topic, (stamps, times, columns) in topics.items()
        for clock in [stamps if any(stamps) else times]
        for name, values in columns.items()
        if len(values) == len(clock)
    ]


def _numbers_of(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Names and values of the numbers in a message; those of arrays are counted from 1."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            if field.name not in ("__msgtype__", "header"):
                last = "" if field.name == "data" else f"/{field.name}"
                yield from _numbers_of(name + last, getattr(value, field.name))
    elif isinstance(value, np.ndarray | list) and len(value) <= MOST_COLUMNS:
        for number, member in enumerate(value, start=1):
            yield from _numbers_of(f"{name}/{number}", member)
    elif isinstance(value, int | float | np.number):
        yield name, value


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
    Format((".lvm",), "LabVIEW", _labview, f"several segments and X columns too; {EXTRA}"),
    Format(
        (".mat",),
        "MATLAB",
        _matlab,
        f"vectors, matrices, structs (To Workspace, time series, dSPACE); 7.3, tables and timetables {EXTRA}",
    ),
    Format((".nc",), "NetCDF", _netcdf, "one-dimensional variables with the attribute units; times as in CF"),
    Format((".h5", ".hdf5"), "HDF5", _hdf5, f"vectors in any group; {EXTRA}"),
    Format((".parquet", ".feather"), "Parquet, Feather", _arrow, EXTRA),
    Format((".xlsx",), "Excel", _excel, f"the first sheet; {EXTRA}"),
    Format((".tdms",), "TDMS", _tdms, f"waveforms of any rates; {EXTRA}"),
    Format((".mdf", ".mf4", ".dat"), "MDF", _mdf, f"groups of any rates; {EXTRA}"),
    Format(
        (".mcap", ".db3", ".bag"), "MCAP, ROS bags", _bag, f"ROS messages of topics of any rates; {EXTRA}"
    ),
    Format((".xls", ".ods"), "old Excel, OpenDocument", None, "save the sheet as CSV"),
    Format((".npz",), "NumPy", None, "export CSV or Parquet"),
    Format((".idf",), "ControlDesk", None, "export it from ControlDesk as CSV or .mat"),
)


def _checked(kind: Format, path: Path) -> list[Channel]:
    """Channels of a file, not too many and not too long."""
    assert kind.read
    channels = kind.read(path)
    sizes = [len(channel.values) for channel in channels]
    limit(path, len(sizes), MOST_COLUMNS, "signals")
    limit(path, max(sizes, default=0), MOST_ROWS, "samples of a signal")
    limit(path, sum(sizes), MOST_NUMBERS, "numbers")
    return channels


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
        return _checked(kind, path) if kind.read in (_text, _packed_text) else isolated(_checked, kind, path)
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except Exception as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or " ".join(str(error).split())
        reason = printable(reason or type(error).__name__, 200)
        raise InputError(f"{path}: not a readable {kind.name} file ({reason})") from None
