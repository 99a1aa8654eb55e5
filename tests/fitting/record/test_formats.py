"""Every format gives the same record and the same estimates; limits; a remedy for what is not read."""

import gzip
import io
import os
import struct
import subprocess
import sys
import zlib
from functools import cache
from pathlib import Path

import netCDF4
import numpy as np
import pandas as pd
import pytest
import written_records as written
import xarray as xr

import pneumo
from pneumo.errors import InputError
from pneumo.fitting.record import formats
from pneumo.fitting.record.columns import Column
from pneumo.fitting.record.measurement import read_measurement


def read(tmp_path, name, content, **options):
    pytest.importorskip(written.LIBRARIES.get(Path(name).suffix, "numpy"))
    file = tmp_path / name
    file.write_bytes(content.encode() if isinstance(content, str) else content)
    return read_measurement(file, written.plant(), **options)


def refusal(tmp_path, name, content, **options):
    with pytest.raises(InputError) as caught:
        read(tmp_path, name, content, **options)
    text = str(caught.value)
    assert "\n" not in text
    return text.replace(f"{tmp_path}/", "")


def same(found, expected, rows):
    # Text has every digit; a unit is converted with one rounding or two, and time in ms is rounded first.
    assert found.period == pytest.approx(written.PERIOD, rel=1e-12)
    np.testing.assert_allclose(found.u, expected["u"][rows], rtol=1e-13)
    np.testing.assert_allclose(1e3 * found.x, expected["x"][rows], rtol=1e-13, atol=1e-12)
    for P, name in zip(found.P, ("P_A", "P_B"), strict=True):
        np.testing.assert_allclose(P / 1e5, expected[name][rows], rtol=1e-14)


@cache
def estimates(content):
    """Estimates of M1, from a record with these bytes of its signals."""
    table = pd.DataFrame(
        np.frombuffer(content).reshape(-1, 5), columns=["t_s", "u_V", "x_m", "P_A_Pa", "P_B_Pa"]
    )
    return pneumo.fit(table, written.CONFIGURATION, written.CYLINDER, models=["M1"], trust=True).estimates


@pytest.mark.parametrize("kind", written.COMMON)
def test_every_format_gives_the_same_record_and_estimates(tmp_path, kind):
    found = read(tmp_path, *written.content(kind))
    assert found.notes == () and found.events == ()
    same(found, written.truth(), slice(None))

    def signals(u, x, P_A, P_B):
        return np.column_stack([found.t, u, x, P_A, P_B]).tobytes()

    of = written.truth()
    expected = estimates(signals(of["u"], of["x"] / 1e3, 1e5 * of["P_A"], 1e5 * of["P_B"]))["value"]
    values = estimates(signals(found.u, found.x, *found.P))["value"]
    np.testing.assert_allclose(values["M1"], expected["M1"], rtol=1e-8)
    # A search ends within its tolerance, wherever the last digit of a signal sends it.
    np.testing.assert_allclose(values, expected, rtol=1e-6)


@pytest.mark.parametrize("kind", written.RATES)
def test_a_slow_command_is_held_on_the_grid_of_the_sensors_within_its_own_span(tmp_path, kind):
    found = read(tmp_path, *written.content(f"two rates: {kind}"))
    last = written.ROWS - written.SLOW + 1  # the command's last sample
    if kind == "PlotJuggler":  # pressures are 0.3 ms late: interpolated to the times of x
        of = written.truth()
        np.testing.assert_array_equal(found.u, of["u"][1:last])
        np.testing.assert_allclose(1e3 * found.x, of["x"][1:last], rtol=1e-13, atol=1e-12)
        late = np.interp(written.TIME[1:last], written.TIME + 3e-4, of["P_A"])
        np.testing.assert_allclose(found.P[0] / 1e5, late, rtol=1e-9)
    else:
        same(found, written.truth(), slice(0, last))
    assert "u: 50 Hz, held, resampled to 500 Hz" in found.notes
    assert any(note.startswith("all signals together last 0.7") for note in found.notes)
    assert found.channels[0].startswith("u: column ") and ", 50 Hz, held: " in found.channels[0]


