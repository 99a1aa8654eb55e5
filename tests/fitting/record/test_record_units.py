"""Units as they are printed, headers that contain them, mappings, and stamps."""

from pathlib import Path

import numpy as np
import pint
import pytest

from pneumo.configuration.valve_conversions import ANR_RHO
from pneumo.errors import InputError
from pneumo.fitting.record.channel import Channel
from pneumo.fitting.record.clocks import seconds
from pneumo.fitting.record.columns import Column, columns_by_header, read_mapping
from pneumo.fitting.record.units import (
    LENGTHS,
    MASSES,
    PRESSURES,
    QUANTITIES,
    TIMES,
    VOLUMES,
    Reading,
    Surroundings,
    reading,
)

PINT = pint.get_application_registry()
PINT.define("hns = 100 * ns")
AROUND = Surroundings(P_atm=1e5, u_max=10.0)


def test_air_of_the_reference_atmosphere_has_the_density_of_its_definition():
    """ISO 8778: 100 kPa, 20 degC, 65 % relative humidity, of the 2.34 kPa at which water condenses."""
    dry, damp = 100e3 - 0.65 * 2.34e3, 0.65 * 2.34e3
    # The standard rounds to 1.185 kg/m^3, and the constants of air vary between tables.
    assert pytest.approx((dry / 287.05 + damp / 461.5) / 293.15, rel=5e-3) == ANR_RHO
    of_helium = reading("m_A", "m3/s(ANR)", Surroundings(R=2077.0))  # has no humidity
    assert isinstance(of_helium, Reading) and of_helium.factor == pytest.approx(1e5 / (2077.0 * 293.15))


@pytest.mark.parametrize(
    ("units", "si"), [(TIMES, "s"), (LENGTHS, "m"), (PRESSURES, "Pa"), (MASSES, "kg"), (VOLUMES, "m**3")]
)
def test_every_factor_is_that_of_pint(units, si):
    spelled = {"msec": "ms", "usec": "us", "nsec": "ns", "secs": "s", "100 ns": "hns", "Torr": "torr"}
    spelled |= {"kgf/cm2": "kgf/cm**2", "kg/cm2": "kgf/cm**2", "kp/cm2": "kgf/cm**2", "N/mm2": "N/mm**2"}
    spelled |= {"dm3": "dm**3", "cm3": "cm**3", "m3": "m**3", "ft3": "ft**3"}
    spelled |= {"lbf/in2": "psi", "lb/in2": "psi"}
    for unit, factor in units.items():
        expected = PINT.Quantity(1.0, spelled.get(unit, unit)).to(si).magnitude
        # Pint multiplies prefixes in another order, and its columns of mercury and water have seven digits.
        column = unit.endswith(("Torr", "Hg", "H2O"))
        assert factor == pytest.approx(expected, rel=1e-6 if column else 4e-16), unit


MARKS = {
    "absolute": "{}a,{}(a),{} abs,{}A,{}(A),{} absolute,{}_abs,{} [abs],[{}a]",
    "gauge": "{}g,{}(g),{}(G),{} gauge,{} rel,{}_g,{} gage,{}(rel),{}ü,{} (g)",
}


@pytest.mark.parametrize("mark", MARKS)
def test_pressures_are_absolute_or_gauge_as_sensors_are_labelled(mark):
    for unit in ("bar", "psi", "kPa", "MPa", "mbar", "kgf/cm2", "Pa"):
        for form in MARKS[mark].split(","):
            found = reading("P_A", form.format(unit), AROUND)
            expected = Reading(PRESSURES[unit], 1e5 if mark == "gauge" else 0.0, f"{unit} {mark}")
            assert found == expected, form.format(unit)


