"""Measurements: what is read, and what is wrong with them said by column and line."""

import os
from functools import cache

import netCDF4
import numpy as np
import pandas as pd
import pint
import pytest
from synthetic_records import synthetic_record

from pneumo.errors import InputError
from pneumo.fit.mistaken_columns import check_columns
from pneumo.fit.record import text_table
from pneumo.fit.record.columns import ANR, UNITS, ZERO_CELSIUS, Column, read_mapping
from pneumo.fit.record.measurement import read_measurement
from pneumo.fit.record.ranges import above_supply, ranges_text

PINT = pint.UnitRegistry()
SI = {"t": "s", "u": "V", "x": "m", "v": "m/s", "T": "K"} | dict.fromkeys(("m_A", "m_B"), "kg/s")


@cache
def known():
    return synthetic_record(8)


def half():
    return known().configured.cylinder.stroke / 2


def gauge(P):
    return P - known().configured.conditions.P_atm


def table():
    motion = {"t_s": known().period * np.arange(len(known().u)), "u_V": known().u, "x_mm": known().x * 1e3}
    return motion | {"P_A_kPa": known().P[0] / 1e3, "P_B [bar(g)]": gauge(known().P[1]) / 1e5}


def read(tmp_path, columns, **options):
    file = tmp_path / "m.csv"
    pd.DataFrame(columns).to_csv(file, index=False)
    return read_measurement(file, known().configured, **options)


def changed(old, values, new=None):
    """The table with other values in one column, under a new name where one is given."""
    return dict((new or old, values) if name == old else (name, v) for name, v in table().items())


def at(index, value, name="x_mm"):
    values = np.array(table()[name], dtype=object)
    values[index] = value
    return changed(name, values)


def test_units_of_the_header_position_from_the_end_and_uneven_time(tmp_path):
    measured = read(tmp_path, table())
    assert measured.notes == ()
    assert measured.period == pytest.approx(known().period, rel=1e-9)
    # The file holds every digit; units are converted with one rounding or two.
    np.testing.assert_allclose(measured.x, known().x, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(measured.P, known().P, rtol=1e-14)
    measured = read(tmp_path, changed("x_mm", 1e3 * (known().x + half())), from_end=True)
    np.testing.assert_allclose(measured.x, known().x, atol=1e-15)


def test_a_mapping_is_read_from_its_file_and_an_unknown_quantity_is_refused(tmp_path):
    file = tmp_path / "columns.yaml"
    file.write_text("P_A: {column: pressure 1, unit: kPa}\n")
    assert read_mapping(file) == {"P_A": Column(column="pressure 1", unit="kPa")}
    file.write_text("P_C: {column: pressure 1, unit: kPa}\n")
    with pytest.raises(InputError, match="P_C"):
        read_mapping(file)


FACTORS = [(quantity, *row) for quantity, units in UNITS.items() for row in units.items()]


@pytest.mark.parametrize(("quantity", "unit", "factor"), FACTORS)
def test_every_factor_is_that_of_pint(quantity, unit, factor):
    plain = unit.replace("dm3", "dm**3").replace("degC", "delta_degC").removesuffix("(ANR)")
    one = PINT.Quantity(1.0, plain) * (PINT.Quantity(ANR, "kg/m**3") if "ANR" in unit else 1.0)
    # Pint multiplies prefixes in another order: two roundings.
    assert factor == pytest.approx(one.to(SI.get(quantity, "Pa")).magnitude, rel=2 * np.finfo(float).eps)
    assert PINT.Quantity(0.0, "degC").to("K").magnitude == ZERO_CELSIUS


def supply():
    """Supply pressure that sags, Pa."""
    return known().configured.conditions.P_s * np.linspace(1.0, 0.9, len(known().u))


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        (lambda: {k: v for k, v in table().items() if k != "x_mm"}, ["no column x"]),
        (lambda: at(17, "off"), ["line 19", "column x", "'off'", "finite"]),
        (lambda: at(17, "inf"), ["line 19", "'inf'", "finite"]),
        (lambda: at(slice(17, 20), ""), ["line 19", "column x", "more than 2 missing", "cut the file"]),
        (lambda: at(slice(0, 3), ""), ["line 2,", "column x", "more than 2 missing"]),
        (lambda: at(slice(-3, None), ""), [f"line {len(known().u) - 1},", "column x", "more than 2 missing"]),
        (lambda: at(slice(0, None, 9), "nan"), ["line 2", "column x", "at most 1 %"]),
        (lambda: at(500, table()["t_s"][499], "t_s"), ["line 502", "must increase"]),
        (lambda: changed("t_s", table()["t_s"] + (np.arange(len(known().u)) > 499)), ["line 502", "gap"]),
        (lambda: changed("t_s", table()["t_s"], "t_h"), ["unknown unit 'h'"]),
        (lambda: changed("t_s", table()["t_s"], "t"), ["no unit"]),
        (
            lambda: changed("P_A_kPa", known().P[0] / 1e3, "P_A_Pa"),
            ["column P_A", "read in Pa; is it in kPa"],
        ),
        (lambda: changed("P_A_kPa", known().P[0]), ["column P_A", "read in kPa; is it in Pa"]),
        (lambda: changed("P_A_kPa", 0 * known().P[0]), ["column P_A", "absolute"]),
        (lambda: changed("x_mm", 1e3 * (known().x + half())), ["outside the stroke", "--x-from end"]),
        (lambda: changed("u_V", 0 * known().u + 1), ["column u", "every sample"]),
        (lambda: table() | {"P_s_kPa": 1e-2 * supply()}, ["column P_s", "0.4 and 1.6 times", "unit"]),
        (lambda: {k: v for k, v in table().items() if k != "u_V"}, ["no column u", "--closed both"]),
        (lambda: table() | {"v_mm/s": -np.gradient(known().x * 1e3, known().period)}, ["column v"]),
    ],
)
def test_each_mistake_in_a_file_gives_one_line(tmp_path, columns, words):
    with pytest.raises(InputError) as caught:
        read(tmp_path, columns())
    text = str(caught.value)
    assert "\n" not in text and all(word in text for word in ["m.csv", *words]), text


