"""One record in every format that is read, and in what a logger would write it.

pandas, PyArrow, openpyxl, SciPy, mat-io, xarray, h5py, npTDMS, asammdf and rosbags write most of them.
By hand, after the documentation of their makers: CSV of TwinCAT Scope (Beckhoff, TE13xx, and a file of case
08), of Simulink's Data Inspector and writetimetable (MathWorks), of PlotJuggler and ROS, LabVIEW's .lvm (NI,
"Specification for the LabVIEW Measurement File"), and the structs of MATLAB and dSPACE. No file was written
by LabVIEW, MATLAB, ControlDesk, TwinCAT or ROS themselves.
"""

import gzip
import io
import tempfile
import warnings
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from scipy.io import savemat

from pneumo.configuration.parameters import load, study
from pneumo.runs import simulate
from pneumo.selection.plants import configured_plant

CONFIGURATION, CYLINDER = Path(__file__).parents[3] / "config/paper.yaml", "D"
PERIOD, ROWS, SLOW = 2e-3, 400, 10  # s; samples; of the command in files of two rates
TIME = PERIOD * np.arange(ROWS)
MS = 2.0 * np.arange(ROWS)
UNITS = {"u": "V", "x": "mm", "P_A": "bar", "P_B": "bar"}
STAMP = 1_715_594_400  # s since 1970


@cache
def plant():
    return configured_plant(study(load(CONFIGURATION)), CYLINDER, 0.5)


@cache
def truth():
    """Signals in the units of the files; the command changes every `SLOW` samples."""
    steps = np.arange(ROWS) // SLOW
    run = simulate(plant(), PERIOD, command=2.0 * np.sign(np.sin(steps / 5) + np.sin(steps / 3)) + 0.3)
    noise = np.random.default_rng(1).normal(0.0, 300.0, (2, ROWS))
    return {
        "u": run.u,
        "x": 1e3 * run.x,
        "P_A": (run.P_A + noise[0]) / 1e5,
        "P_B": (run.P_B + noise[1]) / 1e5,
    }


def rows(time=TIME, **style):
    """The record without a header; `time` None leaves that column empty."""
    table = pd.DataFrame({"t": np.full(ROWS, np.nan) if time is None else time, **truth()})
    return table.to_csv(index=False, header=False, lineterminator="\n", **{"sep": ",", **style})


def named(separator, bracket="{} [{}]", time="Time [ms]"):
    return separator.join([time, *(bracket.format(name, unit) for name, unit in UNITS.items())]) + "\n"


def in_memory(write):
    file = io.BytesIO()
    write(file)
    return file.getvalue()


def frame(time="t_s"):
    return pd.DataFrame({time: TIME, **{f"{n} [{UNITS[n]}]": v for n, v in truth().items()}})


def slow(name):
    """Times and values of a signal in a file of two rates."""
    return (TIME[::SLOW], truth()["u"][::SLOW]) if name == "u" else (TIME, truth()[name])


def lines(columns, separator, decimal="."):
    """Rows of columns of different length, blank where one has ended."""
    table = pd.DataFrame(dict(enumerate(map(pd.Series, columns))))
    return table.to_csv(sep=separator, decimal=decimal, index=False, header=False, lineterminator="\n")


def scope():
    head = "Name\tScope\nFile\tbench.svd\n\n"
    for label in ("Name {}", "NetId 5.1.2.3.1.1", "Port 851", "SymbolName MAIN.{}", "Unit [{unit}]"):
        entries = [label.replace(" ", "\t").format(name, unit=unit) for name, unit in UNITS.items()]
        head += "\t".join(entries) + "\n"
    columns = [column for name in UNITS for column in (1e3 * slow(name)[0], slow(name)[1])]
    return head + "\n" + lines(columns, "\t", ",") + "EOF\n"


def inspector():
    t, u = slow("u")
    columns = [TIME, *(truth()[n] for n in ("x", "P_A", "P_B")), t, u]
    head = "time,x,P_A,P_B,time,u\n,Unit: mm,Unit: bar,Unit: bar,,Unit: V\n"
    return head + ",Interp: linear,Interp: linear,Interp: linear,,Interp: zoh\n" + lines(columns, ",")


def in_a_tree():
    """Columns of time for the command and for the sensors, under different names."""
    t, u = slow("u")
    head = (
        "valve.Time [s];valve.u [V];cylinder.Time [s];cylinder.x [mm];cylinder.P_A [bar];cylinder.P_B [bar]\n"
    )
    return head + lines([t, u, TIME, *(truth()[n] for n in ("x", "P_A", "P_B"))], ";")