NORMAL, PER_MINUTE = 101325 / (287.05 * 273.15), 1e-3 / 60
READ = {  # factor and offset: quantity and units
    (1, 0): "t: sec | sec. | [s]; x: m; P_A: Pa; u: V | VDC | V DC | volts | ±10 V; m_A: kg/s; T: K",
    (1e-3, 0): "t: ms | milliseconds since 2024-05-13 10:00; x: MM; u: mV; m_A: g/s",
    (1e-6, 0): "t: µs; x: µm; m_A: mg/s",
    (3600, 0): "t: h",
    (0.0254, 0): "x: in",
    (1, 273.15): "T: °C | degC | [°C] | C | deg C | ℃",
    (5 / 9, 255.3722222222222): "T: °F | degF",
    (133.322387415, 0): "P_A: mmHg",
    (3386.388640341, 0): "P_A: inHg",
    (101325 / 760, 0): "P_A: Torr",
    (101325, 0): "P_A: atm",
    (9.80665, 0): "P_A: mmH2O",
    (98066.5, 0): "P_A: kgf/cm²",
    (98.0665, 0): "P_A: cmH2O",
    (249.08891, 1e5): "P_A: inH2O(g)",
    (6894.757293168361, 1e5): "P_A: PSIG",
    (1e5, 0): "P_A: Bar | bar, abs",
    (1e3, 1e5): "P_A: kPa-g",
    (0.1, 0): "u: % | percent | % FS | % of full scale",
    (1.25, -15): "u: mA | mA 4..20 | 4-20 mA | mA (4...20)",
    (2, -10): "u: V 0..10 | 0-10 V | 0 to 10 V",
    (0.2, -10): "u: % 0..100",
    (0.5, 0): "u: mA -20..20",
    (20, -10): "u: 0/1 | bool | BOOL",
    (1 / 3600, 0): "m_A: kg/h",
    (NORMAL * PER_MINUTE, 0): "m_A: Nl/min | NL/min | ln/min",
    (NORMAL / 3600, 0): "m_A: Nm3/h",
    (ANR_RHO * PER_MINUTE, 0): "m_A: l/min(ANR) | L/min (ANR) | l/min ANR",
    (ANR_RHO * 1e-3, 0): "m_A: dm³/s(ANR)",
}


@pytest.mark.parametrize(("factor", "offset"), READ)
def test_units_are_read_as_they_are_printed(factor, offset):
    for entry in READ[factor, offset].split("; "):
        quantity, units = entry.split(": ")
        for unit in units.split(" | "):
            found = reading(quantity, unit, AROUND)
            assert isinstance(found, Reading), unit
            assert found[:2] == pytest.approx((factor, offset), rel=1e-12, abs=1e-12), unit


ASKED = [
    ("m_A", "slpm, sccm, l/min", ["unknown unit", "(0 degC, 1.01325 bar)", "(ANR)"]),
    ("P_A", "mPa, barn, bar(x), %, psid", ["unknown unit", "kgf/cm2", "for a gauge bar(g)"]),
    ("t", "weeks, ", ["s, ms, us"]),
    ("P_A", "mA", ["`scale` and `offset`"]),
    ("u", "counts", ["mA 4..20", "`scale`"]),
    ("u", "V 10..0", ["unknown unit"]),
    ("x", "twentieths", ["mm, cm, m"]),
]


@pytest.mark.parametrize(("quantity", "units", "words"), ASKED)
def test_ambiguous_and_unknown_units_are_asked_about_with_what_to_write(quantity, units, words):
    for unit in units.split(", "):
        found = reading(quantity, unit, AROUND)
        assert isinstance(found, str) and "\n" not in found and all(word in found for word in words), found


def columns(*names):
    return columns_by_header([Channel(name, np.arange(3.0)) for name in names])


HEADERS = {  # quantity: header, unit
    "P_A": "P_A_kPa,kPa; P_A [kPa],kPa; P_A (bar(g)),bar(g); /bench/state/P_A_bar,bar",
    "P_s": "P_s_mbar_abs,mbar_abs",
    "T": "T_°C,degC",
    "x": "x_µm,um; field.x_mm,mm",
    "m_A": "m_A (dm³/s(ANR)),dm3/s(ANR); m_A_kg_per_s,kg/s",
    "t": "Zeit [ms],ms; X_Value,",
}


