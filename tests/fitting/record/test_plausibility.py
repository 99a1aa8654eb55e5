"""What a record's numbers say of mistakes in it: lines of text files, bounds, notes and events."""

import numpy as np
import pandas as pd
import pytest
import written_records as written

from pneumo.errors import InputError
from pneumo.fitting.record.measurement import read_measurement
from pneumo.fitting.record.text import GROUPED, read_text

PERIOD, ROWS, T = written.PERIOD, written.ROWS, written.TIME
HALF = 0.5 * written.plant().cylinder.stroke
C = written.plant().conditions


def table(**changes):
    """Record of a piston in half of its stroke, in SI units, with other columns under their names."""
    wave = np.sin(20 * T)
    P = (C.P_atm + C.P_s) / 2 + 0.4 * (C.P_s - C.P_atm) * wave
    columns = {"t_s": T, "u_V": np.cos(20 * T), "x_m": 0.5 * HALF * wave, "P_A_Pa": P, "P_B_Pa": P[::-1]}
    for name, values in changes.items():
        old = next((key for key in columns if key.rpartition("_")[0] == name.rpartition("_")[0]), name)
        columns = {
            name if key == old else key: values if key == old else kept for key, kept in columns.items()
        }
        columns.setdefault(name, values)
    return pd.DataFrame(columns)


def at(rows, value, name="x_m"):
    changed = table().astype(object)
    changed.loc[rows, name] = value
    return changed


def read(frame, tmp_path, **options):
    file = tmp_path / "m.csv"
    frame.to_csv(file, index=False)
    return read_measurement(file, written.plant(), **options)


X, P = table()["x_m"].to_numpy(), table()["P_A_Pa"].to_numpy()
LOW = C.P_atm + 0.1 * (C.P_s - C.P_atm) * (1 + 0.1 * np.sin(20 * T))
SIGNALS = ("u", "x", "P_A", "P_B")
REFUSED = [
    (lambda: table().drop(columns=["x_m"]), ["no column x", "columns: t_s, u_V, P_A_Pa"]),
    (lambda: table().drop(columns=["u_V"]), ["no column u", "--closed both"]),
    (lambda: at([17, 20, 30], "off"), ["line 19, column x", "'off': must be a finite number", "and 2 more"]),
    (lambda: at(5, "", "t_s"), ["line 7, column t: 'empty': must"]),
    (lambda: at(slice(17, 20), ""), ["line 23, column t", "x has a gap", "cut the file"]),
    (lambda: at(slice(0, None, 9), "nan"), ["column x", "at most 1 %"]),
    (lambda: at(50, T[49], "t_s"), ["line 52, column t", "must increase"]),
    (lambda: table(t_s=T + (np.arange(ROWS) > 99)), ["line 102, column t: '1.2'", "gap, of up to 1.002 s"]),
    (lambda: table(t_s=1e3 * T), ["2 s apart: must be 1e-05 to 0.1 s; is t in ms?"]),
    (lambda: table()[:99], ["99 samples: must be at least 100"]),
    (lambda: table(**{"u_mA": np.cos(20 * T)}), ["column u", "which range has it?", "mA 0..20"]),
    (lambda: table(**{"u_on/off": 3 * np.cos(20 * T)}), ["column u", "which range has it?"]),
    (lambda: table(P_A_Pa=P / 1e3), ["column P_A", "read in Pa; is it in kPa (a factor of 1000)?"]),
    (lambda: table(P_A_barg=(P - C.P_atm) / 1e3), ["read in bar; is it in kPa (a factor of 100)?"]),
    (lambda: table(P_A_Pa=np.zeros(ROWS)), ["line 2, column P_A", "absolute", "bar(g)"]),
    (lambda: table(P_A_Pa=P * 1.5 * C.P_s / P.max()), ["up to 1.05e+06 Pa", "to 7e+05 Pa (supply)"]),
    (lambda: table(x_m=X + HALF), ["outside the stroke", "--x-from end"]),
    (lambda: table(x_m=1e3 * X), ["outside the stroke", "read in m; is it in mm"]),
    (lambda: table(u_V=np.ones(ROWS)), ["column u: 1 in every sample"]),
    (lambda: table(u_V=5 + np.cos(20 * T)), ["column u", "of one sign", "`V 0..10`", "offset: -5"]),
    (
        lambda: table(u_percent=50 + 40 * np.cos(20 * T)).rename(columns={"u_percent": "u_%"}),
        ["column u", "`% 0..100`", "shut there"],
    ),
    (
        lambda: table().rename(columns={"t_s": "Sample [ms]", "x_m": "way_mm"}),
        [
            "no column x",
            '"x": {"column": "way_mm", "unit": "mm"}',
            '"t": {"column": "Sample [ms]", "unit": "ms"}',
        ],
    ),
    (lambda: table(P_s_Pa=np.full(ROWS, 0.39 * C.P_s)), ["column P_s", "0.4 to 1.6 times"]),
    (lambda: table(T_K=np.full(ROWS, 25.0)), ["column T: 25 K", "200 to 400 K"]),
]


