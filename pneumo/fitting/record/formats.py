"""Files and tables in memory as channels; `FORMATS` has a row for each format."""

import csv
import dataclasses
import gzip
import io
import warnings
import zipfile
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from pneumo.errors import InputError, printable
from pneumo.fitting.record.channel import MOST_ROWS, Channel, distinct, is_time, limit, table_channels
from pneumo.fitting.record.clocks import Setting, with_stated_clock
from pneumo.fitting.record.reader_process import isolated
from pneumo.fitting.record.text import MOST_COLUMNS, read_text
from pneumo.fitting.record.units import TIMES, plain_unit
from pneumo.regular_file import regular_file

LARGEST_FILE = 200_000_000  # bytes
LARGEST_SHEET = 60_000_000  # bytes of XML: 300,000 rows, of which openpyxl reads some 5 MB a second
MOST_CELLS = 3_000_000  # with those that a sheet has not written
MOST_NUMBERS = 40_000_000  # of all channels together: 320 MB
LONGEST_ARRAY = 200  # in a message of ROS whose numbers are signals
DATA, TIME = ("Data", "data", "values", "Values"), ("Time", "time", "t")  # members of MATLAB's structs


def given_channels(source: pd.DataFrame | xr.Dataset) -> list[Channel]:
    """Channels of a data frame or dataset in memory; of a data frame, an index with a name or times too."""
    if isinstance(source, xr.Dataset):
        return _of_dataset(source)
    index = source.index
    if index.name or index.dtype.kind in "mM":
        source = source.rename_axis(index.name or "t").reset_index()
    return table_channels([Channel(str(name), column.to_numpy()) for name, column in source.items()])


def _of_dataset(data: xr.Dataset) -> list[Channel]:
    """One-dimensional variables of a dataset; the time along their dimension is their clock.

    One with a second dimension whose coordinates are names, such as P by (t, chamber), has a channel for
    each.
    """
    flat = {str(name): data[name] for name in data.variables if data[name].ndim == 1}
    for name in (name for name in data.variables if data[name].ndim == 2):
        labelled = [dim for dim in data[name].dims if dim in data.coords and data[dim].dtype.kind in "OUS"]
        for label in data[labelled[0]].values if len(labelled) == 1 else ():
            label = label.decode() if isinstance(label, bytes) else str(label)
            flat[f"{name}_{label}"] = data[name].sel({labelled[0]: label})
    made, clocks = list[tuple[Any, Channel]](), dict[Any, Channel]()  # with, or by, dimension
    for name, variable in flat.items():
        (dim,) = variable.dims
        channel = Channel(name, variable.values, plain_unit(str(variable.attrs.get("units", ""))))
        made.append((dim, channel))
        coordinate = name == dim and (channel.unit in TIMES or channel.values.dtype.kind in "mM")
        if coordinate or is_time(name):
            clocks.setdefault(dim, channel)
    return [channel._replace(clock=clocks.get(dim)) for dim, channel in made]


def _netcdf(path: Path) -> list[Channel]:
    with xr.open_dataset(path, engine="netcdf4", decode_times=False) as data:
        return _of_dataset(data)


def _nested(path: Path, content: dict[str, Any]) -> list[Channel]:
    """Channels of variables, structs and groups: vectors, columns of matrices, and known structs."""
    found = list(_members("", content, None))
    longest = max((len(channel.values) for channel in found), default=0)
    if longest < 2:
        raise InputError(f"{path}: no vectors of numbers: save each signal as a vector, such as P_A_kPa")
    signals = distinct([c for c in found if c.clock or len(c.values) == longest])  # others are constants
    return with_stated_clock(signals, _scalars(content))


def _scalars(content: dict[str, Any]) -> Iterator[Setting]:
    """Single numbers among variables and members of structs."""
    for name, value in content.items():
        if isinstance(value, dict):
            yield from _scalars(value)
        elif np.ndim(value) == 0 and isinstance(value, int | float | np.number | np.ndarray):
            yield Setting(name, float(value))


