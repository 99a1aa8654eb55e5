"""Units as they are printed, headers that contain them, and mappings."""

from pathlib import Path

import numpy as np
import pint
import pytest
import yaml

from pneumo.errors import InputError
from pneumo.fitting.record.channel import Channel, seconds
from pneumo.fitting.record.columns import (
    Column,
    columns_by_header,
    proposed_mapping,
    read_mapping,
    unused_note,
)
from pneumo.fitting.record.units import (
    ANR,
    LENGTHS,
    MASS_FLOWS,
    PRESSURES,
    QUANTITIES,
    TIMES,
    Reading,
    Surroundings,
    reading,
)

PINT = pint.UnitRegistry()
AROUND = Surroundings(P_atm=1e5, u_max=10.0)


def test_air_of_the_reference_atmosphere_has_the_density_of_its_definition():
    """ISO 8778: 100 kPa, 20 degC, 65 % relative humidity, of the 2.34 kPa at which water condenses."""
    dry, damp = 100e3 - 0.65 * 2.34e3, 0.65 * 2.34e3
    # The standard rounds to 1.185 kg/m^3, and the constants of air vary between tables.
    assert pytest.approx((dry / 287.05 + damp / 461.5) / 293.15, rel=5e-3) == ANR


@pytest.mark.parametrize(
    ("units", "si"), [(TIMES, "s"), (LENGTHS, "m"), (PRESSURES, "Pa"), (MASS_FLOWS, "kg/s")]
)
def test_every_factor_is_that_of_pint(units, si):
    spelled = {"msec": "ms", "usec": "us", "nsec": "ns", "secs": "s", "kgf/cm2": "kgf/cm**2", "100 ns": "hns"}
    spelled |= dict.fromkeys(("kg/cm2", "kp/cm2"), "kgf/cm**2") | {
        "Torr": "torr",
        "N/mm2": "N/mm**2",
        "lbf/in2": "psi",
    }
    PINT.define("hns = 100 * ns")
    for unit, factor in units.items():
        expected = PINT.Quantity(1.0, spelled.get(unit, unit)).to(si).magnitude
        # Pint multiplies prefixes in another order; its Torr, mmHg and inHg have seven digits.
        assert factor == pytest.approx(expected, rel=3e-7 if unit in ("Torr", "mmHg", "inHg") else 4e-16), (
            unit
        )


PA = {
    "bar": 1e5,
    "psi": 6894.757293168361,
    "kPa": 1e3,
    "MPa": 1e6,
    "mbar": 1e2,
    "kgf/cm2": 98066.5,
    "Pa": 1.0,
}
MARKS = {
    "absolute": [
        "{}",
        "{}a",
        "{}(a)",
        "{} abs",
        "{}A",
        "{}(A)",
        "{} absolute",
        "{}_abs",
        "{} [abs]",
        "[{}a]",
    ],
    "gauge": ["{}g", "{}(g)", "{}(G)", "{} gauge", "{} rel", "{}_g", "{} gage", "{}(rel)", "{}ü", "{} (g)"],
}


@pytest.mark.parametrize("unit", PA)
@pytest.mark.parametrize("mark", MARKS)
def test_pressures_are_absolute_or_gauge_as_sensors_are_labelled(unit, mark):
    for form in MARKS[mark]:
        found = reading("P_A", form.format(unit), AROUND)
        assert isinstance(found, Reading), form
        assert found.factor == PA[unit] and found.offset == (1e5 if mark == "gauge" else 0.0)
        assert found.text == f"{unit} {mark}"


