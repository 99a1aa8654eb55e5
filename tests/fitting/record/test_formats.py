"""Every format gives the same record; limits; a remedy for what is not read."""

import gzip
import os
import pickle
import sys
from pathlib import Path

import netCDF4
import numpy as np
import pandas as pd
import pytest
import written_records as written
import xarray as xr

from pneumo.errors import InputError
from pneumo.fitting.record.columns import Column
from pneumo.fitting.record.measurement import read_measurement

pytestmark = pytest.mark.filterwarnings("ignore")  # of libraries: nobody sees those of a process


@pytest.fixture(autouse=True)
def in_this_process(monkeypatch):
    """Read what `isolated` would read, without the second that a process of its own takes to start."""

    def called(function, *arguments):
        channels = function(*arguments)
        assert pickle.dumps(channels)  # a process could hand them over
        return channels

    monkeypatch.setattr("pneumo.fitting.record.formats.isolated", called)


def read(tmp_path, name, content, **options):
    pytest.importorskip(written.LIBRARIES.get(Path(name).suffix, "numpy"))
    file = tmp_path / name
    file.write_bytes(content.encode() if isinstance(content, str) else content)
    return read_measurement(file, written.plant(), **options)


def same(found, expected, rows=slice(None)):
    # Text has every digit; a unit is converted with one rounding or two, and time in ms is rounded first.
    assert found.period == pytest.approx(written.PERIOD, rel=1e-12)
    np.testing.assert_allclose(found.u, expected["u"][rows], rtol=1e-13)
    np.testing.assert_allclose(1e3 * found.x, expected["x"][rows], rtol=1e-13, atol=1e-12)
    for P, name in zip(found.P, ("P_A", "P_B"), strict=True):
        np.testing.assert_allclose(P / 1e5, expected[name][rows], rtol=1e-14)


@pytest.mark.parametrize("kind", written.COMMON)
def test_every_format_gives_the_same_record(tmp_path, kind):
    found = read(tmp_path, *written.content(kind))
    assert found.notes == ()
    same(found, written.truth())


@pytest.mark.parametrize("kind", written.RATES)
def test_a_slow_command_is_held_on_the_grid_of_the_sensors_until_its_next_sample(tmp_path, kind):
    found = read(tmp_path, *written.content(f"two rates: {kind}"))
    if kind == "PlotJuggler":  # pressures are 0.3 ms late: interpolated to the times of x
        of = written.truth()
        np.testing.assert_array_equal(found.u, of["u"][1:])
        np.testing.assert_allclose(1e3 * found.x, of["x"][1:], rtol=1e-13, atol=1e-12)
        late = np.interp(written.TIME[1:], written.TIME + 3e-4, of["P_A"])
        np.testing.assert_allclose(found.P[0] / 1e5, late, rtol=1e-9)
    else:
        same(found, written.truth())
    assert "u: 50 Hz, held, resampled to 500 Hz" in found.notes
    assert found.channels[0].startswith("u: column ") and ", 50 Hz, held: " in found.channels[0]


def test_a_file_says_what_holds_between_samples(tmp_path):
    linear = written.inspector().replace("zoh", "linear")
    found = read(tmp_path, "a.csv", linear)
    t, u = written.slow("u")
    np.testing.assert_allclose(found.u, np.interp(found.t, t, u), rtol=1e-12)
    assert "u: 50 Hz, interpolated, resampled to 500 Hz" in found.notes


def test_tables_in_memory_are_read_as_files():
    table = written.frame()
    stamps = pd.Timestamp("2024-10-27T02:59:59.9+02:00") + pd.to_timedelta(written.TIME, unit="s")
    dataset = xr.Dataset({name: ("row", values) for name, values in table.items()})
    dataset["T_K"] = 290.0  # no signal
    durations = table.drop(columns="t_s").set_index(pd.to_timedelta(written.TIME, unit="s"))
    berlin = [stamp.isoformat() for stamp in stamps.tz_convert("Europe/Berlin")]  # clocks are put back
    by_stamps = (table.assign(t_s=stamps), table.assign(t_s=berlin))
    for source in (table, table.set_index("t_s"), dataset, durations, *by_stamps):
        same(read_measurement(source, written.plant()), written.truth())


