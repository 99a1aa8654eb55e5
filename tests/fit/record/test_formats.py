"""Formats that benches write: files of one record give the same measurement, others name a remedy."""

import gzip
import io
import sys
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy.io import savemat
from synthetic_records import synthetic_record

from pneumo.errors import InputError
from pneumo.fit.record import formats as record_formats
from pneumo.fit.record.columns import Column
from pneumo.fit.record.measurement import read_measurement

PERIOD, ROWS = 2e-3, 120  # s; the files are short
UNITS = {"u": "V", "x": "mm", "P_A": "bar", "P_B": "bar"}
TIME = PERIOD * np.arange(ROWS)
MS = 1e3 * TIME
LVM = "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t{point}\n"
LVM += "Multi_Headings\tNo\nX_Columns\t{columns}\nDate\t2024/05/13\nTime\t10:11:12,5\n"
LVM += "***End_of_Header***\t\n\t\nChannels\t4\t\t\t\t\nSamples\t120\t120\t120\t120\t\n"
LVM += "Y_Unit_Label\tV\tmm\tbar\tbar\t\n"
LVM += "X_Dimension\tTime\tTime\tTime\tTime\t\nX0\t0\t0\t0\t0\t\n"
LVM += "Delta_X\t{step}\t{step}\t{step}\t{step}\t\n"
LVM += "***End_of_Header***\t\t\t\t\t\nX_Value\tu\tx\tP_A\tP_B\tComment\n"


@cache
def known():
    """A record, made when a test asks for it."""
    record = synthetic_record(8)
    assert record.period == PERIOD
    return record


def signals():
    """Signals of the files, in their units."""
    u, x, P = known().u[:ROWS], known().x[:ROWS], known().P[:, :ROWS]
    return {"u": u, "x": 1e3 * x, "P_A": P[0] / 1e5, "P_B": P[1] / 1e5}


def rows(time=TIME, **style):
    """The record without a header; `time` None leaves that column empty."""
    table = pd.DataFrame({"t": np.full(ROWS, np.nan) if time is None else time, **signals()})
    return table.to_csv(index=False, header=False, lineterminator="\n", **{"sep": ",", **style})


def named(separator, bracket="{} [{}]", time="Time [ms]"):
    return separator.join([time, *(bracket.format(name, unit) for name, unit in UNITS.items())]) + "\n"


def matlab_of(variables, **options):
    file = io.BytesIO()
    savemat(file, variables, **options)
    return file.getvalue()


def matlab(**options):
    columns = {f"{name}_{UNITS[name]}": signal for name, signal in signals().items()}
    return matlab_of({"t_ms": MS, **columns, "gain": 2.0}, **options)


def netcdf():
    units, columns = {"t": "s", **UNITS}, {"t": TIME, **signals()}
    variables = {name: ("row", columns[name], {"units": unit}) for name, unit in units.items()}
    return bytes(xr.Dataset(variables).to_netcdf())


def labview(point, columns):
    return LVM.format(point=point, columns=columns, step=str(PERIOD).replace(".", point))


def simulink():
    """Struct of Simulink's block To Workspace, and one of ControlDesk's recorder."""
    block = [{"values": v, "label": f"{n}_{UNITS[n]}", "dimensions": 1} for n, v in signals().items()]
    return matlab_of({"out": {"time": TIME, "signals": block, "blockName": "bench/log"}})


def controldesk():
    Y = [{"Name": f"Model Root/{n}", "Data": v, "Unit": UNITS[n]} for n, v in signals().items()]
    return matlab_of({"rec1_001": {"X": {"Name": "", "Data": TIME}, "Y": Y, "Description": {"General": {}}}})


def in_memory(write):
    file = io.BytesIO()
    write(file)
    return file.getvalue()


def frame():
    return pd.DataFrame({"t_s": TIME, **{f"{n} [{UNITS[n]}]": v for n, v in signals().items()}})


def rostopic():
    stamps = (1_715_594_400_000_000_000 + np.round(1e9 * TIME)).astype(np.int64)
    units = ",".join(f"field.{name}_{unit}" for name, unit in UNITS.items())
    return f"%time,{units}\n" + rows(stamps)


