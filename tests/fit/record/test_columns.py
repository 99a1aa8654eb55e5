"""Columns by header or mapping: units, and what is refused or proposed."""

import numpy as np
import pytest
import yaml

from pneumo.errors import InputError
from pneumo.fit.record.columns import (
    ANR,
    UNITS,
    Column,
    columns_by_header,
    proposed_mapping,
    read_mapping,
    unused_note,
)


def test_air_of_the_reference_atmosphere_has_the_density_of_its_definition():
    """ISO 8778: 100 kPa, 20 degC, 65 % relative humidity, of the 2.34 kPa at which water condenses."""
    dry, damp = 100e3 - 0.65 * 2.34e3, 0.65 * 2.34e3
    # The standard rounds to 1.185 kg/m^3, and the constants of air vary between tables.
    assert pytest.approx((dry / 287.05 + damp / 461.5) / 293.15, rel=5e-3) == ANR


def mapped(tmp_path, text):
    file = tmp_path / "columns.yaml"
    file.write_text(text, encoding="utf-8")
    return read_mapping(file)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("P_C: {column: c1, unit: kPa}", "P_C"),
        ("P_A: {column: c1}", "P_A.unit"),
        ("P_A: {column: c1}\nP_B: {unit: kPa}", "P_A.unit"),  # the first of two
        ("P_A: {column: '', unit: kPa}", "P_A.column"),
        ("P_A: {column: c1, unit: kPa, scale: .inf}", "P_A.scale"),
        ("P_A: {column: c1, unit: kPa, offset: .nan}", "P_A.offset"),
    ],
)
def test_an_entry_of_a_mapping_that_is_wrong_is_named(tmp_path, text, named):
    with pytest.raises(InputError) as error:
        mapped(tmp_path, text)
    expected = f"{named}: must be one of {', '.join(UNITS)}, each with column and unit"
    assert str(error.value) == f"{tmp_path}/columns.yaml: {expected}"


def test_a_column_of_one_letter_has_a_name(tmp_path):
    assert mapped(tmp_path, "P_A: {column: c, unit: kPa}") == {"P_A": Column(column="c", unit="kPa")}


def test_a_header_may_be_long_and_is_cut_where_it_is_refused(tmp_path):
    long = f"P_A [{'kilopascal ' * 40}]"
    with pytest.raises(InputError) as error:
        columns_by_header([long], {})["P_A"].factor_and_offset(tmp_path, "P_A", 1e5)
    said = f"{tmp_path}: column P_A [kilop...scal kilopascal ]: unknown unit '...pascal kilopascal';"
    assert str(error.value).startswith(said)
    with pytest.raises(InputError) as error:
        columns_by_header([long, "P_A_kPa"], {})
    assert len(str(error.value)) < 100


@pytest.mark.parametrize(
    ("quantity", "unit", "said"),
    [
        ("P_A", "bara", "unknown unit 'bara'; the units are Pa, hPa, kPa, bar, psi, MPa, mbar, bar(g)"),
        ("t", "hours", "unknown unit 'hours'; the units are s, ms, us, ns, min"),
        ("t", "", "no unit in the header; the units are s, ms, us, ns, min"),
        ("x", "twentieths of an in.", "unknown unit 'twentieths of an in.'; the units are m, cm, mm, um, in"),
    ],
)
def test_an_unknown_unit_is_named_with_those_of_the_quantity(tmp_path, quantity, unit, said):
    column = Column(column="the third sensor's signal in port A", unit=unit)
    with pytest.raises(InputError) as error:
        column.factor_and_offset(tmp_path, quantity, 1e5)
    assert str(error.value) == f"{tmp_path}: column the third ... signal in port A: {said}"


def test_a_temperature_has_one_of_two_units():
    assert Column(column="T", unit="K").factor_and_offset(None, "T", 1e5) == (1.0, 0.0)
    assert Column(column="T", unit="[°C]").factor_and_offset(None, "T", 1e5) == (1.0, 273.15)


def test_two_columns_of_one_quantity_are_refused_by_name():
    with pytest.raises(InputError, match=r"columns 'P_A_kPa' and 'P_A \[bar\]': both are P_A"):
        columns_by_header(["t_s", "P_A_kPa", "P_A [bar]"], {})
    # Where there is t, a column named Time is another one.
    assert columns_by_header(["t_s", "Time [ms]"], {}) == {"t": Column(column="t_s", unit="s")}


def test_a_gauges_unit_may_be_behind_an_underscore():
    for header in ("P_A_bar(g)", "P_A (bar(g))", "P_A_bar_g", "P_A_bar (g)"):
        column = columns_by_header([header], {})["P_A"]
        assert column.factor_and_offset("m.csv", "P_A", 1e5) == (1e5, 1e5)


@pytest.mark.parametrize(
    ("header", "quantity", "factor", "offset"),
    [("T_°C", "T", 1.0, 273.15), ("x_µm", "x", 1e-6, 0.0), ("m_A (dm³/s(ANR))", "m_A", 1.185e-3, 0.0)],
)
def test_signs_in_units_are_read_as_they_are_written(header, quantity, factor, offset):
    column = columns_by_header([header], {})[quantity]
    assert column.column == header
    read = column.factor_and_offset("m.csv", quantity, 1e5)
    assert read == (pytest.approx(factor, rel=1e-12), offset)


@pytest.mark.parametrize("header", ["u_%", "Ventil [%]", "u (counts)", "u_counts"])
def test_no_unit_is_proposed_for_a_column_in_an_unknown_one(header):
    names = ["x_mm", header]
    text = proposed_mapping(names, {}, columns_by_header(names, {}), ["x", "u"])
    assert yaml.safe_load(text) == {
        "x": {"column": "x_mm", "unit": "mm"},
        "u": {"column": header, "unit": "?"},
    }
    (known,) = columns_by_header(["P_A_barg"], {}).values()
    assert "unit: barg" in proposed_mapping(["P_A_barg"], {}, {"P_A": known}, ["P_A"])


def test_columns_that_are_not_read_are_named_those_first_that_may_be_misspelt():
    names = ["t_s", "valve", "Temp", "T_%", "force_N", "P_s_mbar_abs", "note"]
    columns = columns_by_header(names, {})
    assert unused_note(names, columns) == ["columns not used: T_%, P_s_mbar_abs, valve, Temp and 2 more"]
    assert unused_note(names[:2], columns) == ["columns not used: valve"]
    assert unused_note(["t_s"], columns) == []


def test_a_proposed_mapping_is_one_line_with_names_as_they_are():
    name = "Größe Nummer " + " ".join(str(k) for k in range(60))  # 182 characters
    known = {"x": Column(column=name, unit="mm")}
    text = proposed_mapping([name, "Zeit"], {}, known, ["t", "x"])
    assert text == f"{{x: {{column: {name}, unit: mm}}, t: {{column: Zeit, unit: s}}}}"
    assert np.all([character.isprintable() for character in text])