def test_closed_chambers_are_seen_where_nothing_flows_and_said_where_nothing_was_logged(tmp_path):
    measured = read(tmp_path, changed("u_V", 0 * known().u))
    assert measured.closed and measured.notes == ("u: zero in every sample, so taken for closed chambers",)
    flows = {name: 0 * known().u for name in ("m_A_kg/s", "m_B_kg/s")}
    assert read(tmp_path, table() | flows).closed and not read(tmp_path, table()).closed
    # A held piston and pressures above the supply's are no mistakes there.
    P_s = known().configured.conditions.P_s
    high = {"x_mm": 0 * known().x, "P_A_kPa": (2 * P_s + known().P[0]) / 1e3}
    silent = {name: values for name, values in (table() | high).items() if name != "u_V"}
    rest = read(tmp_path, silent, closed=True).since(0.5)
    assert rest.closed and len(rest.u) == rest.P.shape[1] == len(known().u) - round(0.5 / known().period)


def test_a_measured_supply_pressure_is_read_and_said(tmp_path):
    measured = read(tmp_path, table() | {"P_s_kPa": 1e-3 * supply()})
    np.testing.assert_allclose(measured.P_s, supply(), rtol=1e-12)
    assert len(measured.since(0.5).P_s) == len(measured.since(0.5).u)
    assert [note for note in measured.notes if note.startswith("column P_s: ")]


def test_a_column_that_is_not_read_is_said_unless_it_is_empty_or_a_mapping_leaves_it_out(tmp_path):
    columns = table() | {"T_%": 20.0 + 0 * known().u, "Comment": ""}
    assert read(tmp_path, columns).notes == ("columns not used: T_%",)
    mapping = {name: Column(column=f"{name}_{unit}", unit=unit) for name, unit in (("t", "s"), ("u", "V"))}
    mapping |= {"x": Column(column="x_mm", unit="mm"), "P_A": Column(column="P_A_kPa", unit="kPa")}
    mapping |= {"P_B": Column(column="P_B [bar(g)]", unit="bar(g)")}
    assert read(tmp_path, columns, mapping=mapping).notes == ()


def test_uneven_time_is_noted(tmp_path):
    t = table()["t_s"] + np.random.default_rng(0).uniform(-0.3, 0.3, len(known().u)) * known().period
    position = 300 * half() * np.sin(t)  # mm, smooth: the known record's own noise would hide what time does
    measured = read(tmp_path, changed("t_s", t) | {"x_mm": position})
    assert "not uniform" in measured.notes[0]
    # Straight lines between samples are off by the curvature times the period squared over 8.
    true = 0.3 * half() * np.sin(t[0] + measured.t)
    assert np.max(np.abs(measured.x - true)) < 0.3 * half() * (1.6 * known().period) ** 2 / 8 * 1.01


def test_confused_columns_are_refused(tmp_path):
    right = read(tmp_path, table())
    check_columns(right, known().configured)
    for confused, words in (
        (right._replace(P=right.P[::-1]), "swapped"),
        (right._replace(u=-right.u), "column u"),
        (right._replace(x=-right.x), "column x"),
        (right._replace(P=gauge(right.P)), "gauge"),
    ):
        with pytest.raises(InputError, match=words):
            check_columns(confused, known().configured)


