"""Tables of files, column by column, and their limits.

Libraries that are installed only with `pneumo[formats]` are replaced by objects with the few methods that the
readers use; `test_formats.py` has files of the real ones.
"""

import gzip
import io
import struct
import subprocess
import sys
import zipfile
import zlib
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from pneumo.errors import InputError
from pneumo.fit.record import formats

ROWS = 120
T = 2e-3 * np.arange(ROWS)
U = np.sin(T)


def read(tmp_path, name, content=b"?"):
    file = tmp_path / name
    file.write_bytes(content)
    return formats.read_table(file, {"s", "V"})


def refusal(tmp_path, name, content=b"?"):
    with pytest.raises(InputError) as error:
        read(tmp_path, name, content)
    return str(error.value).removeprefix(f"{tmp_path}/")


def matlab(**variables):
    file = io.BytesIO()
    savemat(file, variables)
    return file.getvalue()


def test_the_formats_are_listed_without_loading_a_library():
    """The command's help lists them; pandas and xarray would take it a second."""
    code = "import sys, pneumo.fit.record.formats; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"pandas", "xarray", "netCDF4", "scipy"} & {*run.stdout.split()}


def test_of_matlab_the_longest_vectors_are_read_and_no_text_or_table_of_three_dimensions(tmp_path):
    content = matlab(
        t_s=T, u_V=U, limits=np.arange(5.0), remarks=np.array(["a"] * 300), cube=np.zeros((2, 300, 2))
    )
    table = read(tmp_path, "a.mat", content)
    assert list(table.columns) == ["t_s", "u_V"] and table.first_line == 0
    np.testing.assert_array_equal(table.columns["u_V"], U)


@pytest.mark.parametrize("signals", [3, 12])
def test_the_longer_side_of_a_matrix_is_time(tmp_path, signals):
    """Of 12 signals too, whose number of samples is less than 12 squared."""
    rows = np.arange(signals)[:, None] + T
    for matrix in (rows, rows.T):
        table = read(tmp_path, "a.mat", matlab(log=matrix)).columns
        assert list(table) == [f"log.{k}" for k in range(1, signals + 1)]
        np.testing.assert_array_equal(table["log.2"], 1 + T)


def test_data_without_a_name_of_its_own_has_that_of_its_struct(tmp_path):
    variables = {
        "Time": 1e3 * T,
        "P_A_bar": {"Data": 1 + T},
        "u_V": {"Data": U},
        "z": {"Data": T, "Name": "a/b/x"},
    }
    table = read(tmp_path, "a.mat", matlab(**variables))
    assert {*table.columns} == {"Time", "P_A_bar", "u_V", "x"}
    assert table.units == {}  # nothing says that Time is in s


def test_signals_of_one_block_that_has_several_names_are_numbered(tmp_path):
    block = {"values": np.column_stack([U, U + 1]), "label": np.array(["P_A", "P_B"], dtype=object)}
    table = read(tmp_path, "a.mat", matlab(out={"time": T, "signals": block}))
    assert {*table.columns} == {"Time", "signals.1", "signals.2"} and table.units == {"Time": "s"}


def test_a_record_of_two_samples_has_vectors(tmp_path):
    assert len(read(tmp_path, "a.mat", matlab(t_s=T[:2], u_V=U[:2])).columns) == 2


def compressed(order, size, variables=1):
    """MATLAB file of vectors of zeros that are packed, with the order of bytes "<" or ">"."""
    packed = zlib.compress(bytes(size))
    head = b"MATLAB 5.0 MAT-file".ljust(124) + (b"\0\1IM" if order == "<" else b"\1\0MI")
    return head + variables * (struct.pack(f"{order}II", 15, len(packed)) + packed)


@pytest.mark.parametrize("order", ["<", ">"])
def test_of_a_matlab_file_no_more_is_unpacked_than_the_limit(tmp_path, monkeypatch, order):
    monkeypatch.setattr(formats, "LARGEST_FILE", 1_000_000)
    for variables, size in ((1, 8_000_000), (20, 100_000)):
        said = refusal(tmp_path, "a.mat", compressed(order, size, variables))
        total = int(said.split()[1])
        assert 1_000_000 < total < 1_000_000 + formats.CHUNK + 10_000
        assert said == f"a.mat: {total} bytes when unpacked: must be at most 1000000"


