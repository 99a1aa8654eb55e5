"""Ranges of a record for `pneumo show`: units, stops, and pressures above the supply's."""

import numpy as np

from pneumo.fit.record.measurement import Measurement
from pneumo.fit.record.ranges import above_supply, at_stop, ranges_text

SAMPLES = 1000


def record(plant, *, above=0, by=1.2, **changes):
    """Record in mid-stroke at half the supply; P_A is `by` times the supply in the first `above` samples."""
    P = np.full((2, SAMPLES), plant.conditions.P_s / 2)
    P[0, :above] = by * plant.conditions.P_s
    zero = np.zeros(SAMPLES)
    return Measurement("m.csv", 1e-3, zero, zero, P)._replace(**changes)


def test_a_piston_is_at_a_stop_within_2_percent_of_half_the_stroke(plant):
    c = plant.cylinder
    for end, inward in ((c.x_min, 1.0), (c.x_max, -1.0)):
        near, far = (np.full(SAMPLES, end + inward * part * c.stroke / 2) for part in (0.019, 0.021))
        assert at_stop(record(plant, x=near), plant).all() and not at_stop(record(plant, x=far), plant).any()


def test_numbers_are_in_the_units_that_the_text_names(plant):
    P_s, half = plant.conditions.P_s, plant.cylinder.stroke / 2
    x, u = np.linspace(-half / 2, half, SAMPLES), np.linspace(-2.5, 5.0, SAMPLES)
    P = np.array([np.linspace(2e5, 4e5, SAMPLES), np.linspace(1.5e5, 3e5, SAMPLES)])
    text = ranges_text(record(plant, x=x, u=u, P=P, units={"P_B": "psig"}), plant)
    u_text, x_text, A_text, B_text = text.split("; ")
    assert u_text == "u -2.5 to 5 V"
    # 1.5 halves of the stroke are passed, of which the last fiftieth of a half is at the stop.
    assert x_text == f"x {-500 * half:.3g} to {1e3 * half:.3g} mm, at a stop 1 % of the time"
    assert A_text == "P_A 2 to 4 bar"
    assert B_text == f"P_B (read as psi gauge) 1.5 to 3 bar (supply {P_s / 1e5:.3g} bar absolute)"
    measured = record(plant, P_s=np.linspace(5e5, 7e5, SAMPLES), m=P * 0)
    assert ranges_text(measured, plant).startswith("x ")
    assert ranges_text(measured, plant).endswith("(supply 6 bar absolute)")


def test_a_pressure_above_the_supply_is_said_unless_it_is_short(plant):
    P_s = plant.conditions.P_s
    assert above_supply(record(plant, above=5), plant) == []  # half a per cent of the time
    (note,) = above_supply(record(plant, above=20), plant)
    assert note.startswith("P_A is above the configured supply 2 % of the time, up to")
    assert f" {1.2 * P_s / 1e5:.3g} bar, 0 % of that at a stop" in note
    assert above_supply(record(plant, above=SAMPLES, closed=True), plant) == []
    # Sensors of 1 % explain one per cent above the supply's, and not three.
    assert above_supply(record(plant, above=SAMPLES, by=1.01), plant) == []
    (note,) = above_supply(record(plant, above=SAMPLES, by=1.03), plant)
    assert "100 % of the time" in note


def test_a_measured_supply_is_the_one_that_pressures_are_compared_with(plant):
    P_s = plant.conditions.P_s
    higher = record(plant, above=SAMPLES, P_s=np.full(SAMPLES, 1.3 * P_s))
    assert above_supply(higher, plant) == []
    lower = record(plant, P_s=np.full(SAMPLES, 0.4 * P_s))
    notes = above_supply(lower, plant)
    assert [note[:3] for note in notes] == ["P_A", "P_B"]
    assert all("above the measured supply 100 %" in note for note in notes)


def test_the_time_at_a_stop_is_that_of_the_high_pressure_alone(plant):
    x = np.where(np.arange(SAMPLES) < 100, plant.cylinder.x_max, 0.0)
    (note,) = above_supply(record(plant, above=400, x=x), plant)
    assert "40 % of the time" in note and "25 % of that at a stop" in note


def test_a_high_pressure_of_B_alone_is_said(plant):
    swapped = record(plant, above=20)
    (note,) = above_supply(swapped._replace(P=swapped.P[::-1]), plant)
    assert note.startswith("P_B is above the configured supply 2 % of the time")