NORMAL, PER_MINUTE = 101325 / (287.05 * 273.15), 1e-3 / 60
READ = [  # quantity, unit, factor, offset
    *[("t", unit, factor, 0) for unit, factor in {"sec": 1, "ms": 1e-3, "µs": 1e-6, "[ns]": 1e-9}.items()],
    ("t", "milliseconds since 2024-05-13 10:00", 1e-3, 0),
    *[("x", unit, factor, 0) for unit, factor in {"µm": 1e-6, "MM": 1e-3, "in": 0.0254}.items()],
    *[("v", unit, 1e-3, 0) for unit in ("mm/s", "mm s-1", "mm_per_s", "mm/sec")],
    *[("T", unit, 1, 273.15) for unit in ("°C", "degC", "[°C]", "C")],
    ("T", "°F", 5 / 9, 255.3722222222222),
    *[("P_A", "mmHg", 133.322387415, 0), ("P_A", "Torr", 101325 / 760, 0), ("P_A", "kgf/cm²", 98066.5, 0)],
    *[("P_A", "PSIG", 6894.757293168361, 1e5), ("P_A", "Bar", 1e5, 0)],
    *[("u", "V", 1, 0), ("u", "mV", 1e-3, 0), ("u", "%", 0.1, 0)],
    *[("u", unit, 1.25, -15) for unit in ("mA", "mA 4..20", "4-20 mA", "mA (4...20)")],
    *[("u", unit, 2, -10) for unit in ("V 0..10", "0-10 V", "0 to 10 V")],
    *[("u", "% 0..100", 0.2, -10), ("u", "0/1", 20, -10), ("u", "mA -20..20", 0.5, 0)],
    *[("m_A", unit, factor, 0) for unit, factor in {"kg/s": 1, "g/s": 1e-3, "kg/h": 1 / 3600}.items()],
    *[
        ("m_A", unit, NORMAL * PER_MINUTE, 0)
        for unit in ("Nl/min", "NL/min", "ln/min", "nlpm", "slpm(0 degC)")
    ],
    ("m_A", "Nm3/h", NORMAL / 3600, 0),
    *[("m_A", unit, ANR * PER_MINUTE, 0) for unit in ("l/min(ANR)", "L/min (ANR)", "slpm(ANR)")],
    ("m_A", "dm³/s(ANR)", ANR * 1e-3, 0),
    ("m_A", "sccm(20 °C, 1 bar)", 1e5 / (287.05 * 293.15) * 1e-6 / 60, 0),
]


@pytest.mark.parametrize(("quantity", "unit", "factor", "offset"), READ)
def test_units_are_read_as_they_are_printed(quantity, unit, factor, offset):
    found = reading(quantity, unit, AROUND)
    assert isinstance(found, Reading), found
    assert (found.factor, found.offset) == (
        pytest.approx(factor, rel=1e-12),
        pytest.approx(offset, rel=1e-12),
    )


ASKED = [
    *[
        ("m_A", unit, ["of which reference state", "(0 degC)", "(ANR)"])
        for unit in ("slpm", "sccm", "l/min", "SLM")
    ],
    ("m_A", "l/min(900 degC)", ["must lie within"]),
    *[("P_A", unit, ["differential", "bar(g)"]) for unit in ("psid", "bar diff")],
    *[("P_A", unit, ["unknown unit", "kgf/cm2"]) for unit in ("mPa", "barn", "bar(x)", "%")],
    *[("t", unit, ["s, ms, us"]) for unit in ("weeks", "")],
    ("P_A", "mA", ["`scale` and `offset`"]),
    ("u", "counts", ["mA 4..20", "`scale`"]),
    ("u", "V 10..0", ["unknown unit"]),
    ("x", "twentieths", ["m, cm, mm"]),
]


@pytest.mark.parametrize(("quantity", "unit", "words"), ASKED)
def test_ambiguous_and_unknown_units_are_asked_about_with_what_to_write(quantity, unit, words):
    found = reading(quantity, unit, AROUND)
    assert isinstance(found, str) and "\n" not in found and all(word in found for word in words), found


def columns(*names, units=()):
    return (
        columns_by_header(
            [Channel(n, np.zeros(3), u) for n, u in zip(names, [*units, *names], strict=False) if n]
        )
        if units
        else columns_by_header([Channel(name, np.arange(3.0)) for name in names])
    )


@pytest.mark.parametrize(
    ("header", "quantity", "unit"),
    [
        ("P_A_kPa", "P_A", "kPa"),
        ("P_A [kPa]", "P_A", "kPa"),
        ("P_A (bar(g))", "P_A", "bar(g)"),
        ("P_A_bar(g)", "P_A", "bar(g)"),
        ("P_s_mbar_abs", "P_s", "mbar_abs"),
        ("P_A_bar_g", "P_A", "bar_g"),
        ("T_°C", "T", "degC"),
        ("x_µm", "x", "um"),
        ("u_%", "u", "%"),
        ("m_A (dm³/s(ANR))", "m_A", "dm3/s(ANR)"),
        ("v_m_per_s", "v", "m/s"),
        ("v_m/s", "v", "m/s"),
        ("/bench/state/P_A_bar", "P_A", "bar"),
        ("field.x_mm", "x", "mm"),
        ("Zeit [ms]", "t", "ms"),
        ("X_Value", "t", ""),
        ("P_A_foo", "P_A", "foo"),  # refused later, with the units
    ],
)
def test_a_header_has_quantity_and_unit(header, quantity, unit):
    found = columns(header)
    assert found == {quantity: Column(column=header, unit=unit)}