def test_a_matlab_file_of_version_4_is_as_large_as_it_is(tmp_path):
    """Its numbers may look like a packed variable of version 5."""
    file = tmp_path / "a.mat"
    file.write_bytes(bytes(128) + struct.pack(">II", 15, 8) + b"no zlib!")
    assert formats._unpacked_size(file) == 144


def test_a_packed_text_may_be_as_long_as_the_limit(tmp_path, monkeypatch):
    text = b"t_s,u_V\n" + b"0,1\n" * 248
    monkeypatch.setattr(formats, "LARGEST_FILE", len(text))
    assert len(read(tmp_path, "a.csv.gz", gzip.compress(text)).columns) == 248
    said = refusal(tmp_path, "a.csv.gz", gzip.compress(text + b"0,1\n" * 100))
    assert said == f"a.csv.gz: {len(text) + 1} bytes or more when unpacked: must be at most {len(text)}"


def test_a_long_reason_of_a_library_is_shortened(tmp_path, monkeypatch):
    def fails(*_, **__):
        raise ValueError("b" * 190 + "e" * 60)

    monkeypatch.setattr("scipy.io.loadmat", fails)
    assert refusal(tmp_path, "a.mat") == f"a.mat: not a readable MATLAB file ({'b' * 180}...{'e' * 17})"


def workbook(rows, largest=None):
    """Module in place of openpyxl: a workbook whose cells hold formulas and the values saved with them."""

    class Sheet:
        max_row = largest

        def iter_rows(self, values_only=False):
            cells = [[SimpleNamespace(value=value) for value in row] for row in rows]
            return rows if values_only else cells

    class Formulas(Sheet):
        def iter_rows(self, values_only=False):
            return [[f"=A{k}" for k in range(len(row))] for row in rows]

    def load_workbook(path, read_only=False, data_only=False):
        assert read_only  # a large sheet does not fit into memory
        return SimpleNamespace(worksheets=[Sheet() if data_only else Formulas(), SimpleNamespace(max_row=1)])

    return SimpleNamespace(load_workbook=load_workbook)


SHEET = [("t_s", "u_V", "remark"), (0.0, 1.5, None), (0.002, 2.5, None), (0.004, 3.5, "end")]


@pytest.mark.parametrize("largest", [None, 4, 2_000_000])
def test_of_a_workbook_with_formulas_their_values_are_read(tmp_path, monkeypatch, largest):
    monkeypatch.setitem(sys.modules, "openpyxl", workbook(SHEET, largest))
    table = read(tmp_path, "a.xlsx").columns
    assert table["t_s"].tolist() == ["0.0", "0.002", "0.004"]
    assert table["u_V"].tolist() == ["1.5", "2.5", "3.5"] and table["remark"].tolist() == ["", "", "end"]


def test_a_workbook_that_is_damaged_or_too_long_is_refused(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "openpyxl", workbook(SHEET, 2_000_001))
    assert refusal(tmp_path, "a.xlsx") == "a.xlsx: 2000001 rows: must be at most 2000000"

    def damaged(*_, **__):
        raise zipfile.BadZipFile("File is not a zip file")

    monkeypatch.setitem(sys.modules, "openpyxl", SimpleNamespace(load_workbook=damaged))
    assert refusal(tmp_path, "a.xlsx") == "a.xlsx: not a readable Excel file (File is not a zip file)"


class Channel(np.ndarray):
    """Channel of a .tdms file: an array with a name and properties."""

    def time_track(self):
        return self.properties["wf_increment"] * np.arange(len(self))


def channel(name, values, **properties):
    made = np.asarray(values).view(Channel)
    made.name, made.properties = name, properties
    return made


def tdms(*groups):
    """Module in place of nptdms, for a file with these groups of channels."""
    file = SimpleNamespace(groups=lambda: [SimpleNamespace(channels=lambda g=group: g) for group in groups])
    return SimpleNamespace(TdmsFile=SimpleNamespace(open=lambda path: nullcontext(file)))


