"""Stops and configured dead volumes show a wrong zero or scale of x, or stroke, in millimetres."""

import numpy as np
import pytest

from pneumo.configuration.parameters import Sources, load, study
from pneumo.configuration.priors import accuracy
from pneumo.fitting.fit_result import Estimate
from pneumo.fitting.position_checks import (
    dead_volume_notes,
    stated,
    stated_volume_warnings,
    stop_warnings,
    stops_of,
)
from pneumo.fitting.record.measurement import Measurement
from pneumo.quantities.table import SHIFTING
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.plants import configured_plant

PLANT = configured_plant(study(load(TEMPLATE)))
HALF, AREAS = PLANT.cylinder.stroke / 2, (PLANT.cylinder.A_A, PLANT.cylinder.A_B)
STATED = PLANT._replace(cylinder=PLANT.cylinder._replace(V_d_A=4.1e-6, V_d_B=4.9e-6))
NONE = np.zeros((2, 0))


def moved(low, high, pressed=True):
    """Record of a piston that goes from one end to the other and rests on both, perhaps under full force."""
    to_and_fro = [
        np.linspace(low, high, 300),
        np.full(200, high),
        np.linspace(high, low, 300),
        np.full(200, low),
    ]
    x = np.tile(np.concatenate(to_and_fro), 2) + np.random.default_rng(1).normal(0, 2e-5, 2000)
    up = np.tile(np.repeat([True, False], 500), 2)
    most, least = (PLANT.conditions.P_s, PLANT.conditions.P_atm) if pressed else (5e5, 5e5)
    P = np.array([np.where(up, most, least), np.where(up, least, most)])
    return Measurement("m", 1e-3, np.where(up, 10.0, -10.0), x, P)


def released():
    """Comes back by 1 mm as the pressures become equal, and stays there longer than it was pushed."""
    record = moved(-HALF, HALF)
    x, P = record.x.reshape(2, 2, 500).copy(), record.P.reshape(2, 2, 2, 500).copy()
    for way, end in ((0, HALF), (1, -HALF)):
        x[:, way, 100:200], x[:, way, 200:] = end, end - np.sign(end) * 1e-3
        P[:, :, way, 200:] = 4e5
    noise = np.random.default_rng(2).normal(0.0, 2e-5, 2000)
    return record._replace(x=x.ravel() + noise, P=P.reshape(2, -1))


def blocked():
    """Is held halfway, under full force, for longer than it rests at the stops."""
    record = moved(-HALF, HALF)
    x = record.x.reshape(4, 500).copy()
    x[::2, :300] -= np.linspace(-HALF, HALF, 300)
    x[1::2, :300] += np.linspace(-HALF, HALF, 300)
    return record._replace(x=x.ravel())


@pytest.mark.parametrize("record", [moved(-HALF, HALF), released(), blocked()])
def test_stops_are_where_the_piston_rests_under_force(record):
    assert stops_of(record, PLANT) == pytest.approx((-HALF, HALF), abs=1e-4)


NEAR = np.minimum(np.arange(500) * 1e-4, 0.05) - 0.025  # 0.1 mm in each millisecond: no rest


@pytest.mark.parametrize(
    "record",
    [
        moved(-HALF, HALF, pressed=False),
        moved(-HALF, HALF)._replace(x=np.tile(np.concatenate([NEAR, NEAR[::-1]]), 2)),
    ],
)
def test_a_piston_that_does_not_rest_under_force_shows_no_stop(record):
    assert np.isnan(stops_of(record, PLANT)).all()


@pytest.mark.parametrize(
    ("ends", "said"),
    [
        ((-HALF + 5e-3, HALF + 5e-3), "a zero of x off by 5 mm; this moves V_d of A by"),
        ((-1.03 * HALF, 1.03 * HALF), "a stroke 4.8 mm too short or an x 3 % too large; this moves"),
        ((-HALF + 3e-4, HALF + 3e-4), ""),  # within the stated accuracy
    ],
)
def test_stops_that_are_elsewhere_are_said_in_millimetres(ends, said):
    texts = stop_warnings(moved(*ends), PLANT, accuracy())
    assert said in texts[0] if said else texts == []


@pytest.mark.parametrize("wrong", [0.0, 5e-3])
def test_stops_that_give_way_are_where_the_piston_meets_them(wrong):
    record, c = moved(-HALF + wrong, HALF + wrong), PLANT.cylinder
    # Pressures rise once the piston has come to a stop, which gives way by 1.5 mm under the supply's.
    rise, rest = np.minimum(np.arange(500) / 400, 1.0), PLANT.conditions.P_atm
    driving = rest + (PLANT.conditions.P_s - rest) * np.tile(rise, 4)
    up = record.u > 0
    P = np.array([np.where(up, driving, rest), np.where(up, rest, driving)])
    force = c.A_A * P[0] - c.A_B * P[1]
    resting = np.tile(np.arange(500) >= 300, 4)
    pressed = record._replace(x=record.x + np.where(resting, 1.5e-3 * force / np.abs(force).max(), 0.0), P=P)
    assert stops_of(pressed, PLANT) == pytest.approx((-HALF + wrong, HALF + wrong), abs=1.5e-4)
    assert bool(stop_warnings(pressed, PLANT, accuracy())) == bool(wrong)