@pytest.mark.parametrize(("frame", "words"), REFUSED)
def test_each_mistake_in_a_file_gives_one_line(tmp_path, frame, words):
    with pytest.raises(InputError) as caught:
        read(frame(), tmp_path)
    text = str(caught.value)
    assert "\n" not in text and all(word in text for word in words), text


NOTED = [
    (lambda: at([50, 150], ""), ["column x: 2 of 400 samples missing, interpolated"]),
    (
        lambda: at([50, 150], "").drop(index=[50, 150]),
        [f"column {q}: 2 of 400 samples missing" for q in SIGNALS],
    ),
    (lambda: at([50, 150], "n/a", "u_V"), ["column u: 2 of 400 samples missing, held"]),
    (
        lambda: table(**{"t_s": T + 0.3 * PERIOD * (np.arange(ROWS) == 100)}),
        ["by up to 0.3 periods of 0.002 s"],
    ),
    (lambda: table(u_V=11 * np.cos(20 * T)), ["column u: beyond the limiter's 10 V", "limited"]),
    (lambda: table(P_A_Pa=np.maximum(P - 2.8e5, 0.8 * C.P_atm)), ["below the atmosphere: is it absolute?"]),
    (lambda: table(P_A_Pa=LOW, P_B_Pa=LOW[::-1]), ["columns P_A and P_B: up to", "is their unit right?"]),
    (lambda: table(x_mm=X), ["column x: moves 0.", "read in mm; is it in m (a factor of 1000)?"]),
    (lambda: table(T_degC=np.full(ROWS, 28.0)), ["column T: 301.2 K on average, of the surroundings"]),
    (lambda: table(P_s_Pa=C.P_s * np.linspace(1, 0.9, ROWS)), ["column P_s: ", "in place of the configured"]),
    (lambda: table(force_N=T), ["columns not used: force_N"]),
    (lambda: table(**{"m_A_g/s": np.sin(T), "m_B_g/s": np.cos(T)}), ["column u: not used, since the flows"]),
    (lambda: table(Comment=[""] * ROWS), []),
]


@pytest.mark.parametrize(("frame", "words"), NOTED)
def test_what_is_unlikely_or_changed_is_noted(tmp_path, frame, words):
    notes = read(frame(), tmp_path).notes
    assert len(notes) >= bool(words) and all(any(word in note for note in notes) for word in words), notes
    assert words or not notes


def test_missing_samples_are_filled_as_the_signal_is_between_samples(tmp_path):
    lost = read(table().drop(index=[50, 51]), tmp_path)  # whole rows
    kept = np.isin(np.arange(ROWS), [50, 51], invert=True)
    assert lost.period == pytest.approx(PERIOD) and np.array_equal(lost.x[kept], X[kept])
    found = read(at([50, 51], ""), tmp_path)
    np.testing.assert_allclose(found.x[50:52], X[49] + (X[52] - X[49]) * np.array([1, 2]) / 3, rtol=1e-9)
    u = table()["u_V"].to_numpy()
    found = read(at(100, "", "u_V"), tmp_path)
    assert found.u[100] == u[99]
    first = read(at(0, "", "u_V"), tmp_path)  # nothing is known before: the record begins one sample later
    assert len(first.u) == ROWS - 1 and first.u[0] == u[1] and first.x[0] == pytest.approx(X[1])
    late = table(
        t_s=5.0 + T + PERIOD * np.select([np.arange(ROWS) == k for k in (50, 100, 150)], [5e-4, 0.3, -0.3])
    )
    assert np.array_equal(read(late, tmp_path).u, np.where(np.arange(ROWS) == 100, u[99], u))


@pytest.mark.parametrize("sign", GROUPED)
def test_thousands_are_found_by_arrow_too_with_which_pandas_3_0_searches(sign):
    compute = pytest.importorskip("pyarrow.compute")
    texts = [text.replace("!", sign) for text in ("1\u202f000!5", "-12'345'678", "1000!5", "1\u202f00")]
    found = compute.match_substring_regex(texts, f"^({GROUPED[sign].pattern})$")
    assert (
        found.to_pylist()
        == [bool(GROUPED[sign].fullmatch(text)) for text in texts]
        == [True, True, False, False]
    )