def _members(
    name: str, value: Any, clock: Channel | None, unit: str = "", within: str = ""
) -> Iterator[Channel]:
    """Channels in a variable; those in structs have the members' names behind the struct's, `within`.

    A struct of Simulink's block To Workspace has time and signals, one of dSPACE X and Y with Name and Data,
    a time series Time and Data. In others, the time as long as a vector is its clock, and one vector named
    y or value beside a time is the struct's.
    """
    if isinstance(value, pd.DataFrame):  # MATLAB's table or timetable
        attributes = value.attrs.get("varUnits") or value.attrs.get("VariableUnits") or []
        units = dict(zip(value.columns, attributes, strict=False))
        if value.index.dtype.kind in "mM":
            clock = Channel(str(value.index.name or "Time"), value.index.to_numpy())
        columns = {str(key): value[key].to_numpy() for key in value}
        for channel in _members(name, columns, clock):
            yield channel._replace(unit=channel.unit or plain_unit(units.get(channel.name, "")))
    elif isinstance(value, dict) and "X" in value and "Y" in value:
        times, signals = (v if isinstance(v, list) else [v] for v in (value["X"], value["Y"]))
        axes = [Channel("Time", axis["Data"], "s") for axis in times]
        for signal in signals:
            axis = int(signal.get("XIndex", 1)) - 1
            yield from _members("Y", signal, axes[axis if axis < len(axes) else 0])
    elif isinstance(value, dict):
        vectors = {key: member for key, member in value.items() if np.ndim(member) == 1}
        data = next((value[key] for key in DATA if key in value), None)
        own = next((key for key in TIME if key in vectors), None)
        if own and (data is not None or "signals" in value):
            clock = Channel(own, vectors[own], _text(value.get("TimeInfo", {}).get("Units")) or "s")
        others = [key for key in vectors if key not in (own, *DATA)]
        if own and data is None and len(others) == 1 and others[0].lower() in ("y", "value", "val"):
            data, clock = vectors[others[0]], Channel(own, vectors[own], "s" if own == "time" else "")
        if data is not None:
            label = _text(value.get("Name")) or _text(value.get("label")) or name
            units = (value.get("Unit"), value.get("unit"), value.get("DataInfo", {}).get("Units"))
            unit = next(filter(None, map(_text, units)), "")
            yield from _members(label.split("/")[-1], data, clock, unit)
            return
        clocks = [Channel(key, vector) for key, vector in vectors.items() if is_time(key)]
        for key, member in value.items():
            size = max(np.shape(member), default=0) if isinstance(member, np.ndarray) else 0
            of_size = next((c for c in clocks if len(c.values) == size), clock)
            yield from _members(key, member, of_size, within=f"{within}{name}." if name else "")
    elif isinstance(value, list):
        for member in value:
            yield from _members(name, member, clock, within=within)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "iufbmM":
        columns = {}
        if value.ndim == 2:
            matrix = value.T if value.shape[0] >= value.shape[1] else value
            columns = {f"{name}.{number}": column for number, column in enumerate(matrix, start=1)}
        elif value.ndim == 1 and len(value) > 1:
            columns = {name: value}
        for key, column in columns.items():
            yield Channel(within + key, column, plain_unit(unit), clock, other=key)


def _text(value: Any) -> str:
    return value if isinstance(value, str) else ""


def _matlab(path: Path) -> list[Channel]:
    try:
        loaded = import_module("scipy.io").loadmat(path, appendmat=False, simplify_cells=True)
    except NotImplementedError:  # version 7.3
        loaded = {}
    if not loaded or "__function_workspace__" in loaded:
        matio = import_module("matio")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of objects that are no tables
            loaded = matio.load_from_mat(str(path), add_table_attrs=True)
    variables = {name: value for name, value in loaded.items() if not name.startswith("__")}
    squeezed = {k: v.squeeze() if isinstance(v, np.ndarray) else v for k, v in variables.items()}
    return _nested(path, squeezed)


def _hdf5(path: Path) -> list[Channel]:
    """Channels of an HDF5 file; a dataset's attribute units is its unit."""
    h5py = import_module("h5py")

    def content(item: Any) -> Any:
        if isinstance(item, h5py.Group):
            return {key: content(item[key]) for key in item}
        if not isinstance(item, h5py.Dataset) or item.dtype.kind not in "iufb" or not item.size:
            return None
        if item.size == 1:
            return float(item[()].squeeze())
        limit(path, item.size, MOST_NUMBERS, "numbers")
        unit, values = item.attrs.get("units", item.attrs.get("unit", "")), item[()].squeeze()
        unit = unit.decode(errors="replace") if isinstance(unit, bytes) else str(unit)
        return {"values": values, "label": item.name, "unit": unit} if unit else values

    with h5py.File(path) as file:
        return _nested(path, content(file))


def _arrow(path: Path) -> list[Channel]:
    return given_channels((pd.read_feather if path.suffix.lower() == ".feather" else pd.read_parquet)(path))


def _excel(path: Path) -> list[Channel]:
    """First sheet of a workbook, read as the text that saving it as CSV would give."""
    openpyxl = import_module("openpyxl")
    with zipfile.ZipFile(path) as package:
        limit(path, sum(part.file_size for part in package.infolist()), LARGEST_SHEET, "bytes when unpacked")
    text, cells = io.StringIO(), 0
    writer = csv.writer(text, delimiter="\t", lineterminator="\n")
    sheet = openpyxl.load_workbook(path, read_only=True, data_only=True).worksheets[0]
    for row in sheet.iter_rows(values_only=True):
        cells += len(row)
        limit(path, len(row), MOST_COLUMNS, "columns")
        limit(path, cells, MOST_CELLS, "cells")
        writer.writerow("" if value is None else value for value in row)
    return read_text(path, text.getvalue().encode())