def found(shift_A, shift_B, half=0.05):
    """Estimate whose dead volumes are off by what these shifts of the piston displace, m."""
    c = STATED.cylinder
    V = {"V_d_A": c.V_d_A + shift_A * c.A_A, "V_d_B": c.V_d_B + shift_B * c.A_B}
    low, high = ({name: value * np.exp(sign * half) for name, value in V.items()} for sign in (-1, 1))
    return Estimate(V, low, high, np.zeros(2), np.zeros(2), NONE)


@pytest.mark.parametrize(
    ("shifts", "shown", "said"),
    [
        ((-5e-3, 5e-3), False, "as a zero of x off by 5 mm would make them, or hoses"),
        ((-3e-3, -3e-3), False, "as a stroke 6 mm too long or an x 3.8 % too small would make them"),
        ((-5e-3, 5e-3), True, "the data sheet is off by"),  # its stops are where they should be
        ((5e-4, -5e-4), False, ""),
        ((5e-4, -5e-4), True, ""),
    ],
)
def test_dead_volumes_that_are_not_those_configured_are_said_in_millimetres(shifts, shown, said):
    texts = stated_volume_warnings(STATED, found(*shifts), accuracy(), shown)
    assert said in texts[0] if said else texts == []
    assert ("zero of x" not in texts[0] and "stroke" not in texts[0]) if said and shown else True


def test_dead_volumes_are_doubted_beyond_what_is_stated_and_only_those():
    shift = 0.3 * STATED.cylinder.V_d_A / AREAS[0]  # 30 % of A, hardly anything of B
    (text,) = stated_volume_warnings(STATED, found(shift, 0.0), accuracy(), True)
    assert text.parameters == ("V_d_A",)
    content = load(TEMPLATE).model_dump(exclude_unset=True)
    content["cylinders"]["mine"]["dead_volume_m3"] = "4.1e-6 ± 40 %"
    known = accuracy(Sources(content).validated())
    assert known["V_d_A"] == known["V_d_B"] == pytest.approx(0.4)
    assert stated_volume_warnings(STATED, found(shift, 0.0), known, True) == []


def test_stops_that_are_elsewhere_concern_dead_volumes_and_what_they_move():
    estimate = found(0.0, 0.0)
    values = estimate.values | {"k_0": 0.3, "k_xu": 1e-6}
    ends = ({name: value * (1 + sign * 0.05) for name, value in values.items()} for sign in (-1, 1))
    shifts = {name: np.zeros(len(SHIFTING)) for name in values}
    shifts["k_0"][SHIFTING.index("the zero of x")] = 0.01  # by 0.5 mm
    estimate = Estimate(values, *ends, np.zeros(2), np.zeros(2), NONE, moved=shifts)
    off = moved(-HALF + 5e-3, HALF + 5e-3)
    (text,) = stop_warnings(off, PLANT, accuracy(), estimate)
    assert {*text.parameters} == {"V_d_A", "V_d_B", "k_0"}
    (text,) = stop_warnings(moved(-1.03 * HALF, 1.03 * HALF), PLANT, accuracy(), estimate)
    assert {*text.parameters} == {"V_d_A", "V_d_B"}


def test_where_nothing_shows_a_wrong_zero_a_note_says_so():
    assert stated(STATED) and not stated(PLANT)
    between = moved(-HALF, HALF, pressed=False)
    (text,) = dead_volume_notes(between, PLANT, accuracy(position_shown=False))
    assert f"1 mm of zero moves V_d of A by {1e3 * AREAS[0]:.2g} cm³" in text
    assert "intervals allow for 5 mm and 0.1 % of scale" in text
    assert dead_volume_notes(moved(-HALF, HALF), PLANT, accuracy()) == []
    assert dead_volume_notes(between, STATED, accuracy()) == []


def test_a_load_pushes_the_piston_too():
    c, air = PLANT.cylinder, PLANT.conditions
    load = 0.4 * (air.P_s - air.P_atm) * min(c.A_A, c.A_B)
    even = moved(-HALF, HALF)
    P = np.array([np.full(2000, c.A_B * 4e5 / c.A_A), np.full(2000, 4e5)])
    P[0] += np.where(even.u > 0, 1.0, -1.0) * load / 2 / c.A_A
    loaded = PLANT._replace(cylinder=c._replace(load=load))
    assert np.isnan(stops_of(even._replace(P=P), PLANT)).all()
    low, high = stops_of(even._replace(P=P), loaded)
    assert np.isnan(low) and high == pytest.approx(HALF, abs=1e-4)
