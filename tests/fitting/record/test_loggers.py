"""Files of oscilloscopes, serial monitors and odd clocks give the record that they were made from.

By hand, after the makers' documentation and files in public bug reports: Keysight (InfiniiVision's CSV),
Tektronix (MSO 4), Rigol (MSO5000, DS1000Z), Siglent (SDS), LeCroy (HDO), Yokogawa (DL850), PicoScope's text;
PicoScope's MAT by SciPy; Arduino's serial monitor and plotter. No file was written by an instrument.
"""

import re

import numpy as np
import openpyxl
import pytest
import test_formats
import written_records as written
from scipy.io import savemat

from pneumo import simulate
from pneumo.errors import InputError
from pneumo.fitting.record.measurement import read_measurement

in_this_process = test_formats.in_this_process
TIME, ROWS = written.TIME, written.ROWS
MICRO = np.round(1e6 * TIME).astype(int)
SIGNALS = list(written.truth().values())
HEADER = ",".join(f"{name}_{unit}" for name, unit in written.UNITS.items())


def table(time=None, sign=",", after="", before=""):
    """Lines of a record, with a first column if there is one for the time."""
    columns = [*([] if time is None else [time]), *SIGNALS]
    return "".join(before + sign.join(map(str, row)) + after + "\n" for row in zip(*columns, strict=True))


def clock_texts(first):
    """Times of day, in ms; `first` is that of the first sample."""
    ms = (first + np.round(1e3 * TIME).astype(int)) % 86_400_000
    return [f"{m // 3_600_000:02d}:{m // 60_000 % 60:02d}:{m % 60_000 / 1e3:06.3f}" for m in ms]


def pairs():
    names = ["t_us", *HEADER.split(",")]
    rows = zip(MICRO, *SIGNALS, strict=True)
    return "".join(",".join(f"{n}:{v}" for n, v in zip(names, row, strict=True)) + "\n" for row in rows)


def monitor(text):
    return "".join(
        f"{at} -> {line}\n" for at, line in zip(clock_texts(36_000_000), text.splitlines(), strict=True)
    )


TEKTRONIX = """Model,MSO44
Firmware Version,1.0

Waveform Type,ANALOG,,,,
Horizontal Units,s,,,,
Sample Interval,0.002,,,,
Vertical Units,V,V,V,V
Vertical Offset,0,0,0,0
,,,,
Label,rCmd,rPos,rPA,rPB
TIME,CH1,CH2,CH3,CH4
"""
YOKOGAWA = '"Model","DL850"\n"TraceName ","rCmd","rPos","rPA","rPB"\n"BlockSize",400,400,400,400\n'
YOKOGAWA += (
    '"VUnit ","V","V","V","V"\n"HResolution",2.0E-03,2.0E-03,2.0E-03,2.0E-03\n"HUnit","s","s","s","s"\n\n'
)
SIGLENT = (
    "Record Length,Analog:400\nSample Interval,2E-3\nSource,CH1,CH2,CH3,CH4\nSecond,Volt,Volt,Volt,Volt\n"
)
LECROY = "LECROYHDO4024,12345,Waveform\nSegments,1,SegmentSize,400\n#1,13-May-2024 10:00:00,0\n"
CHANNELS = {  # oscilloscopes: the text, the names of the four channels
    "Keysight": ("x-axis,1,2,3,4\nsecond,Volt,Volt,Volt,Volt\n" + table(TIME - 0.1), "1 2 3 4"),
    "Keysight without units": ("x-axis,1,2,3,4\n" + table(TIME - 0.1), "1 2 3 4"),
    "Tektronix": (TEKTRONIX + table(TIME - 0.1), "rCmd rPos rPA rPB"),
    "Tektronix, by channels": (TEKTRONIX + table(TIME - 0.1), "CH1 CH2 CH3 CH4"),
    "Rigol": (
        "Time(s),CH1(V),CH2(V),CH3(V),CH4(V),t0 = -1.0e-01, tInc = 2.0e-03,\n"
        + table(before=",", after=",,"),
        "CH1(V) CH2(V) CH3(V) CH4(V)",
    ),
    "Rigol, by number": (
        "X,CH1,CH2,CH3,CH4,Start,Increment\nSequence,Volt,Volt,Volt,Volt,-1.0e-01,2.0e-03\n"
        + table(np.arange(ROWS), after=","),
        "CH1 CH2 CH3 CH4",
    ),
    "Siglent": (SIGLENT + table(TIME - 0.1), "CH1 CH2 CH3 CH4"),
    "LeCroy": (LECROY + "Time,Ampl1,Ampl2,Ampl3,Ampl4\n" + table(TIME - 0.1), "Ampl1 Ampl2 Ampl3 Ampl4"),
    "Yokogawa": (YOKOGAWA + table(before=","), "rCmd rPos rPA rPB"),
    "PicoScope": (
        "Time,Channel A,Channel B,Channel C,Channel D\n(ms),(V),(V),(V),(V)\n\n" + table(1e3 * TIME - 100),
        "Channel A|Channel B|Channel C|Channel D",
    ),
}