def labview(point=".", columns="One", segments=1, of=lambda name: (TIME, truth()[name])):
    """File of LabVIEW with one column of times, none, or (Multi) one for each signal; in segments of rows."""
    text = f"LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t{point}\n"
    text += f"X_Columns\t{columns}\nDate\t2024/05/13\n***End_of_Header***\t\n\t\n"
    times = {"One": "u", "No": "", "Multi": UNITS}[columns]
    gap = "\t\t" if columns == "Multi" else "\t"
    for rows_of in np.split(np.arange(ROWS), segments):
        parts = {n: [column[rows_of[0] : rows_of[-1] + 1] for column in of(n)] for n in UNITS}
        first, step = (
            [repr(float(f(parts[n][0]))) for n in UNITS] for f in (lambda t: t[0], lambda t: t[1] - t[0])
        )
        labels = {"Y_Unit_Label": UNITS.values(), "X0": first, "Delta_X": step}
        text += f"Channels\t4{4 * gap}\n"
        text += "".join(f"{key}\t{gap.join(v)}\t\n" for key, v in labels.items()).replace("0.", f"0{point}")
        text += "***End_of_Header***\n"
        names = [name for n in UNITS for name in ((["X_Value"] if n in times else []) + [n])]
        text += ("" if times else "X_Value\t") + "\t".join([*names, "Comment"]) + "\n"
        body = [column for n in UNITS for column in (parts[n] if n in times else parts[n][1:])]
        before = "" if times else "\t"
        text += "".join(f"{before}{row}\n" for row in lines(body, "\t", point).splitlines()) + "\n"
    return text


def plotjuggler():
    """Rows at the times of any signal; cells of the others are blank."""
    signals = [pd.Series(slow(n)[1], index=slow(n)[0], name=f"/bench/{n}_{UNITS[n]}") for n in UNITS]
    later = {n: STAMP % 1000 + (3e-4 if n[0] == "P" else 0.0) for n in UNITS}  # topics differ in their times
    moved = [s.set_axis(s.index + later[n]) for s, n in zip(signals, UNITS, strict=True)]
    return pd.concat(moved, axis=1).sort_index().rename_axis("__time").to_csv()