def test_a_file_says_what_holds_between_samples(tmp_path):
    linear = written.inspector().replace("zoh", "linear")
    found = read(tmp_path, "a.csv", linear)
    t, u = written.slow("u")
    np.testing.assert_allclose(found.u, np.interp(found.t, t, u), rtol=1e-12)
    assert "u: 50 Hz, interpolated, resampled to 500 Hz" in found.notes


def test_tables_in_memory_are_read_as_files(tmp_path):
    table = written.frame()
    stamps = pd.Timestamp("2024-10-27T02:59:59.9+02:00") + pd.to_timedelta(written.TIME, unit="s")
    dataset = xr.Dataset({name: ("row", values) for name, values in table.items()})
    dataset["T_K"] = 290.0  # no signal
    durations = table.drop(columns="t_s").set_index(pd.to_timedelta(written.TIME, unit="s"))
    berlin = [stamp.isoformat() for stamp in stamps.tz_convert("Europe/Berlin")]  # clocks are put back
    for source in (
        table,
        table.set_index("t_s"),
        dataset,
        durations,
        table.assign(t_s=stamps),
        table.assign(t_s=berlin),
    ):
        same(read_measurement(source, written.plant()), written.truth(), slice(None))
    named = {"t": "clock", "u": "c1", "x": "log.2", "P_A": "c3", "P_B": "c4"}
    mapping = {q: Column(column=name, unit={"t": "s", **written.UNITS}[q]) for q, name in named.items()}
    text = "a bench\n\n" + ";".join(named.values()) + "\n" + written.rows(sep=";")
    same(read(tmp_path, "a.csv", text, mapping=mapping), written.truth(), slice(None))


def test_columns_of_a_matrix_have_numbers_and_its_longer_side_is_time(tmp_path):
    units = {"t": "s", **written.UNITS}
    mapping = {q: Column(column=f"log.{k}", unit=unit) for k, (q, unit) in enumerate(units.items(), start=1)}
    log = np.column_stack([written.TIME, *written.truth().values()])
    for matrix in (log, log.T):
        content = written.matlab(
            {"log": matrix, "gain": 2.0, "limits": np.arange(5.0), "cube": np.zeros((2, 9, 2))}
        )
        same(read(tmp_path, "a.mat", content, mapping=mapping), written.truth(), slice(None))


def test_of_a_workbook_the_first_sheet_is_read(tmp_path):
    pytest.importorskip("openpyxl")

    def write(file):
        with pd.ExcelWriter(file, engine="openpyxl") as book:
            written.frame().to_excel(book, sheet_name="record", index=False)
            pd.DataFrame({"a remark": ["bench 3"]}).to_excel(book, sheet_name="remarks", index=False)

    same(read(tmp_path, "a.xlsx", written.in_memory(write)), written.truth(), slice(None))


def test_a_channel_without_a_time_of_its_length_is_named(tmp_path):
    signals = {f"{n}_{written.UNITS[n]}": v for n, v in written.truth().items()}
    content = written.matlab({"t_s": written.TIME} | signals | {"u_V": written.truth()["u"][::2]})
    assert "no column u" in refusal(tmp_path, "a.mat", content)