@pytest.mark.parametrize("quantity", HEADERS)
def test_a_header_has_quantity_and_unit(quantity):
    for entry in HEADERS[quantity].split("; "):
        header, unit = entry.split(",")
        assert columns(header) == {quantity: Column(column=header, unit=unit)}


def test_a_name_that_only_begins_like_a_quantity_is_none_and_two_of_one_are_refused():
    assert {*columns("x_mm", "x_ref_mm", "T_%", "u_1", "Temp", "valve", "t_s", "Time [ms]")} == {"x", "t"}
    assert columns("Time [ms]", "t_s")["t"].column == "t_s"
    assert columns("P_A_bar", "x_soll", "x_mm")["x"].column == "x_mm"
    with pytest.raises(InputError, match=r"columns 'P_A_kPa' and 'P_A \[bar\]': both are P_A"):
        columns("t_s", "P_A_kPa", "P_A [bar]")


@pytest.mark.parametrize(("entry", "named"), [("P_C: {column: c}", "P_C"), ("P_A: {column: c}", "P_A.unit")])
def test_an_entry_of_a_mapping_that_is_wrong_is_named(tmp_path, entry, named):
    file, text = tmp_path / "columns.yaml", f"{{{entry}}}"
    file.write_text(text, encoding="utf-8")
    for source, place in ((str(file), file), (text, "--columns")):
        with pytest.raises(InputError) as error:
            read_mapping(source)
        assert str(error.value).startswith(f"{place}: {named}: must be one of {', '.join(QUANTITIES)}")


def test_scale_and_offset_are_of_the_number_in_the_file():
    """4 to 20 mA for 0 to 10 bar of gauge pressure."""
    loop = Column(column="ai3", unit="barg", scale=0.625, offset=-2.5)
    factor, offset, text = loop.reading(Path("a.csv"), "P_A", AROUND)
    assert [factor * mA + offset for mA in (4, 20)] == pytest.approx([1e5, 11e5]) and text == "bar gauge"


@pytest.mark.parametrize(
    ("stamps", "steps"),
    [
        (["31.05.2006 11:59:59,007", "31.05.2006 11:59:59,012"], 0.005),
        (["5/31/2006 11:59:59.007 AM", "5/31/2006 12:00:00.012 PM"], 1.005),
        (["2006-05-31 11:59:59.007", "2006-05-31 11:59:59.012"], 0.005),
        (["12/05/2006 23:59:59.5", "13/05/2006 00:00:00"], 0.5),  # the second shows that the day is first
        (["05/12/2006 11:59:59 PM", "05/13/2006 12:00:00 AM"], 1.0),
        (["05/06/2006 23:59:59", "06/06/2006 00:00:00"], 1.0),  # one second, not one month
    ],
)
def test_the_order_of_day_and_month_is_that_of_the_whole_file(stamps, steps):
    _, t, _ = seconds(Path("a.csv"), Channel("Time", np.array(stamps, dtype=object)), "")
    np.testing.assert_allclose(t, [0, steps], atol=1e-12)


def test_a_missing_stamp_is_no_mistake_in_the_others():
    for stamps in (
        ["", "12/05/2006 23:59:59.5", "n/a", "13/05/2006 00:00:00"],
        ["", "0.5 sec", "n/a", "1.0 sec"],
    ):
        _, t, _ = seconds(Path("a.csv"), Channel("Time", np.array(stamps, dtype=object)), "s")
        np.testing.assert_allclose(t, [np.nan, 0, np.nan, 0.5], atol=1e-12)


def test_a_stamp_that_is_none_is_named():
    for last in ("13/13/2006 00:00:00", "13/05/2006", "later"):
        stamps = np.array(["12/05/2006 23:59:59.5", last], dtype=object)
        with pytest.raises(InputError, match=r"sample 1, column t: '.*': must be a time such as 12/05/2006"):
            seconds(Path("a.csv"), Channel("Time", stamps), "")