def test_closed_chambers_are_seen_where_nothing_flows(tmp_path):
    still = table(u_V=np.zeros(ROWS), x_m=np.zeros(ROWS), P_A_Pa=2 * C.P_s + P)
    found = read(still, tmp_path)
    assert found.closed and found.notes[0] == "u: zero in every sample, so taken for closed chambers"
    rest = read(still.drop(columns="u_V"), tmp_path, closed=True).part(round(0.5 / PERIOD))
    assert rest.closed and len(rest.u) == rest.P.shape[1] == ROWS - round(0.5 / PERIOD)
    slow = table(t_s=2e3 * T, u_V=np.zeros(ROWS))
    assert read(slow, tmp_path).period == pytest.approx(4.0)


def test_an_on_off_valve_has_words_or_0_and_1(tmp_path):
    on = np.sin(20 * T) > 0
    for states in (on, on.astype(int), np.where(on, "TRUE", "FALSE"), np.where(on, "on", "off")):
        found = read(table().assign(u_V=states).rename(columns={"u_V": "u"}), tmp_path)
        assert np.array_equal(found.u, np.where(on, 10.0, -10.0))
    with pytest.raises(InputError, match="column u: no unit in the header"):
        read(table().rename(columns={"u_V": "u"}), tmp_path)


def test_a_vented_gauge_and_positions_from_the_end_are_no_mistakes(tmp_path):
    idle = np.abs(np.cos(20 * T)) / 1e5
    assert not [note for note in read(table(**{"P_B_bar(g)": idle}), tmp_path).notes if "unit" in note]
    np.testing.assert_allclose(read(table(x_m=X + HALF), tmp_path, from_end=True).x, X, atol=1e-12)


def test_a_pressure_above_the_supply_is_noted_only_where_the_piston_rests(tmp_path):
    resting = np.where(T < 0.4, X, written.plant().cylinder.x_max)
    high = np.where((T > 0.5) & (T < 0.6), 1.2 * C.P_s + 1e3 * np.sin(20 * T), P)
    (note,) = read(table(x_m=resting, P_A_Pa=high), tmp_path).notes
    assert note.startswith("P_A at a stop is above the supply's, by up to 1.")
    assert read(table(P_A_Pa=high), tmp_path).notes == ()
    supplied = read(table(x_m=resting, P_A_Pa=high, P_s_Pa=np.linspace(1.29, 1.3, ROWS) * C.P_s), tmp_path)
    assert not any("at a stop" in note for note in supplied.notes)


LAYOUTS = {  # text: names, numbers of the first row, line of the first sample
    "names without text are counted": (
        "t_s,,u_V,u_V\n0,1,2,3\n1,4,5,6\n",
        "t_s|column 2|u_V|u_V.4",
        "0 1 2 3",
        2,
    ),
    "a comma within a name": ("Zeit [s];U, soll [V]\n0;1\n1;2\n", "Zeit [s]|U, soll [V]", "0 1", 2),
    "decimal commas in quotes": ('t_s,u_V\n"0,001","1,3"\n"0,002","-1,5e-3"\n', "t_s|u_V", "0.001 1.3", 2),
    "thousands": ('t_s,u_V,P_A_Pa\n0.001,1.3,"101,325"\n', "t_s|u_V|P_A_Pa", "0.001 1.3 101325", 2),
    "German thousands": ("t_s;P_A_Pa\n0,001;101.325,5\n0,002;1.101.325\n", "t_s|P_A_Pa", "0.001 101325.5", 2),
    "a row of names that are units": ("s,V,mm\n0,1,2\n1,4,5\n", "s|V|mm", "0 1 2", 2),
    "dSPACE": ("type;ControlDesk\n\ntrace_values\nx-axis;u\n;V\n0.5;1\n1;2\n", "x-axis|u", "0.5 1", 6),
    "an end": ("t_s;u_V\n0;1\n1;2\nEOF\n", "t_s|u_V", "0 1", 2),
}


@pytest.mark.parametrize("kind", LAYOUTS)
def test_the_layout_of_a_text_is_found_by_its_content(tmp_path, kind):
    text, names, numbers, line = LAYOUTS[kind]
    channels = read_text(tmp_path / "a.csv", text.encode())
    assert "|".join(channel.name for channel in channels) == names
    assert [float(channel.values[0]) for channel in channels] == [float(n) for n in numbers.split()]
    assert {channel.first_line for channel in channels} == {line}
