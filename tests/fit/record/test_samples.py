"""Samples of a table in memory: too few, missing, at uneven times or with time stamps."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from pneumo.errors import InputError
from pneumo.fit.record.measurement import read_measurement

PERIOD, ROWS = 2e-3, 200
T = PERIOD * np.arange(ROWS)
CLOCK = pd.Timestamp("2024-10-27T02:59:59.9+02:00") + pd.to_timedelta(T, unit="s")


@pytest.fixture
def frame(plant):
    """Record of a piston in half of its stroke; every sample of the command differs from the others."""
    wave, c = np.sin(10 * T), plant.conditions
    P = (c.P_atm + c.P_s) / 2 + 0.4 * (c.P_s - c.P_atm) * wave
    x = 0.25 * plant.cylinder.stroke * wave
    return pd.DataFrame(
        {"t_s": T, "u_V": np.linspace(-1.0, 1.0, ROWS), "x_m": x, "P_A_Pa": P, "P_B_Pa": P[::-1]}
    )


def put(frame, column, values):
    """The frame with other values, by number of the sample, in one column."""
    changed = frame.astype({column: object})
    for k, value in values.items():
        changed.loc[k, column] = value
    return changed


def refusal(frame, plant):
    with pytest.raises(InputError) as error:
        read_measurement(frame, plant)
    return str(error.value)


def test_samples_of_a_table_in_memory_are_named_by_number_with_what_is_wrong(frame, plant):
    text = refusal(put(frame, "x_m", {17: "off"}), plant)
    assert text == "record: sample 17, column x: 'off': must be a finite number"
    assert refusal(put(frame, "x_m", {17: "off", 20: "off", 30: "off"}), plant).endswith("number, and 2 more")
    assert "sample 5, column t: 'empty': must" in refusal(put(frame, "t_s", {5: ""}), plant)
    long = "begins to f" + "-" * 30 + "ends with the end"
    assert "'begins to ...ends with the end': must" in refusal(put(frame, "x_m", {17: long}), plant)


def test_a_hundred_samples_are_enough(frame, plant):
    assert len(read_measurement(frame[:100], plant).u) == 100
    assert refusal(frame[:99], plant) == "record: 99 samples: must be at least 100"


def test_a_table_without_a_sample_is_refused(frame, plant):
    for empty in (frame.iloc[:0], frame.iloc[:0].astype(object)):
        assert refusal(empty, plant) == "record: 0 samples: must be at least 100"


def test_one_sample_in_a_hundred_may_be_missing(frame, plant):
    found = read_measurement(put(frame, "x_m", {50: "", 150: "n/a"}), plant)
    assert found.notes == ("column x: 2 of 200 samples missing, interpolated",)
    assert found.x[50] == pytest.approx((frame["x_m"][49] + frame["x_m"][51]) / 2, rel=1e-12)
    text = refusal(put(frame, "x_m", {50: "", 100: "", 150: ""}), plant)
    assert text.startswith("record: sample 50, column x: 3 of 200 samples are missing: must be at most 1 %")


def test_a_missing_command_is_the_one_before_or_the_first_that_is_there(frame, plant):
    u = frame["u_V"].to_numpy()
    expected = np.array([u[1], *u[1:100], u[99], *u[101:]])
    assert np.array_equal(read_measurement(put(frame, "u_V", {0: "", 100: ""}), plant).u, expected)


def test_a_command_is_held_at_uneven_times(frame, plant):
    """Sample 50 is late by what rounding may do, 100 by a part of a period; 150 is early."""
    late = np.zeros(ROWS)
    late[[50, 100, 150]] = 0.0005, 0.3, -0.3
    u = frame["u_V"].to_numpy()
    found = read_measurement(frame.assign(t_s=5.0 + T + PERIOD * late), plant)
    assert np.array_equal(found.u, np.where(np.arange(ROWS) == 100, u[99], u))
    assert found.period == pytest.approx(PERIOD, rel=1e-9) and found.begins == (0,)


def test_a_table_may_be_a_dataset_or_have_its_time_as_index(frame, plant):
    expected = read_measurement(frame, plant)
    # Numbers and tables in a dataset are no signals, even if they are named as one.
    data = xr.Dataset({name: ("row", values) for name, values in frame.items()})
    data["T_K"], data["v_m/s"] = 290.0, (("row", "sensor"), np.zeros((ROWS, 2)))
    for table in (frame.set_index("t_s"), data):
        found = read_measurement(table, plant)
        assert np.array_equal(found.P, expected.P) and np.isnan(found.T) and found.v is None


@pytest.mark.parametrize("write", [lambda stamps: stamps, lambda stamps: [s.isoformat() for s in stamps]])
def test_time_stamps_count_from_the_first(frame, plant, write):
    found = read_measurement(frame.assign(t_s=write(CLOCK)), plant)
    assert found.period == pytest.approx(PERIOD, rel=1e-9)
    again = [*CLOCK[:10], CLOCK[9], *CLOCK[11:]]
    text = refusal(frame.assign(t_s=write(again)), plant)
    assert text == "record: sample 10, column t: 0.018 s follows 0.018 s: time must increase"


def test_clocks_may_be_put_back_and_a_wrong_stamp_is_refused(frame, plant):
    """After 0.1 s summer time ends."""
    stamps = [s.isoformat() for s in CLOCK.tz_convert("Europe/Berlin")]
    assert {stamp[-6:] for stamp in stamps} == {"+02:00", "+01:00"}
    assert read_measurement(frame.assign(t_s=stamps), plant).period == pytest.approx(PERIOD, rel=1e-9)
    stamps[17] = "off"
    stamps[40] = "2024-10-27 at three"
    text = refusal(frame.assign(t_s=stamps), plant)
    assert text.startswith("record: sample 17, column t: 'off': must be a time stamp such as ")
    assert text.endswith(", and 1 more")


def test_a_velocity_is_not_compared_with_a_piston_that_is_held(frame, plant):
    held = frame.drop(columns="u_V").assign(x_m=0.01, v_m_per_s=1e-3 * np.sin(T))
    assert read_measurement(held, plant, closed=True).v is not None


def test_numbers_that_could_be_years_are_no_time_stamps(frame, plant):
    text = frame.rename(columns={"t_s": "t_ms"}).assign(t_ms=[str(2000 + k) for k in range(ROWS)])
    assert read_measurement(text, plant).period == pytest.approx(1e-3, rel=1e-9)


def test_columns_are_listed_where_some_are_missing(frame, plant):
    foreign = {f"channel {k}": frame["x_m"] for k in range(1, 9)}
    columns = {"t_s": T, "the first column of the whole record": T} | foreign
    columns |= {"P_A_Pa": frame["P_A_Pa"], "P_B_Pa": frame["P_B_Pa"], "more": T}
    text = refusal(pd.DataFrame(columns), plant)
    assert "no column x, u: must have a header such as x_m, or" in text
    listed = ", ".join(["t_s", "the first ... the whole record", *foreign, "P_A_Pa", "P_B_Pa"])
    assert f"; columns: {listed}; if the valve" in text