def test_all_missing_columns_are_named_and_the_mapping_proposed_is_read_as_it_is(tmp_path):
    foreign = dict(zip(("Zeit", "U_Ventil", "Weg", "p1", "p 2 [bar(g)]"), table().values(), strict=True))
    with pytest.raises(InputError, match="no column x, P_A, P_B, u: must") as error:
        read(tmp_path, foreign)
    proposed = str(error.value).partition("complete: ")[2]
    file = tmp_path / "columns.yaml"
    file.write_text(proposed)
    mapping = read_mapping(file)
    assert {q: c.column for q, c in mapping.items()} == dict(
        zip(["t", "u", "x", "P_A", "P_B"], foreign, strict=True)
    )
    assert mapping["P_B"].unit == "bar(g)" and mapping["x"].unit == "mm"
    assert mapping["t"].unit == "s"  # Zeit was known, its unit was not
    mapping["P_A"] = mapping["P_A"].model_copy(update={"unit": "kPa"})  # the user's check
    np.testing.assert_array_equal(read(tmp_path, foreign, mapping=mapping).P, read(tmp_path, table()).P)
    # What nobody can guess is left to the user; what was read stays.
    with pytest.raises(InputError, match=r"no column P_A: .*P_A: \{column: '\?', unit: bar") as error:
        read(tmp_path, {"AI 3" if name == "P_A_kPa" else name: v for name, v in table().items()})
    assert "u: {column: u_V, unit: V}" in str(error.value)


def test_a_record_is_shown_with_its_ranges_and_pressures_above_the_supply(tmp_path):
    measured, plant = read(tmp_path, table()), known().configured
    text = ranges_text(measured, plant)
    low, high = (f"{1e3 * end:.3g}" for end in (measured.x.min(), measured.x.max()))
    assert f"x (read as mm) {low} to {high} mm, at a stop " in text
    assert f"P_A (read as kPa absolute) {measured.P[0].min() / 1e5:.3g} to " in text
    assert f"P_B (read as bar gauge) {measured.P[1].min() / 1e5:.3g} to " in text
    assert above_supply(measured, plant) == []
    rests = measured._replace(x=np.full_like(measured.x, plant.cylinder.x_max))
    assert "at a stop 100 % of the time" in ranges_text(rests, plant)
    high_P = np.array([measured.P[0] * 0 + 1.2 * plant.conditions.P_s, measured.P[1]])
    (note,) = above_supply(rests._replace(P=high_P), plant)
    assert note.startswith("P_A is above the configured supply 100 % of the time") and "100 % of that" in note


def test_wide_long_endless_and_huge_files_are_refused_before_they_are_read(tmp_path, monkeypatch):
    def refusal(file):
        with pytest.raises(InputError) as error:
            read_measurement(file, known().configured)
        return str(error.value).replace(f"{tmp_path}/", "")

    assert refusal("/dev/zero") == "/dev/zero: not a readable CSV file (not a regular file)"
    wide, long, large = (tmp_path / f"{name}.csv" for name in ("wide", "long", "large"))
    wide.write_text(",".join(f"c{i}" for i in range(200_000)) + "\n" + ",".join(["1"] * 200_000) + "\n")
    assert refusal(wide) == "wide.csv: 200000 columns: must be at most 200"
    large.touch()
    os.truncate(large, 10**12)  # a terabyte of holes
    assert (
        refusal(large)
        == "large.csv: not a readable CSV file (is too large: at most 200000000 bytes are read)"
    )
    long.write_text("t_s,u_V\n" + "0,0\n" * 30)
    monkeypatch.setattr(text_table, "MOST_ROWS", 20)
    assert refusal(long) == "long.csv: 21 rows or more: must be at most 20"
    monkeypatch.undo()
    for name in ("dimension", "variables"):
        with netCDF4.Dataset(tmp_path / f"{name}.nc", "w") as file:
            if name == "dimension":
                file.createDimension("t", 300_000_000)
                file.createVariable("t", "f8", ("t",), zlib=True)
            for i in range(300 if name == "variables" else 0):
                file.createVariable(f"v{i}", "f8")
    with pytest.raises(InputError, match=r"\.nc: 300000000 samples along t: must be at most 2000000"):
        read_measurement(tmp_path / "dimension.nc", known().configured)
    assert (tmp_path / "dimension.nc").stat().st_size < 50_000
    with pytest.raises(InputError, match=r"\.nc: 300 variables: must be at most 200"):
        read_measurement(tmp_path / "variables.nc", known().configured)