def test_other_names_and_columns_of_a_matrix_are_named_by_a_mapping(tmp_path):
    units = {"t": "s", **written.UNITS}
    mapping = {q: Column(column=f"log.{k}", unit=units[q]) for k, q in enumerate(units, start=1)}
    text = "a bench\n\n" + ";".join(c.column for c in mapping.values()) + "\n" + written.rows(sep=";")
    plain = {quantity: {"column": c.column, "unit": c.unit} for quantity, c in mapping.items()}
    for given in (mapping, plain):
        same(read(tmp_path, "a.csv", text, mapping=given), written.truth())
    with pytest.raises(InputError, match=r"columns: q: must be one of t, u"):
        read(tmp_path, "a.csv", text, mapping={"q": plain["x"]})
    log = np.column_stack([written.TIME, *written.truth().values()])
    for matrix in (log, log.T):  # the longer side is time
        variables = {"log": matrix, "gain": 2.0, "limits": np.arange(5.0), "cube": np.zeros((2, 9, 2))}
        same(read(tmp_path, "a.mat", written.matlab(variables), mapping=mapping), written.truth())


HALF = {"t_s": written.TIME, "u_V": written.TIME[::2], "x_m": written.TIME}
REFUSED = {
    "no vectors": ("a.mat", lambda: written.matlab({"gain": 2.0}), ["no vectors", "P_A_kPa"]),
    "no time of a channel's length": (
        "a.mat",
        lambda: written.matlab(HALF),
        ["no column P_A, P_B, u", "--columns"],  # with two columns there is no mapping to propose
    ),
    "damaged": ("a.mat", b"MATLAB 5.0 MAT-file".ljust(200, b"?"), ["not a readable MATLAB file"]),
    "binary": ("a.dat", bytes(range(256)), ["not a text file", "CSV"]),
    "empty": ("a.csv", b"", ["no numbers", "CSV"]),
    "no names": ("a.csv", lambda: written.rows().encode(), ["no row of 5 names", "P_A_kPa"]),
    "decimal commas between commas": (
        "a.csv",
        b"t_s,u_V,x_mm\n0,001,1,3,10,5\n0,002,1,4,10,6\n",
        ["no row of 6 names", "one has 3", "semicolons"],
    ),
    "long": ("a.csv", b"t_s,u_V\n" + b"0,0\n" * 2_000_001, ["2000001 rows or more: must be at most 2000000"]),
    "late": ("a.csv", b"# a bench\n" * 201 + b"t_s,u_V\n0,1\n", ["within the first 200 lines"]),
    "packed text": (
        "a.csv.gz",
        lambda: gzip.compress(bytes(210_000_000), 1),
        ["bytes or more when unpacked"],
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_is_refused_is_one_line_with_the_remedy(tmp_path, kind):
    name, content, words = REFUSED[kind]
    with pytest.raises(InputError) as caught:
        read(tmp_path, name, content() if callable(content) else content)
    text = str(caught.value)
    assert "\n" not in text and all(word in text for word in [name, *words]), text


@pytest.mark.parametrize(("suffix", "package"), written.LIBRARIES.items())
def test_a_missing_library_gives_one_line_with_the_remedy(tmp_path, monkeypatch, suffix, package):
    file = tmp_path / f"a{suffix}"
    file.write_bytes(written.timetables("v7") if suffix == ".mat" else b"?" * 99)
    for module in [package, *(name for name in sys.modules if name.startswith(f"{package}."))]:
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InputError, match=r"not read without a library: pip install 'pneumo\[formats\]'"):
        read_measurement(file, written.plant())


def test_files_that_are_no_records_are_refused_before_they_are_read(tmp_path, monkeypatch):
    monkeypatch.undo()  # memory is limited in a process of its own
    large, holes = tmp_path / "large.csv", tmp_path / "holes.nc"
    large.touch()
    os.truncate(large, 10**12)  # a terabyte of holes
    with netCDF4.Dataset(holes, "w") as file:
        file.createDimension("t", 300_000_000)
        file.createVariable("t", "f8", ("t",), zlib=True)
    for path, words in (
        (Path("/dev/zero"), "not a regular file"),
        (large, "too large: at most 200000000 bytes"),
        (holes, "more than 800 MB of memory"),
        (tmp_path / "b/../missing/a.csv", "no such file"),
    ):
        with pytest.raises(InputError, match=words):
            read_measurement(path, written.plant())