def _tdms(path: Path) -> list[Channel]:
    """Channels of a .tdms file, each with the time of its waveform or of its group."""
    tdms = import_module("nptdms")
    made = list[Channel]()
    with tdms.TdmsFile.open(path) as file:
        groups = [group.channels() for group in file.groups()]
        starts = [c.properties.get("wf_start_time") for group in groups for c in group]
        first = min((start for start in starts if isinstance(start, np.datetime64)), default=None)
        for group in groups:
            own = [Channel(c.name, c[:], str(c.properties.get("unit_string", ""))) for c in group]
            times = [channel for channel in own if is_time(channel.name)]
            for source, channel in zip(group, own, strict=True):
                clock = next((t for t in times if len(t.values) == len(channel.values)), None)
                if source.properties.get("wf_increment"):
                    start = source.properties.get("wf_start_time")
                    known = isinstance(start, np.datetime64)
                    begin = (start - first) / np.timedelta64(1, "s") if known else 0.0
                    clock = Channel("Time", begin + source.time_track(), "s")
                made.append(channel._replace(clock=clock))
    return distinct(made)


def _mdf(path: Path) -> list[Channel]:
    """Channels of an MDF file, each with the times of its group."""
    asammdf = import_module("asammdf")
    with asammdf.MDF(path) as file:
        return [
            Channel(s.name, s.samples, str(s.unit or ""), Channel("Time", s.timestamps, "s"))
            for s in file.iter_channels()
            if s.samples.ndim == 1 and s.samples.dtype.kind in "iufb"
        ]


def _labview(path: Path) -> list[Channel]:
    """Channels of an .lvm file; a segment that counts its time anew follows the one before it by one step."""
    lvm_read = import_module("lvm_read")
    content = lvm_read.read(str(path), read_from_pickle=False, dump_file=False)
    found = dict[str, tuple[np.ndarray, np.ndarray, str]]()  # times, values and unit by name
    for number in range(content["Segments"]):
        for name, t, values, unit in _segment(content[number]):
            if name in found:
                before, earlier, unit = found[name]
                if len(before) > 1 and t[0] <= before[-1]:
                    t = t - t[0] + 2 * before[-1] - before[-2]
                t, values = np.concatenate([before, t]), np.concatenate([earlier, values])
            found[name] = t, values, unit
    return [Channel(name, v, unit, Channel("X_Value", t, "s")) for name, (t, v, unit) in found.items()]


def _segment(segment: dict[str, Any]) -> Iterator[tuple[str, np.ndarray, np.ndarray, str]]:
    """Name, times, values and unit of each channel that has samples in a segment of an .lvm file."""
    times, names = np.empty(0), segment["Channel names"]
    signals = [name for name in names if name not in ("X_Value", "Comment")]
    labels = segment.get("Y_Unit_Label", [])
    labels = labels[::2] if names.count("X_Value") > 1 else labels  # each time has an entry too
    for name, column in zip(names, segment["data"].T, strict=False):
        if name == "X_Value":
            times = column
        if name not in signals or not np.isfinite(column).any():
            continue
        values = column[: np.flatnonzero(np.isfinite(column))[-1] + 1]
        t, k = times[: len(values)], signals.index(name)
        if not np.isfinite(t).any():
            t = segment["X0"][k] + segment["Delta_X"][k] * np.arange(len(values))
        yield name, t, values, plain_unit(labels[k]) if k < len(labels) else ""


def _bag(path: Path) -> list[Channel]:
    """Numbers in the messages of a bag, by topic, at the times in their headers, or else of their logging."""
    highlevel = import_module("rosbags.highlevel")
    typesys = import_module("rosbags.typesys")
    topics = dict[str, list[tuple[int, int, dict[str, Any]]]]()
    with highlevel.AnyReader([path], default_typestore=typesys.get_typestore(typesys.Stores.LATEST)) as bag:
        limit(path, bag.message_count, MOST_ROWS, "messages")
        for connection, logged, content in bag.messages():
            message = bag.deserialize(content, connection.msgtype)
            stamp = getattr(getattr(message, "header", None), "stamp", None)
            ticks = stamp.sec * 10**9 + stamp.nanosec if stamp else 0
            topics.setdefault(connection.topic, []).append((ticks, logged, dict(_numbers_of("", message))))
    found = list[Channel]()
    for topic, messages in topics.items():
        stamps, times, numbers = zip(*messages, strict=True)
        clock = Channel("Time", np.array(stamps if any(stamps) else times), "ns")
        for name in numbers[0]:
            values = np.array([number.get(name, np.nan) for number in numbers])
            found.append(Channel(topic + name, values, "", clock))
    return found