FILES = {
    "packed": ("a.csv.gz", lambda: gzip.compress((named(",") + rows(MS)).encode())),
    "MATLAB, To Workspace": ("a.mat", simulink),
    "MATLAB, dSPACE": ("a.mat", controldesk),
    "commas, time in ms": ("a.csv", lambda: named(",") + rows(MS)),
    "semicolons, decimal commas, Latin-1": (
        "a.csv",
        lambda: ("Prüfstand 3;22 °C\n" + named(";") + rows(MS, sep=";", decimal=",")).encode("latin-1"),
    ),
    "tabs below comments": ("a.txt", lambda: "# bench 3, 12 May\n#\n" + named("\t") + rows(MS, sep="\t")),
    "spaces, commented header with commas": ("a.exp", lambda: "#" + named(",", "{}({})") + rows(MS, sep=" ")),
    "row of units": ("a.csv", lambda: "Time;u;x;P_A;P_B\n[ms];[V];[mm];[bar];[bar]\n" + rows(MS, sep=";")),
    "ControlDesk: a preamble, names, units, a marker": (
        "a.csv",
        lambda: (
            'descriptions\nversion,1.5\nrecorder,"Recorder 1"\ntrace_names\n'
            "Time,u,x,P_A,P_B\ns,V,mm,bar,bar\ntrace_values\n" + rows()
        ),
    ),
    "Excel's Unicode text": ("a.txt", lambda: (named("\t") + rows(MS, sep="\t")).encode("utf-16")),
    "LabVIEW with a column of time": ("a.lvm", lambda: labview(".", "One") + rows(sep="\t")),
    "LabVIEW without, commas": ("a.lvm", lambda: labview(",", "No") + rows(None, sep="\t", decimal=",")),
    "MATLAB 4": ("a.mat", lambda: matlab(format="4")),
    "MATLAB 7": ("a.mat", lambda: matlab(do_compression=True)),
    "NetCDF": ("a.nc", netcdf),
}


def read(tmp_path, name, content, **options):
    file = tmp_path / name
    file.write_bytes(content.encode() if isinstance(content, str) else content)
    return read_measurement(file, known().configured, **options)