def mapping_of(names, time=""):
    """Mapping of four channels, and of a column of time that has no unit."""
    names = names.split("|" if "|" in names else " ") if names else []
    mapping = {q: {"column": n, "unit": u} for (q, u), n in zip(written.UNITS.items(), names, strict=False)}
    return mapping | ({"t": {"column": time, "unit": "s"}} if time else {})


MAPPINGS = {maker: mapping_of(names, "Time" * (maker == "LeCroy")) for maker, (_, names) in CHANNELS.items()}


@pytest.mark.parametrize("maker", CHANNELS)
def test_an_oscilloscope_is_read_by_the_names_of_its_channels(tmp_path, maker):
    text, mapping = CHANNELS[maker][0], MAPPINGS[maker]
    found = test_formats.read(tmp_path, "a.csv", text, mapping=mapping)
    assert found.period == pytest.approx(written.PERIOD, rel=1e-9)
    test_formats.same(found._replace(period=written.PERIOD), written.truth())
    with pytest.raises(InputError) as caught:
        test_formats.read(tmp_path, "a.csv", text)
    proposed = re.search(r"--columns '(.*)'$", str(caught.value))
    assert proposed and "?" not in proposed[1]
    assert len(test_formats.read(tmp_path, "a.csv", text, mapping=proposed[1]).u) == ROWS


