"""Parts of a fit of closed chambers: what is fitted, on which scale, and notes, without a search."""

import numpy as np
import pytest

from pneumo.catalogue import default_conductance
from pneumo.fit.closed import closed_fit
from pneumo.fit.closed.closed_fit import HELD, MOST_SAMPLES, closed_records, fit_closed
from pneumo.fit.closed.thermal_laws import HIGH, LAWS, LOW, ClosedRecord
from pneumo.fit.record.measurement import Measurement

T = 5e-3 * np.arange(400)
LAW = "wall heat, area and root of PT"


def measurement(motion):
    x = motion * np.sin(5 * T)
    return Measurement("m.csv", 5e-3, 0 * T, x, np.array([4e5 - 1e6 * x, 4e5 + 1e6 * x]), closed=True)


def record_of(plant, motion=0.05):
    """Record without noise: nothing to be smoothed."""
    m, c, gas, at = measurement(motion), plant.cylinder, plant.gas, plant.conditions
    size = (c.A_A, c.A_B), c.bore, c.stroke
    of_plant = gas.R, gas.gamma, at.T_amb, at.P_0 * at.T_0
    return ClosedRecord(m.name, m.t, m.x + c.stroke / 2, m.P, *size, *of_plant)


@pytest.fixture
def record(plant):
    return record_of(plant)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("chambers", [(0, 1), (1,)])
def test_a_law_is_fitted_with_what_it_has_of_the_chambers_that_are_seen(law, chambers, plant, record):
    names = closed_fit._problem(law, record, plant, 240, chambers).names
    sides = ["AB"[side] for side in chambers]
    expected = {f"{name}_{side}" for name in ("V_d", "start") for side in sides} | {"leak"}
    if "wall" in law:
        expected |= {f"{name}_{side}" for name in ("k", "first") for side in sides}
    assert set(names) == expected | ({"n"} if law == "free n" else set())


def test_of_a_piston_that_is_held_the_configured_dead_volumes_are_taken(plant):
    record, noisy = closed_records(measurement(0.0), plant)
    problem = closed_fit._problem(LAW, record, plant, 240, (0, 1))
    assert noisy == [] and not {"V_d_A", "V_d_B"} & set(problem.names)
    assert problem.known == {"V_d_A": plant.cylinder.V_d_A, "V_d_B": plant.cylinder.V_d_B}
    assert record.x.tolist() == [plant.cylinder.stroke / 2] * len(T)


def test_parameters_have_the_scale_that_this_plant_lets_expect(plant, record):
    problem, c = closed_fit._problem(LAW, record, plant, 240, (0, 1)), plant.cylinder
    k_0 = default_conductance(c).k_0
    # A leak of one scale moves as much gas in the record as its difference of pressure is in a chamber.
    V = c.V_d_A + c.A_A * c.stroke / 2
    leak = V / (plant.gas.R * plant.conditions.T_amb * T[-1])
    expected = {"V_d_A": c.V_d_A, "V_d_B": c.V_d_B, "k_A": k_0, "k_B": k_0, "leak": leak}
    assert problem.scales == pytest.approx(expected, rel=1e-9)
    for name in (*problem.names, "n"):
        begin = problem.guess.get(name, 1.0)
        assert LOW.get(name, 0.0) < begin < HIGH.get(name, np.inf)
    assert problem.guess["leak"] < 0.1  # a piston's seal is nearly tight


@pytest.mark.parametrize(("fitted", "every"), [(240, 1), (2 * MOST_SAMPLES - 1, 1), (2 * MOST_SAMPLES, 2)])
def test_samples_are_left_out_of_long_records_alone(fitted, every, plant, record):
    assert closed_fit._problem(LAW, record, plant, fitted, (0, 1)).every == every


class Reached(Exception):
    pass


@pytest.mark.parametrize(("part", "fitted"), [(1.0, 400), (0.6, 240), (0.5, 201)])
@pytest.mark.parametrize("motion", [0.0, 0.05])
def test_the_first_part_of_a_record_is_fitted_with_the_laws_that_its_motion_shows(
    part, fitted, motion, plant, monkeypatch
):
    def reached(name, _record, _plant, count, chambers):
        raise Reached(name, count, chambers)

    monkeypatch.setattr(closed_fit, "closed_records", lambda *_: (record_of(plant, motion), []))
    monkeypatch.setattr(closed_fit, "check_closed", lambda *_: ([0, 1], []))
    monkeypatch.setattr(closed_fit, "_problem", reached)
    first = next(iter(LAWS)) if motion else HELD[0]
    with pytest.raises(Reached) as caught:
        fit_closed(measurement(motion), plant, part=part)
    assert caught.value.args == (first, fitted, [0, 1])