def sec_nanosec():
    ticks = STAMP * 10**9 + np.round(1e9 * TIME).astype(np.int64)
    stamps = {"header.stamp.sec": ticks // 10**9, "header.stamp.nanosec": ticks % 10**9}
    return pd.DataFrame({**stamps, **{f"{n}_{UNITS[n]}": v for n, v in truth().items()}}).to_csv(index=False)


def rostopic():
    stamps = STAMP * 10**9 + np.round(1e9 * TIME).astype(np.int64)
    return "%time," + ",".join(f"field.{name}_{unit}" for name, unit in UNITS.items()) + "\n" + rows(stamps)


def matlab(variables, **options):
    return in_memory(lambda file: savemat(file, variables, **options))


def vectors():
    return {"t_ms": MS, **{f"{n}_{UNITS[n]}": v for n, v in truth().items()}, "gain": 2.0}


def to_workspace():
    block = [{"values": v, "label": f"{n}_{UNITS[n]}", "dimensions": 1} for n, v in truth().items()]
    return matlab({"out": {"time": TIME, "signals": block, "blockName": "bench/log"}})


def controldesk():
    Y = [{"Name": f"Model Root/{n}", "Data": v, "Unit": UNITS[n], "XIndex": 1} for n, v in truth().items()]
    return matlab({"rec1_001": {"X": {"Name": "", "Data": TIME}, "Y": Y, "Description": {"General": {}}}})


def time_series():
    series = {n: dict(zip(("Time", "Data"), slow(n), strict=True)) for n in UNITS}
    return matlab({n: {"Name": n, "DataInfo": {"Units": UNITS[n]}} | series[n] for n in UNITS})


def netcdf():
    data = xr.Dataset()
    for n in UNITS:
        dim = "time_u" if n == "u" else "time"
        data[n] = (dim, slow(n)[1], {"units": UNITS[n]})
        data[dim] = (dim, 1e3 * slow(n)[0], {"units": "milliseconds since 2024-05-13"})
    return bytes(data.to_netcdf())


def matio(variables, version):
    """MATLAB file with what SciPy does not write: HDF5, and timetables."""
    import matio

    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # durations in s, as MATLAB has them
        matio.save_to_mat(f"{folder}/a.mat", variables, version=version)
        return Path(folder, "a.mat").read_bytes()


def timetables(version):
    tables = {}
    for k, names in enumerate((("u",), ("x", "P_A", "P_B"))):
        time = pd.TimedeltaIndex(pd.to_timedelta(slow(names[0])[0], unit="s"), name="Time")
        tables[f"log{k}"] = pd.DataFrame({f"{n}_{UNITS[n]}": slow(n)[1] for n in names}, index=time)
    return matio(tables, version)


def hdf5():
    import h5py

    def write(file):
        with h5py.File(file, "w") as h5:
            for name, signal in vectors().items():
                h5[f"bench/{name}"] = np.asarray(signal)[None]

    return in_memory(write)


def bag(suffix):
    """Bag of ROS 1 or 2: numbers at the times of their logging, and later logged messages with stamps."""
    from rosbags import rosbag1, rosbag2
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    ros1 = suffix == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    fields = "".join(f"float64 {n}_{UNITS[n]}\n" for n in ("x", "P_A", "P_B"))
    store.register(get_types_from_msg(f"std_msgs/Header header\n{fields}", "bench/msg/State"))
    kinds = {"/u_V": "std_msgs/msg/Float64", "/state": "bench/msg/State"}
    command, state = (store.types[kind] for kind in kinds.values())
    header, stamp = store.types["std_msgs/msg/Header"], store.types["builtin_interfaces/msg/Time"]
    number = {"seq": 0} if ros1 else {}
    messages = [(t, "/u_V", command(data=u)) for t, u in zip(*slow("u"), strict=True)]
    for t, *values in zip(TIME, *(truth()[n] for n in ("x", "P_A", "P_B")), strict=True):
        time = stamp(sec=STAMP, nanosec=round(1e9 * t))
        messages.append((t + 0.01, "/state", state(header(stamp=time, frame_id="", **number), *values)))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"a{suffix}"
        plugin = rosbag2.StoragePlugin.MCAP if suffix == ".mcap" else rosbag2.StoragePlugin.SQLITE3
        with (
            rosbag1.Writer(file) if ros1 else rosbag2.Writer(file, version=9, storage_plugin=plugin) as writer
        ):
            topics = {
                topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in kinds.items()
            }
            serialize = store.serialize_ros1 if ros1 else store.serialize_cdr
            for t, topic, message in messages:
                content = bytes(serialize(message, kinds[topic]))
                writer.write(topics[topic], STAMP * 10**9 + round(1e9 * t), content)
        return (file if ros1 else file / f"a{suffix}{suffix}").read_bytes()


def tdms():
    import nptdms

    channels = []
    for n in UNITS:
        t, values = slow(n)
        start = np.datetime64("2024-05-13T10:00:00") if n == "u" else np.datetime64("2024-05-13T09:59:59.900")
        wave = {
            "wf_increment": float(t[1]),
            "wf_start_offset": 0.0 if n == "u" else 0.1,
            "wf_start_time": start,
        }
        properties = {"unit_string": UNITS[n], **wave}
        channels.append(nptdms.ChannelObject(f"rate {t[1]}", n, values, properties=properties))

    def write(file):
        with nptdms.TdmsWriter(file) as writer:
            writer.write_segment(channels)

    return in_memory(write)


def mdf():
    import asammdf

    with tempfile.TemporaryDirectory() as folder, asammdf.MDF(version="4.10") as file:
        for names in (("u",), ("x", "P_A", "P_B")):
            file.append([asammdf.Signal(slow(n)[1], slow(n)[0] + 3.0, name=n, unit=UNITS[n]) for n in names])
        return file.save(Path(folder) / "a.mf4", overwrite=True).read_bytes()


COMMON = {  # one rate
    "commas, time in ms": ("a.csv", lambda: named(",") + rows(MS)),
    "packed": ("a.csv.gz", lambda: gzip.compress((named(",") + rows(MS)).encode(), mtime=0)),
    "semicolons, decimal commas, Latin-1": (
        "a.csv",
        lambda: ("Prüfstand 3;22 °C\n" + named(";") + rows(MS, sep=";", decimal=",")).encode("latin-1"),
    ),
    "tabs below comments": ("a.txt", lambda: "# bench 3, 12 May\n#\n" + named("\t") + rows(MS, sep="\t")),
    "spaces, commented header with commas": ("a.exp", lambda: "#" + named(",", "{}({})") + rows(MS, sep=" ")),
    "row of units": ("a.csv", lambda: "Time;u;x;P_A;P_B\n[ms];[V];[mm];[bar a];[bara]\n" + rows(MS, sep=";")),
    "row of units in parentheses, a line at the end": (
        "a.csv",
        lambda: "Time,u,x,pA,pB\n(ms),(V),(mm),(bar),(bar)\n\n" + rows(MS) + "\nEnd of file; 9 signals\n",
    ),
    "units behind slashes": ("a.csv", lambda: "t/ms,u/V,x/mm,p_A/bar,p_B/bar\n" + rows(MS)),
    "Excel's Unicode text": ("a.txt", lambda: (named("\t") + rows(MS, sep="\t")).encode("utf-16")),
    "ISO stamps": (
        "a.csv",
        lambda: named(",", time="Time") + rows([f"2024-05-13T10:11:{t:09.6f}" for t in TIME]),
    ),
    "time of day": (
        "a.csv",
        lambda: named(";", time="Zeit") + rows([f"10:11:{t:09.6f}" for t in TIME], sep=";"),
    ),
    "MATLAB's writetimetable": (
        "a.csv",
        lambda: named(",", time="Time") + rows([f"{t!r} sec" for t in TIME.tolist()]),
    ),
    "LabVIEW with a column of time": ("a.lvm", labview),
    "LabVIEW without, commas, in segments": ("a.lvm", lambda: labview(",", "No", segments=4)),
    "rostopic": ("a.csv", rostopic),
    "ROS 2, sec and nanosec": ("a.csv", sec_nanosec),
    "MATLAB 4": ("a.mat", lambda: matlab(vectors(), format="4")),
    "MATLAB 7": ("a.mat", lambda: matlab(vectors(), do_compression=True)),
    "MATLAB 7.3": ("a.mat", lambda: matio(vectors(), "v7.3")),
    "MATLAB, To Workspace": ("a.mat", to_workspace),
    "MATLAB, dSPACE": ("a.mat", controldesk),
    "HDF5": ("a.h5", hdf5),
    "Parquet, timedeltas": (
        "a.parquet",
        lambda: in_memory(lambda f: frame("t").assign(t=pd.to_timedelta(TIME, unit="s")).to_parquet(f)),
    ),
    "Feather": ("a.feather", lambda: in_memory(lambda f: frame().to_feather(f))),
    "Excel": ("a.xlsx", lambda: in_memory(lambda f: frame().to_excel(f, index=False, engine="openpyxl"))),
}
BAGS = (".mcap", ".db3", ".bag")
RATES = {  # the command more slowly
    "TwinCAT Scope": ("a.csv", scope),
    "Data Inspector": ("a.csv", inspector),
    "clocks in a tree": ("a.csv", in_a_tree),
    "LabVIEW, two increments": ("a.lvm", lambda: labview(columns="No", of=slow)),
    "LabVIEW, pairs of columns": ("a.lvm", lambda: labview(columns="Multi", of=slow)),
    "PlotJuggler": ("a.csv", plotjuggler),
    "MATLAB, time series": ("a.mat", time_series),
    "MATLAB 7, timetables": ("a.mat", lambda: timetables("v7")),
    "MATLAB 7.3, timetables": ("a.mat", lambda: timetables("v7.3")),
    **{f"ROS, {suffix}": (f"a{suffix}", lambda suffix=suffix: bag(suffix)) for suffix in BAGS},
    "NetCDF": ("a.nc", netcdf),
    "TDMS": ("a.tdms", tdms),
    "MDF": ("a.mf4", mdf),
}
TEXTS = (".csv", ".txt", ".exp", ".gz")
LIBRARIES = {
    **{".parquet": "pyarrow", ".feather": "pyarrow", ".xlsx": "openpyxl", ".h5": "h5py"},
    **{".tdms": "nptdms", ".mf4": "asammdf", ".lvm": "lvm_read", ".mat": "matio"},
    **dict.fromkeys(BAGS, "rosbags"),
}


def content(kind):
    """Name and bytes of one of the files."""
    name, make = {**COMMON, **{f"two rates: {k}": v for k, v in RATES.items()}}[kind]
    made = make()
    return name, made.encode() if isinstance(made, str) else made


def is_text(kind):
    """Whether a kind of file is read without a library."""
    return {**COMMON, **{f"two rates: {k}": v for k, v in RATES.items()}}[kind][0].endswith(TEXTS)