@pytest.mark.parametrize("kind", FILES)
def test_every_format_gives_the_same_measurement(tmp_path, kind):
    name, content = FILES[kind]
    signals = read(tmp_path, name, content())
    assert signals.notes == ()
    # Text has every digit; a unit is converted with one rounding or two, and time in ms is rounded first.
    assert signals.period == pytest.approx(PERIOD, rel=1e-12)
    np.testing.assert_allclose(signals.x, known().x[:ROWS], rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(signals.P, known().P[:, :ROWS], rtol=1e-14)
    np.testing.assert_allclose(signals.u, known().u[:ROWS], rtol=1e-14)


def test_units_with_signs_outside_ascii(tmp_path):
    lines = [f"22,{row}\n" for row in rows(1e6 * TIME).splitlines()]
    text = "".join([named(",", time="T [°C],Zeit [µs]"), *lines])
    signals = read(tmp_path, "a.csv", text.encode("latin-1"))
    assert abs(signals.T - 295.15) < 1e-9
    assert signals.period == pytest.approx(PERIOD, rel=1e-9)


def test_names_from_a_mapping_below_any_header(tmp_path):
    text = "a bench\n\nclock;c1;c2;c3;c4\n" + rows(sep=";")
    names = dict(zip(("t", "u", "x", "P_A", "P_B"), ("clock", "c1", "c2", "c3", "c4"), strict=True))
    mapping = {q: Column(column=name, unit={"t": "s", **UNITS}[q]) for q, name in names.items()}
    signals = read(tmp_path, "a.csv", text, mapping=mapping)
    np.testing.assert_allclose(signals.x, known().x[:ROWS], rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(signals.P, known().P[:, :ROWS], rtol=1e-14)


def test_a_few_missing_samples_are_filled_and_said(tmp_path, monkeypatch):
    monkeypatch.setattr("pneumo.fit.record.measurement.MOST_MISSING", 0.05)
    lines = rows().splitlines()
    for index, column in ((20, 1), (50, 3), (51, 3)):
        fields = lines[index].split(",")
        lines[index] = ",".join("NaN" if number == column else field for number, field in enumerate(fields))
    signals = read(tmp_path, "a.csv", named(",", time="t_s") + "\n".join(lines))
    held, interpolated = signals.notes
    assert held == "column u: 1 of 120 samples missing, held"
    assert interpolated == "column P_A: 2 of 120 samples missing, interpolated"
    assert signals.u[20] == known().u[19]
    P = known().P[0]
    filled = P[49] + (P[52] - P[49]) * np.array([1, 2]) / 3
    np.testing.assert_allclose(signals.P[0, 50:52], filled, rtol=1e-12)
    assert np.array_equal(signals.P[1], read(tmp_path, "b.csv", named(",", time="t_s") + rows()).P[1])


def test_before_the_first_command_that_is_there_it_is_taken_to_hold(tmp_path):
    table = pd.DataFrame({"t_s": TIME, **{f"{name}_{UNITS[name]}": v for name, v in signals().items()}})
    table.loc[0, "u_V"] = np.nan
    found = read(tmp_path, "a.csv", table.to_csv(index=False))
    assert found.notes == ("column u: 1 of 120 samples missing, held",)
    assert found.u[0] == found.u[1] == known().u[1]


def test_stamps_of_ros_and_iso_are_seconds_from_the_first(tmp_path):
    iso = pd.Timestamp("2024-05-13T10:11:12") + pd.to_timedelta(TIME, unit="s")
    text = named(",", time="Time") + rows([stamp.isoformat() for stamp in iso])
    for name, content in (("a.csv", rostopic()), ("b.csv", text)):
        found = read(tmp_path, name, content)
        # A double holds nanoseconds since 1970 to 256 ns; periods are the mean of 119.
        assert found.period == pytest.approx(PERIOD, rel=1e-5)
        np.testing.assert_allclose(found.x, known().x[:ROWS], rtol=1e-14, atol=1e-15)


def test_a_matrix_has_columns_that_a_mapping_names(tmp_path):
    content = matlab_of({"log": np.column_stack([TIME, *signals().values()]), "gain": 2.0})
    units = {"t": "s", **UNITS}
    mapping = {q: Column(column=f"log.{k}", unit=unit) for k, (q, unit) in enumerate(units.items(), start=1)}
    found = read(tmp_path, "a.mat", content, mapping=mapping)
    np.testing.assert_allclose(found.P, known().P[:, :ROWS], rtol=1e-14)


def test_scale_and_offset_of_a_current_loop(tmp_path):
    """4 to 20 mA for 0 to 10 bar of gauge pressure."""
    P = {name: 4 + 1.6 * (signals()[name] - 1.01325) for name in ("P_A", "P_B")}
    table = pd.DataFrame({"t": TIME, **signals(), **P})
    mapping = {"t": Column(column="t", unit="s")}
    mapping |= {name: Column(column=name, unit=UNITS[name]) for name in ("u", "x")}
    loop = {"unit": "barg", "scale": 1 / 1.6, "offset": -4 / 1.6}
    mapping |= {name: Column(column=name, **loop) for name in ("P_A", "P_B")}
    found = read(tmp_path, "a.csv", table.to_csv(index=False), mapping=mapping)
    np.testing.assert_allclose(found.P, known().P[:, :ROWS], rtol=1e-12)


LIBRARIES = {
    "Parquet": ("a.parquet", "pyarrow", lambda: in_memory(lambda f: frame().to_parquet(f))),
    "Feather": ("a.feather", "pyarrow", lambda: in_memory(lambda f: frame().to_feather(f))),
    "Excel": ("a.xlsx", "openpyxl", lambda: in_memory(lambda f: frame().to_excel(f, index=False))),
    "MATLAB 7.3": ("a.mat", "h5py", lambda: matlab_73()),
    "TDMS": ("a.tdms", "nptdms", lambda: tdms()),
    "MDF": ("a.mf4", "asammdf", lambda: mdf()),
}


def matlab_73():
    h5py = pytest.importorskip("h5py")
    file = io.BytesIO()
    with h5py.File(file, "w", userblock_size=512) as h5:
        for name, signal in frame().items():
            h5[name.replace(" [", "_").removesuffix("]")] = np.asarray(signal)[None]
        h5["gain"] = np.array([[2.0]])  # a scalar, as MATLAB stores it
    return b"MATLAB 7.3 MAT-file".ljust(128) + file.getvalue()[128:]


def tdms():
    nptdms = pytest.importorskip("nptdms")
    waveform = {"wf_increment": PERIOD, "wf_start_offset": 0.0, "wf_samples": ROWS}
    channels = [
        nptdms.ChannelObject("bench", name, signal, properties={"unit_string": UNITS[name], **waveform})
        for name, signal in signals().items()
    ]

    def write(file):
        with nptdms.TdmsWriter(file) as writer:
            writer.write_segment(channels)

    return in_memory(write)


def mdf():
    asammdf = pytest.importorskip("asammdf")
    columns = [asammdf.Signal(v, TIME, name=n, unit=UNITS[n]) for n, v in signals().items()]
    file = asammdf.MDF(version="4.10")
    file.append(columns)
    with tempfile.TemporaryDirectory() as folder:
        return file.save(Path(folder) / "a.mf4", overwrite=True).read_bytes()


@pytest.mark.parametrize("kind", LIBRARIES)
def test_formats_of_other_libraries(tmp_path, kind):
    name, package, content = LIBRARIES[kind]
    pytest.importorskip(package)
    found = read(tmp_path, name, content())
    assert found.period == pytest.approx(PERIOD, rel=1e-9)
    np.testing.assert_allclose(found.x, known().x[:ROWS], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(found.P, known().P[:, :ROWS], rtol=1e-12)


def test_of_a_workbook_the_first_sheet_is_read(tmp_path):
    pytest.importorskip("openpyxl")

    def write(file):
        with pd.ExcelWriter(file, engine="openpyxl") as book:
            frame().to_excel(book, sheet_name="record", index=False)
            pd.DataFrame({"a remark": ["bench 3"]}).to_excel(book, sheet_name="remarks", index=False)

    found = read(tmp_path, "a.xlsx", in_memory(write))
    np.testing.assert_allclose(found.x, known().x[:ROWS], rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("kind", LIBRARIES)
def test_a_missing_library_is_named_with_the_remedy(tmp_path, monkeypatch, kind):
    name, package, _ = LIBRARIES[kind]
    for module in (package, f"{package}.parquet", f"{package}.feather"):
        monkeypatch.setitem(sys.modules, module, None)
    content = b"MATLAB 7.3 MAT-file".ljust(600) if package == "h5py" else b"?"
    with pytest.raises(
        InputError, match=rf"^[^\n]*{name}: .*pip install 'pneumo\[formats\]' \(here {package}\)"
    ):
        read(tmp_path, name, content)


PERIODS = [(1e3, "samples are 2 s apart: must be 1e-05 to 0.1 s; is t in ms"), (1e-3, "2e-06 s apart")]


@pytest.mark.parametrize(("factor", "said"), PERIODS)
def test_a_period_of_no_cylinder_is_refused_at_once(tmp_path, factor, said):
    with pytest.raises(InputError, match=said):
        read(tmp_path, "a.csv", named(",", time="t_s") + rows(factor * TIME))


def test_a_command_about_another_voltage_is_asked_about(tmp_path):
    steps = np.arange(ROWS)
    x = 0.3e3 * known().configured.cylinder.stroke * np.sin(steps / 10)  # mm
    table = pd.DataFrame({"t_s": TIME, **signals()}).assign(u=5 + np.cos(steps / 10), x=x)
    table = table.rename(columns={name: f"{name}_{unit}" for name, unit in UNITS.items()})
    with pytest.raises(InputError, match=r"column u: .* of one sign.*offset: -"):
        read(tmp_path, "a.csv", table.to_csv(index=False))


REFUSED = {
    "no vectors": ("a.mat", lambda: matlab_of({"gain": 2.0}), ["no vectors", "P_A_kPa"]),
    "damaged": ("a.mat", b"MATLAB 5.0 MAT-file".ljust(200, b"?"), ["not a readable MATLAB file"]),
    "an old sheet": ("a.xls", b"PK", ["save the sheet as CSV"]),
    "NumPy": ("a.npz", b"PK", ["CSV or Parquet"]),
    "ControlDesk's own": ("a.idf", b"IDF", ["ControlDesk as CSV or .mat"]),
    "binary": ("a.dat", bytes(range(256)), ["not a text file", "CSV"]),
    "empty": ("a.csv", b"", ["no numbers", "CSV"]),
    "no names": ("a.csv", lambda: rows().encode(), ["no row of 5 names", "P_A_kPa"]),
    "a segment's headings": ("a.lvm", lambda: labview(".", "Multi") + rows(sep="\t"), ["one X column"]),
}


def test_every_format_is_tested():
    suffixes = {
        "." + name.rpartition(".")[2]
        for name, *_ in [*FILES.values(), *LIBRARIES.values(), *REFUSED.values()]
    }
    assert all(not form.suffixes or suffixes & {*form.suffixes} for form in record_formats.FORMATS)


@pytest.mark.parametrize("kind", REFUSED)
def test_what_is_refused_is_one_line_with_the_remedy(tmp_path, kind):
    name, content, words = REFUSED[kind]
    with pytest.raises(InputError) as caught:
        read(tmp_path, name, content() if callable(content) else content)
    text = str(caught.value)
    assert "\n" not in text and all(word in text for word in [name, *words]), text


def test_a_small_matlab_file_of_a_huge_vector_is_refused_before_it_is_loaded(tmp_path, monkeypatch):
    monkeypatch.setattr(record_formats, "LARGEST_FILE", 1_000_000)
    monkeypatch.setattr("scipy.io.loadmat", None)
    content = matlab_of({"a": {"t_s": np.zeros(1_000_000)}}, do_compression=True)
    assert len(content) < 10_000
    with pytest.raises(InputError, match="bytes when unpacked: must be at most 1000000"):
        read(tmp_path, "a.mat", content)