COUNTER = "t_us," + HEADER + "\n"
CLOCKS = {  # text and what is noted
    "serial monitor": ((COUNTER + monitor(table(MICRO))), "columns not used: Time"),
    "serial monitor without a counter": (HEADER + "\n" + monitor(table()), ""),
    "pairs": (pairs(), ""),
    "pairs behind stamps": (monitor(pairs()), "columns not used: Time"),
    "blanks before quotes": ('"t_us", "' + HEADER.replace(",", '", "') + '"\n' + table(MICRO, ", "), ""),
    "2^32": (COUNTER + table((2**32 - 300_000 + MICRO) % 2**32), "begins anew after 2^32"),
    "2^16": (COUNTER.replace("us", "ms") + table((65_300 + MICRO // 1000) % 2**16), "begins anew after 2^16"),
    "2^32 us in seconds": (
        COUNTER.replace("us", "s") + table((2**32 - 300_000 + MICRO) % 2**32 / 1e6),
        "begins anew after 2^32 us",
    ),
    "midnight": ("Time," + HEADER + "\n" + table(clock_texts(86_399_700)), "begins anew after 24 h"),
    "minutes of Excel": (
        "Time," + HEADER + "\n" + table([text[3:] for text in clock_texts(3_599_700)]),
        "begins anew after 1 h",
    ),
    "ms of a date": (
        "timestamp," + HEADER + "\n" + table(1_715_594_400_000 + MICRO // 1000),
        "read as milliseconds of a date",
    ),
    "days of Excel": (
        "Time," + HEADER + "\n" + table(45425.4 + TIME / 86400),
        "no unit, read as days of Excel",
    ),
    "coarse stamps": (
        "Time," + HEADER + "\n" + table([text[:-2] for text in clock_texts(36_000_000)]),
        "stamps repeat for 50 samples each: taken as uniform",
    ),
    "a rate above": ("# bench\nSample rate: 500 Hz\n" + HEADER + "\n" + table(), "a sample every 0.002 s"),
}


@pytest.mark.parametrize("kind", CLOCKS)
def test_an_odd_clock_is_read_and_noted(tmp_path, kind):
    text, noted = CLOCKS[kind]
    found = test_formats.read(tmp_path, "a.csv", text)
    assert found.period == pytest.approx(written.PERIOD, rel=2e-5)  # of stamps, the regression's
    test_formats.same(found._replace(period=written.PERIOD), written.truth())
    notes = [note for note in found.notes if "uniform grid" not in note]
    assert len(notes) == bool(noted) and all(noted in note for note in notes)


@pytest.mark.parametrize("kind", ["serial monitor", "pairs", "pairs behind stamps", "a rate above"])
def test_a_wrong_cell_is_named_by_its_line_in_the_file(tmp_path, kind):
    lines = CLOCKS[kind][0].splitlines()
    lines[199] = lines[199][:-3] + "o.1"
    with pytest.raises(InputError, match=r"line 200, column P_B: '5\.\d+o\.1'"):
        test_formats.read(tmp_path, "a.csv", "\n".join(lines))


def test_a_clock_that_begins_anew_for_another_reason_is_refused(tmp_path):
    for broken in (MICRO % 400_000, (2**32 - 300_000 + MICRO + 50_000 * (MICRO > 300_000)) % 2**32):
        with pytest.raises(InputError, match=r"time of \w must increase|has a gap"):
            test_formats.read(tmp_path, "a.csv", COUNTER + table(broken))


u, x, P_A, P_B = SIGNALS
AXIS = {"u_V": u, "x_mm": x, "P_A_bar": P_A, "P_B_bar": P_B}
MATLAB = {  # variables, and names of the four signals where the file does not say what they are
    "PicoScope": (
        {"Tstart": -0.1, "Tinterval": 2e-3, "Length": ROWS, "A": u, "B": x, "C": P_A, "D": P_B},
        "A B C D",
    ),
    "a step in a struct": ({"log": {"StepSize": 2e-3, **AXIS}}, ""),
    "a struct for each signal": (
        {name: {"t": TIME, "y": signal} for name, signal in written.truth().items()},
        "u x P_A P_B",
    ),
    "two axes": (
        {"Ts": 2e-3, "left": AXIS, "right": {name: signal[::-1] for name, signal in AXIS.items()}},
        "left.u_V left.x_mm left.P_A_bar left.P_B_bar",
    ),
}


@pytest.mark.parametrize("kind", MATLAB)
def test_a_matlab_file_has_its_names_and_its_step(tmp_path, kind):
    variables, names = MATLAB[kind]
    mapping = mapping_of(names, "t" * (kind == "a struct for each signal"))
    savemat(tmp_path / "a.mat", variables)
    found = read_measurement(tmp_path / "a.mat", written.plant(), mapping or None)
    test_formats.same(found, written.truth())


def test_rows_that_share_a_stamp_by_channel_are_not_spread(tmp_path):
    """Each row has the samples of one topic; a command is logged where it changes."""
    lines = []
    for k, at in enumerate(MICRO):
        lines += [f"{at},{u[k] if k % 50 == 0 else ''},{x[k]},,", f"{at},,,{P_A[k]},{P_B[k]}"]
    found = test_formats.read(tmp_path, "a.csv", COUNTER + "\n".join(lines) + "\n")
    test_formats.same(found, written.truth() | {"u": found.u})
    assert not any("uniform" in note for note in found.notes)


def test_what_simulate_writes_is_read(tmp_path, monkeypatch):
    monkeypatch.undo()  # by a process of its own, as users' files are
    run = simulate(written.plant(), written.PERIOD, command=u)
    run.to_xarray().to_netcdf(tmp_path / "run.nc")
    run.to_table().to_csv(tmp_path / "run.csv", index=False)
    for source in (run.to_xarray(), tmp_path / "run.nc", tmp_path / "run.csv"):
        found = read_measurement(source, written.plant())
        np.testing.assert_allclose(found.P, [run.P_A, run.P_B], rtol=1e-12)
        np.testing.assert_allclose(found.x, run.x, atol=1e-15)
    two = simulate(written.plant(), written.PERIOD, command=np.stack([u, -u], axis=1))
    for source in (two.to_xarray(), two.to_table()):
        with pytest.raises(InputError, match="column u_B: a record of a valve for each chamber"):
            read_measurement(source, written.plant())


def test_a_command_logged_where_it_changes_holds_to_the_end(tmp_path):
    step = np.where(TIME < 0.1, 1.5, -1.0)
    logged = ["1.5" if k == 0 else "-1.0" if k == 50 else "" for k in range(ROWS)]
    text = COUNTER + "".join(
        ",".join(map(str, row)) + "\n" for row in zip(MICRO, logged, x, P_A, P_B, strict=True)
    )
    found = test_formats.read(tmp_path, "a.csv", text)
    np.testing.assert_array_equal(found.u, step)
    assert "column u: its last value, at 0.1 s, is held to the end at 0.798 s" in found.notes


SPREADSHEET = ["#N/A", "1.#QNAN", "-nan(ind)", "∞", "-Infinity", "9.9E+37", "NaN", "OL", "#DIV/0!"]


@pytest.mark.parametrize("word", SPREADSHEET)
def test_what_stands_for_no_number_is_missing(tmp_path, word):
    cells = [*map(str, P_A)]
    cells[100] = word
    rows = zip(MICRO, u, x, cells, P_B, strict=True)
    text = COUNTER + "".join(",".join(map(str, row)) + "\n" for row in rows)
    found = test_formats.read(tmp_path, "a.csv", text)
    assert "column P_A: 1 of 400 samples missing, interpolated" in found.notes
    assert found.P[0, 100] / 1e5 == pytest.approx((P_A[99] + P_A[101]) / 2)


@pytest.mark.parametrize(("name", "value"), [("P_A", 0.0), ("P_A", 655.35), ("x", -2000.0)])
def test_a_drop_out_is_called_one(tmp_path, name, value):
    changed = {key: signal.copy() for key, signal in written.truth().items()}
    changed[name][[100, 200]] = value
    rows = zip(MICRO, *changed.values(), strict=True)
    text = COUNTER + "".join(",".join(map(str, row)) + "\n" for row in rows)
    with pytest.raises(
        InputError, match=f"line 102, column {name} .*2 of 400 samples are not plausible"
    ) as caught:
        test_formats.read(tmp_path, "a.csv", text)
    assert "a factor of 1)" not in str(caught.value)


def test_wide_tables_are_refused_at_once(tmp_path):
    wide = (",".join(f"c{k}" for k in range(100_000)) + "\n") + (",".join(["1.5"] * 100_000) + "\n") * 3
    with pytest.raises(InputError, match="100000 columns: must be at most 2000"):
        test_formats.read(tmp_path, "a.csv", wide)
    book = openpyxl.Workbook(write_only=True)
    sheet = book.create_sheet()
    for _ in range(3):
        sheet.append([1.5] * 3000)
    book.save(tmp_path / "wide.xlsx")
    with pytest.raises(InputError, match="3000 columns: must be at most 2000"):
        read_measurement(tmp_path / "wide.xlsx", written.plant())
    sparse = openpyxl.Workbook()
    sparse.worksheets[0].cell(1_048_576, 100, 1.5)  # 10^8 empty cells in a few kB
    sparse.save(tmp_path / "sparse.xlsx")
    with pytest.raises(InputError, match="cells: must be at most 3000000"):
        read_measurement(tmp_path / "sparse.xlsx", written.plant())