def test_a_name_that_only_begins_like_a_quantity_is_none_and_two_of_one_are_refused():
    assert {*columns("x_mm", "x_ref_mm", "T_%", "u_1", "Temp", "valve", "t_s", "Time [ms]")} == {"x", "t"}
    assert columns("P_A_bar", "x_soll", "x_mm")["x"].column == "x_mm"
    with pytest.raises(InputError, match=r"columns 'P_A_kPa' and 'P_A \[bar\]': both are P_A"):
        columns("t_s", "P_A_kPa", "P_A [bar]")


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("P_C: {column: c1, unit: kPa}", "P_C"),
        ("P_A: {column: c1}", "P_A.unit"),
        ("P_A: {column: '', unit: kPa}", "P_A.column"),
        ("P_A: {column: c1, unit: kPa, scale: .inf}", "P_A.scale"),
    ],
)
def test_an_entry_of_a_mapping_that_is_wrong_is_named(tmp_path, text, named):
    file = tmp_path / "columns.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as error:
        read_mapping(file)
    assert str(error.value).startswith(f"{file}: {named}: must be one of {', '.join(QUANTITIES)}")


def test_a_proposed_mapping_is_one_line_with_names_as_they_are_and_no_guess_for_an_unknown_unit():
    names = [
        "Größe Nummer " + " ".join(map(str, range(60))),
        "Zeit 1",
        "Ventil [counts]",
        "bench/pressure1",
        "p 2 [bar(g)]",
    ]
    channels = [Channel(name, np.zeros(3)) for name in names]
    text = proposed_mapping(
        channels, {"x": Column(column=names[0], unit="mm")}, ["t", "x", "u", "P_A", "P_B"]
    )
    assert "\n" not in text and yaml.safe_load(text) == {
        "x": {"column": names[0], "unit": "mm"},
        "t": {"column": "?", "unit": "s"},
        "u": {"column": "Ventil [counts]", "unit": "?"},
        "P_A": {"column": "bench/pressure1", "unit": "bar"},
        "P_B": {"column": "p 2 [bar(g)]", "unit": "bar(g)"},
    }


def test_columns_that_are_not_read_are_named_those_first_that_may_be_misspelt():
    channels = [
        Channel(name, np.zeros(3)) for name in ["t_s", "valve", "Temp", "T_%", "force_N", "v_foo(x)", "note"]
    ]
    found = columns_by_header(channels)
    assert unused_note(channels, found) == ["columns not used: T_%, v_foo(x), valve, Temp and 2 more"]
    assert unused_note(channels[:1], found) == []


def test_scale_and_offset_are_of_the_number_in_the_file():
    """4 to 20 mA for 0 to 10 bar of gauge pressure."""
    loop = Column(column="ai3", unit="barg", scale=0.625, offset=-2.5)
    factor, offset, text = loop.reading(Path("a.csv"), "P_A", AROUND)
    assert [factor * mA + offset for mA in (4, 20)] == pytest.approx([1e5, 11e5]) and text == "bar gauge"
    long = Column(column="the third sensor's signal in port A", unit="kilopascal " * 40)
    with pytest.raises(InputError) as error:
        long.reading(Path("a.csv"), "P_A", AROUND)
    assert len(str(error.value)) < 250


@pytest.mark.parametrize(
    "stamp",
    [
        "31.05.2006 11:59:59,{}",
        "5/31/2006 11:59:59.{} AM",
        "31/05/2006 11:59:59.{}",
        "2006-05-31 11:59:59.{}",
    ],
)
def test_dates_are_read_in_the_order_of_each_country(stamp):
    stamps = np.array([stamp.format(f"{k:03d}") for k in (7, 8, 12)], dtype=object)
    start, t = seconds(Path("a.csv"), Channel("Time", stamps), "")
    assert float(start % 60) == pytest.approx(59.007, abs=1e-9)
    np.testing.assert_allclose(t, [0, 1e-3, 5e-3], atol=1e-12)


@pytest.mark.parametrize(
    ("quantity", "printed", "same"),
    [
        ("u", "±10 V", "V -10..10"),
        ("u", "VDC", "V"),
        ("u", "percent", "%"),
        ("T", "deg C", "degC"),
        ("T", "℃", "degC"),
        ("P_A", "bar, abs", "bara"),
        ("P_A", "kPa-g", "kPa gauge"),
        ("t", "sec.", "s"),
        ("m_A", "scfm(0 degC)", "ft3/min(0 degC)"),
        ("m_A", "l/min ANR", "l/min(ANR)"),
    ],
)
def test_other_spellings_of_a_unit(quantity, printed, same):
    found, expected = reading(quantity, printed, AROUND), reading(quantity, same, AROUND)
    assert isinstance(found, Reading)
    assert isinstance(expected, Reading)
    assert found[:2] == expected[:2]