def _numbers_of(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Names and values of the numbers in a message; those of arrays are counted from 1."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            if field.name not in ("__msgtype__", "header"):
                last = "" if field.name == "data" else f"/{field.name}"
                yield from _numbers_of(name + last, getattr(value, field.name))
    elif isinstance(value, np.ndarray | list) and len(value) <= LONGEST_ARRAY:
        for number, member in enumerate(value, start=1):
            yield from _numbers_of(f"{name}/{number}", member)
    elif isinstance(value, int | float | np.number):
        yield name, value


def _text_file(path: Path) -> list[Channel]:
    content = path.read_bytes()
    if path.suffix.lower() == ".gz":
        with gzip.open(path) as file:
            content = file.read(LARGEST_FILE + 1)
        limit(path, len(content), LARGEST_FILE, "bytes or more when unpacked")
    return read_text(path, content)


class Format(NamedTuple):
    """Format of a file, by the ending of its name."""

    suffixes: tuple[str, ...]  # none: every other one
    name: str
    read: Callable[[Path], list[Channel]]
    remark: str


EXTRA = "with `pip install 'pneumo[formats]'`"
MAT = f"PicoScope's; vectors, matrices, structs of Simulink and dSPACE; 7.3, tables and timetables {EXTRA}"
LOGGERS = (
    "TwinCAT Scope, Simulink's Data Inspector, ControlDesk, PlotJuggler, ROS, Arduino's monitor and plotter;"
    " oscilloscopes of Keysight, LeCroy, PicoScope, Rigol, Siglent, Tektronix, Yokogawa"
)
FORMATS = (
    Format((), "CSV", _text_file, f"any separator, decimal sign and preamble; {LOGGERS}; also packed (.gz)"),
    Format((".lvm",), "LabVIEW", _labview, f"several segments and X columns too; {EXTRA}"),
    Format((".mat",), "MATLAB", _matlab, MAT),
    Format(
        (".nc",),
        "NetCDF",
        _netcdf,
        "variables over time with the attribute units, as `pneumo simulate` writes; times as in CF",
    ),
    Format((".h5", ".hdf5"), "HDF5", _hdf5, f"vectors in any group; {EXTRA}"),
    Format((".parquet", ".feather"), "Parquet, Feather", _arrow, EXTRA),
    Format((".xlsx",), "Excel", _excel, f"the first sheet; {EXTRA}"),
    Format((".tdms",), "TDMS", _tdms, f"waveforms of any rates; {EXTRA}"),
    Format((".mdf", ".mf4", ".dat"), "MDF", _mdf, f"groups of any rates; {EXTRA}"),
    Format((".mcap", ".db3", ".bag"), "MCAP, ROS bags", _bag, f"messages of topics of any rates; {EXTRA}"),
)


def _checked(read: Callable[[Path], list[Channel]], path: Path) -> list[Channel]:
    """Channels of a file, not too long together."""
    channels = read(path)
    limit(path, max((len(c.values) for c in channels), default=0), MOST_ROWS, "samples of a signal")
    limit(path, sum(len(channel.values) for channel in channels), MOST_NUMBERS, "numbers")
    return channels


def read_channels(source: Path | str | pd.DataFrame | xr.Dataset) -> tuple[Path, list[Channel]]:
    """Path and channels of a file in one of the `FORMATS`, or of a table in memory.

    `InputError` if the file cannot be read, is too large, or is in an unsupported format.
    """
    if not isinstance(source, Path | str):
        return Path("record"), given_channels(source)
    path = Path(source)
    suffix = path.suffix.lower()
    kind = next((form for form in FORMATS if suffix in form.suffixes), FORMATS[0])
    try:
        with regular_file(path, LARGEST_FILE) as file:
            head = file.read(8)
        if kind is FORMATS[0] or (suffix == ".dat" and not head.startswith(b"MDF")):
            return path, _checked(_text_file, path)
        return path, isolated(_checked, kind.read, path)
    except InputError:
        raise
    except ImportError:
        remedy = "pip install 'pneumo[formats]', or export CSV"
        raise InputError(f"{path}: {kind.name} files are not read without a library: {remedy}") from None
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except Exception as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or " ".join(str(error).split())
        reason = printable(reason or type(error).__name__, 200)
        raise InputError(f"{path}: not a readable {kind.name} file ({reason})") from None