def test_channels_of_all_groups_have_their_units_and_the_time_of_a_waveform(tmp_path, monkeypatch):
    u = channel("u", U, unit_string="V", wf_increment=2e-3)
    x = channel("x", T, unit_string="mm")
    monkeypatch.setitem(sys.modules, "nptdms", tdms([u], [x, channel("room", np.zeros(7))]))
    table = read(tmp_path, "a.tdms")
    assert {*table.columns} == {"Time", "u", "x"} and table.units["room"] == ""
    assert {name: table.units[name] for name in table.columns} == {"Time": "s", "u": "V", "x": "mm"}
    np.testing.assert_array_equal(table.columns["Time"], T)
    monkeypatch.setitem(sys.modules, "nptdms", tdms([x]))
    assert list(read(tmp_path, "a.tdms").columns) == ["x"]
    monkeypatch.setitem(sys.modules, "nptdms", tdms([channel("u", [1.0])]))
    assert refusal(tmp_path, "a.tdms").startswith("a.tdms: holds no vectors of numbers")


class Dataset:
    """Dataset of an HDF5 file."""

    def __init__(self, values):
        self.values = np.asarray(values)
        self.dtype, self.size = self.values.dtype, self.values.size

    def __getitem__(self, key):
        assert key == ()
        return self.values


def hdf5(items):
    """Module in place of h5py, for a file with these datasets and groups by path."""

    def visititems(visit):
        for name, item in items.items():
            visit(name, item)

    return SimpleNamespace(
        Dataset=Dataset, File=lambda path: nullcontext(SimpleNamespace(visititems=visititems))
    )


MATLAB_73 = b"MATLAB 7.3 MAT-file".ljust(600)


@pytest.mark.parametrize(("time", "units"), [("time", {"time": "s"}), ("t_s", {})])
def test_of_matlab_s_hdf5_numbers_are_read_from_any_group(tmp_path, monkeypatch, time, units):
    items = {
        f"bench/log/{time}": Dataset(T[None]),
        "bench": SimpleNamespace(size=ROWS, dtype=np.dtype(float)),  # a group
        "u_V": Dataset(U[:, None]),
        "gain": Dataset([[2.0]]),
        "#refs#/a": Dataset(T),
        "note": Dataset(np.array(["a"] * ROWS, dtype="S1")),
    }
    monkeypatch.setitem(sys.modules, "h5py", hdf5(items))
    table = read(tmp_path, "a.mat", MATLAB_73)
    assert list(table.columns) == [time, "u_V"] and table.units == units
    np.testing.assert_array_equal(table.columns["u_V"], U)


def test_a_matrix_of_matlab_s_hdf5_has_at_most_all_columns_of_all_rows(tmp_path, monkeypatch):
    monkeypatch.setattr(formats, "MOST_ROWS", 30)
    monkeypatch.setattr(formats, "MOST_COLUMNS", 4)
    monkeypatch.setitem(sys.modules, "h5py", hdf5({"log": Dataset(np.zeros((30, 4)))}))
    assert read(tmp_path, "a.mat", MATLAB_73).columns.shape == (30, 4)
    monkeypatch.setitem(sys.modules, "h5py", hdf5({"log": Dataset(np.zeros((11, 11)))}))
    assert refusal(tmp_path, "a.mat", MATLAB_73) == "a.mat: 121 numbers in a matrix: must be at most 120"


def test_an_mdf_file_has_times_from_its_begin(tmp_path, monkeypatch):
    def to_dataframe(time_from_zero=False):
        t = T + (0.0 if time_from_zero else 1.7e9)
        return pd.DataFrame({"u": U}, index=pd.Index(t, name="timestamps"))

    file = SimpleNamespace(
        iter_channels=lambda: [SimpleNamespace(name="u", unit="V")], to_dataframe=to_dataframe
    )
    monkeypatch.setitem(sys.modules, "asammdf", SimpleNamespace(MDF=lambda path: nullcontext(file)))
    table = read(tmp_path, "a.mf4")
    assert {*table.columns} == {"Time", "u"} and table.units == {"Time": "s", "u": "V"}
    np.testing.assert_array_equal(table.columns["Time"], T)
    np.testing.assert_array_equal(table.columns["u"], U)
