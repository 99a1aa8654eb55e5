"""Measurements: what is read, and what is wrong with them said by column and line."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from pneumo.engineer.confused_columns import check_columns
from pneumo.engineer.record import Column, read_mapping, read_measurement
from pneumo.errors import InputError
from pneumo.evidence.synthetic_records import synthetic_record

KNOWN = synthetic_record(8)
HALF = KNOWN.configured.cylinder.stroke / 2
ATMOSPHERE = KNOWN.configured.conditions.P_atm


def table():
    t = KNOWN.period * np.arange(len(KNOWN.u))
    return {
        "t_s": t,
        "u_V": KNOWN.u,
        "x_mm": KNOWN.x * 1e3,
        "P_A_kPa": KNOWN.P[0] / 1e3,
        "P_B [bar(g)]": (KNOWN.P[1] - ATMOSPHERE) / 1e5,
    }


def read(tmp_path, columns, **options):
    file = tmp_path / "m.csv"
    pd.DataFrame(columns).to_csv(file, index=False)
    return read_measurement(file, KNOWN.configured, **options)


def changed(old, values, new=None):
    """The table with other values in one column, under a new name where one is given."""
    return dict((new or old, values) if name == old else (name, v) for name, v in table().items())


def at(index, value, name="x_mm"):
    values = np.array(table()[name], dtype=object)
    values[index] = value
    return changed(name, values)


def test_units_of_the_header_are_converted(tmp_path):
    found = read(tmp_path, table())
    assert found.notes == ()
    assert found.period == pytest.approx(KNOWN.period, rel=1e-9)
    # The file holds every digit; units are converted with one rounding or two.
    np.testing.assert_allclose(found.x, KNOWN.x, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(found.P, KNOWN.P, rtol=1e-14)


def test_mapping_and_netcdf_give_the_same_measurement(tmp_path):
    names = {"t": "time", "u": "cmd", "x": "pos", "P_A": "p1", "P_B": "p2"}
    plain = dict(zip(names.values(), [table()["t_s"], KNOWN.u, KNOWN.x, *KNOWN.P], strict=True))
    units = {"t": "s", "u": "V", "x": "m", "P_A": "Pa", "P_B": "Pa"}
    mapping = {q: Column(column=name, unit=units[q]) for q, name in names.items()}
    by_mapping = read(tmp_path, plain, mapping=mapping)
    data = xr.Dataset({q: ("sample", plain[name], {"units": units[q]}) for q, name in names.items()})
    data.to_netcdf(tmp_path / "m.nc")
    by_attribute = read_measurement(tmp_path / "m.nc", KNOWN.configured)
    assert np.array_equal(by_mapping.P, by_attribute.P) and np.array_equal(by_mapping.x, by_attribute.x)


def test_mapping_file(tmp_path):
    file = tmp_path / "columns.yaml"
    file.write_text("P_A: {column: pressure 1, unit: kPa}\n")
    assert read_mapping(file) == {"P_A": Column(column="pressure 1", unit="kPa")}
    file.write_text("P_C: {column: pressure 1, unit: kPa}\n")
    with pytest.raises(InputError, match="P_C"):
        read_mapping(file)


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        (lambda: {k: v for k, v in table().items() if k != "x_mm"}, ["no column x"]),
        (lambda: at(17, "nan"), ["line 19", "column x", "'nan'", "finite"]),
        (lambda: at(17, ""), ["line 19", "empty"]),
        (lambda: at(500, table()["t_s"][499], "t_s"), ["line 502", "must increase"]),
        (lambda: changed("t_s", table()["t_s"] + (np.arange(len(KNOWN.u)) > 499)), ["line 502", "gap"]),
        (lambda: changed("t_s", table()["t_s"], "t_h"), ["unknown unit 'h'"]),
        (lambda: changed("t_s", table()["t_s"], "t"), ["no unit"]),
        (lambda: changed("P_A_kPa", KNOWN.P[0] / 1e3, "P_A_Pa"), ["column P_A", "kPa for Pa"]),
        (lambda: changed("P_A_kPa", KNOWN.P[0]), ["column P_A", "Pa for kPa"]),
        (lambda: changed("P_A_kPa", 0 * KNOWN.P[0]), ["column P_A", "absolute"]),
        (lambda: changed("x_mm", 1e3 * (KNOWN.x + HALF)), ["outside the stroke", "--x-from end"]),
        (lambda: changed("u_V", 0 * KNOWN.u), ["column u", "every sample"]),
        (lambda: table() | {"v_mm/s": -np.gradient(KNOWN.x * 1e3, KNOWN.period)}, ["column v"]),
    ],
)
def test_each_mistake_in_a_file_gives_one_line(tmp_path, columns, words):
    with pytest.raises(InputError) as caught:
        read(tmp_path, columns())
    text = str(caught.value)
    assert "\n" not in text and all(word in text for word in ["m.csv", *words]), text


def test_position_from_the_end(tmp_path):
    found = read(tmp_path, changed("x_mm", 1e3 * (KNOWN.x + HALF)), from_end=True)
    np.testing.assert_allclose(found.x, KNOWN.x, atol=1e-15)


def test_uneven_time_is_noted(tmp_path):
    t = table()["t_s"] + np.random.default_rng(0).uniform(-0.3, 0.3, len(KNOWN.u)) * KNOWN.period
    assert "not uniform" in read(tmp_path, changed("t_s", t)).notes[0]


def test_confused_columns_are_refused(tmp_path):
    right = read(tmp_path, table())
    check_columns(right, KNOWN.configured)
    for confused, words in (
        (right._replace(P=right.P[::-1]), "swapped"),
        (right._replace(u=-right.u), "column u"),
        (right._replace(x=-right.x), "column x"),
        (right._replace(P=right.P - ATMOSPHERE), "gauge"),
    ):
        with pytest.raises(InputError, match=words):
            check_columns(confused, KNOWN.configured)