REFUSED = {
    "no vectors": ("a.mat", lambda: written.matlab({"gain": 2.0}), ["no vectors", "P_A_kPa"]),
    "damaged": ("a.mat", b"MATLAB 5.0 MAT-file".ljust(200, b"?"), ["not a readable MATLAB file"]),
    "an old sheet": ("a.xls", b"PK", ["save the sheet as CSV"]),
    "NumPy": ("a.npz", b"PK", ["CSV or Parquet"]),
    "ControlDesk's own": ("a.idf", b"IDF", ["ControlDesk as CSV or .mat"]),
    "binary": ("a.dat", bytes(range(256)), ["not a text file", "CSV"]),
    "empty": ("a.csv", b"", ["no numbers", "CSV"]),
    "no names": ("a.csv", lambda: written.rows().encode(), ["no row of 5 names", "P_A_kPa"]),
    "decimal commas between commas": (
        "a.csv",
        b"t_s,u_V,x_mm\n0,001,1,3,10,5\n0,002,1,4,10,6\n",
        ["no row of 6 names", "one has 3", "semicolons"],
    ),
    "no folder": ("b/../missing/a.csv", None, ["no such file"]),
    "wide": (
        "a.csv",
        b",".join([b"c"] * 201) + b"\n" + b",".join([b"1"] * 201),
        ["201 columns", "at most 200"],
    ),
    "late": ("a.csv", b"# a bench\n" * 201 + b"t_s,u_V\n0,1\n", ["within the first 200 lines"]),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_is_refused_is_one_line_with_the_remedy(tmp_path, kind):
    name, content, words = REFUSED[kind]
    if content is None:
        with pytest.raises(InputError, match=words[0]):
            read_measurement(tmp_path / name, written.plant())
    else:
        text = refusal(tmp_path, name, content() if callable(content) else content)
        assert all(word in text for word in [name, *words]), text


def test_every_format_is_tested():
    files = [*written.COMMON.values(), *written.RATES.values(), *REFUSED.values()]
    suffixes = {Path(name).suffix for name, *_ in files}
    assert all(not form.suffixes or suffixes & {*form.suffixes} for form in formats.FORMATS)


@pytest.mark.parametrize(("suffix", "package"), [*written.LIBRARIES.items(), (".mat", "h5py")])
def test_a_missing_library_is_named_with_the_remedy(tmp_path, monkeypatch, suffix, package):
    for module in (package, f"{package}.parquet", f"{package}.feather"):
        monkeypatch.setitem(sys.modules, module, None)
    file = tmp_path / f"a{suffix}"
    file.write_bytes(b"MATLAB 7.3 MAT-file".ljust(600))
    form = next(form for form in formats.FORMATS if suffix in form.suffixes)
    with pytest.raises(InputError, match=rf"pip install 'pneumo\[formats\]' \(here {package}\)"):
        form.read(file)


def test_the_formats_are_listed_without_loading_a_library():
    """The command's help lists them; pandas and xarray would take it a second."""
    code = "import sys, pneumo.fitting.record.formats; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"pandas", "xarray", "netCDF4", "scipy"} & {*run.stdout.split()}


def packed_matlab(order, size, variables=1):
    """MATLAB file of vectors of zeros that are packed, with the order of bytes "<" or ">"."""
    packed = zlib.compress(bytes(size))
    head = b"MATLAB 5.0 MAT-file".ljust(124) + (b"\0\1IM" if order == "<" else b"\1\0MI")
    return head + variables * (struct.pack(f"{order}II", 15, len(packed)) + packed)


BOMBS = {  # small files that would fill the memory
    "MATLAB, little-endian": ("a.mat", lambda: packed_matlab("<", 300_000_000), "bytes when unpacked"),
    "MATLAB, big-endian": ("a.mat", lambda: packed_matlab(">", 50_000_000, 5), "bytes when unpacked"),
    "text": ("a.csv.gz", lambda: gzip.compress(bytes(210_000_000), 1), "bytes or more when unpacked"),
}


@pytest.mark.parametrize("kind", BOMBS)
def test_of_a_packed_file_no_more_is_unpacked_than_the_limit(tmp_path, kind):
    name, content, words = BOMBS[kind]
    assert words in refusal(tmp_path, name, content())


def test_endless_and_huge_files_are_refused_before_they_are_read(tmp_path):
    with pytest.raises(InputError, match="not a regular file"):
        read_measurement(Path("/dev/zero"), written.plant())
    large = tmp_path / "large.csv"
    large.touch()
    os.truncate(large, 10**12)  # a terabyte of holes
    with pytest.raises(InputError, match="too large: at most 200000000 bytes"):
        read_measurement(large, written.plant())
    for name in ("dimension", "variables"):
        with netCDF4.Dataset(tmp_path / f"{name}.nc", "w") as file:
            if name == "dimension":
                file.createDimension("t", 300_000_000)
                file.createVariable("t", "f8", ("t",), zlib=True)
            for i in range(300 if name == "variables" else 0):
                file.createVariable(f"v{i}", "f8")
    with pytest.raises(InputError, match=r"300000000 samples along t: must be at most 2000000"):
        read_measurement(tmp_path / "dimension.nc", written.plant())
    with pytest.raises(InputError, match=r"300 variables: must be at most 200"):
        read_measurement(tmp_path / "variables.nc", written.plant())
    rows = io.BytesIO(b"t_s,u_V\n" + b"0,0\n" * 2_000_001)
    assert "2000001 rows or more: must be at most 2000000" in refusal(tmp_path, "long.csv", rows.getvalue())
