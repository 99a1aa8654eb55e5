"""What is refused of closed chambers, left out and warned of, on either side of each limit."""

import numpy as np
import pytest

from pneumo.errors import InputError
from pneumo.fit.closed.closed_warnings import check_closed, closed_warnings
from pneumo.fit.closed.thermal_laws import ClosedRecord
from pneumo.fit.fit_result import Estimate
from pneumo.fit.record.measurement import Measurement
from pneumo.fit.residuals import Residual

SAMPLES = 1000
T = 5e-3 * np.arange(SAMPLES)
LAW = "wall heat, constant"


def compressed(plant, n=(1.2, 1.2), part=0.5, **changes):
    """Measurement of chambers in which P V^n is constant, with 200 Pa of noise."""
    c = plant.cylinder
    x = part * c.stroke / 2 * np.sin(2 * T)
    V = np.array([c.V_d_A + c.A_A * (c.stroke / 2 + x), c.V_d_B + c.A_B * (c.stroke / 2 - x)])
    P = 4e5 * (V / V.mean(axis=1, keepdims=True)) ** -np.array(n)[:, None]
    P = P + np.random.default_rng(1).normal(0.0, 200.0, P.shape)
    return Measurement("m.csv", 5e-3, 0 * T, x, P, closed=True)._replace(**changes)


def checked(plant, measurement, check=True):
    m, c = measurement, plant.cylinder
    record = ClosedRecord(m.name, m.t, m.x + c.stroke / 2, m.P, (c.A_A, c.A_B), c.bore, c.stroke)
    return check_closed(record, plant, measurement, check)


def commanded(plant, part, seldom):
    """Command of a part of its limit in a part of the samples."""
    return np.where(np.arange(SAMPLES) < seldom * SAMPLES, part * plant.valve.u_max, 0.0)


def test_closed_chambers_that_follow_the_piston_are_fitted_without_notes(plant):
    assert checked(plant, compressed(plant)) == ([0, 1], [])


def test_a_command_is_refused_unless_it_is_small_or_short(plant):
    for part, seldom in ((0.01, 1.0), (1.0, 0.005)):
        chambers, (note,) = checked(plant, compressed(plant, u=commanded(plant, part, seldom)))
        assert chambers == [0, 1] and note.startswith("command or flows are not zero: not used")
    driven = compressed(plant, u=-commanded(plant, 0.05, 0.05))
    with pytest.raises(InputError, match=r"m\.csv: column u: beyond 2 % of u_max in 5 % of samples"):
        checked(plant, driven)
    assert checked(plant, driven, check=False)[0] == [0, 1]
    for signal in ({"u": -commanded(plant, 0.01, 1.0)}, {"m": np.full((2, SAMPLES), -1e-6)}):
        assert "not zero" in checked(plant, compressed(plant, **signal))[1][0]
    assert checked(plant, compressed(plant, m=np.zeros((2, SAMPLES))))[1] == []


@pytest.mark.parametrize(("side", "name"), [(0, "P_A"), (1, "P_B")])
def test_a_chamber_that_hardly_follows_the_piston_is_open_and_left_out(plant, side, name):
    n = [1.2, 1.2]
    n[side] = 0.05  # of a change of volume, in ln P; a closed chamber has 1 to 1.4
    chambers, (note,) = checked(plant, compressed(plant, n))
    assert chambers == [1 - side]
    assert note.startswith(f"{name} hardly follows the piston: the chamber is open: not fitted")
    n[side] = 0.3
    assert checked(plant, compressed(plant, n)) == ([0, 1], [])


def test_chambers_that_rise_as_they_grow_look_swapped(plant):
    wrong = compressed(plant, (-1.2, -1.2))
    with pytest.raises(InputError, match=r"m\.csv: P_A rises as its chamber grows: columns P_A and P_B look"):
        checked(plant, wrong)
    assert checked(plant, wrong, check=False) == ([0, 1], [])
    # Of a piston that hardly moves, heat alone may do this.
    assert checked(plant, compressed(plant, (-1.2, -1.2), part=0.02)) == ([0, 1], [])


def test_a_pressure_within_its_noise_is_left_out_and_two_are_refused(plant):
    m = compressed(plant)
    noise = np.random.default_rng(2).normal(4e5, 200.0, SAMPLES)
    chambers, (note,) = checked(plant, m._replace(P=np.array([m.P[0], noise])))
    assert chambers == [0] and note.startswith("P_B does not change beyond its noise: not fitted, but gas")
    with pytest.raises(InputError, match=r"P_A does not .*, P_B does not .*: nothing to fit; move"):
        checked(plant, m._replace(P=np.array([noise, noise])))


def test_a_pressure_that_lags_its_volume_by_a_quarter_of_a_period_is_not_swapped(plant):
    m = compressed(plant)
    late = 4e5 * (1 + 0.2 * np.sin(2 * T + np.array([[np.pi / 2], [-np.pi / 2]])))
    assert checked(plant, m._replace(P=late)) == ([0, 1], [])


def said(plant, ratio=1.0, factor=1.1, n=1.2, k_0=(0.2, 0.2), coloured=0.0):
    """Warnings of a law by the ratio of its V_d to the configured one and the factor of its intervals."""
    none = np.zeros((2, 0))
    values = {"k_0_A": k_0[0], "k_0_B": k_0[1], "V_d_A": ratio * plant.cylinder.V_d_A}
    low, high = ({name: value * f for name, value in values.items()} for f in (1 / factor, factor))
    wall = Estimate(values, low, high, np.full(2, 200.0), np.full(2, 200.0), none)
    free = Estimate({"n": n}, {}, {}, np.full(2, 1e3), np.full(2, 1e3), none)
    split = {LAW: {"A": Residual(2e3, coloured, 1e3), "B": Residual(1e3, 0.0, 1e3)}}
    return closed_warnings({LAW: wall, "free n": free}, split, plant)


def test_a_fit_that_is_determined_and_likely_has_no_warning(plant):
    assert said(plant) == said(plant, ratio=1.99) == said(plant, ratio=0.501) == said(plant, n=1.0) == []


def test_each_doubt_of_closed_chambers_is_said(plant):
    (large,) = said(plant, ratio=2.01)
    assert large.startswith("fitted the dead volume of A is 2 times")
    # Three between both ends is vague: a factor of 1.7 to either side is not.
    assert said(plant, factor=1.7) == []
    assert [text[:31] for text in said(plant, factor=1.8)] == ["this record does not determine "] * 3
    bounded, small = said(plant, ratio=0.01005)  # the search goes down to a hundredth
    assert "dead volume of A is on the bound of the search" in bounded
    assert small.startswith("fitted the dead volume of A is 0.01 times")
    (small,) = said(plant, ratio=0.0102)
    (index,) = said(plant, n=1.5)
    assert index.startswith("n = 1.5 is outside 1 to 1.4: no n describes")
    (residual,) = said(plant, coloured=410.0)
    assert residual.startswith("P_A: wall heat, constant is off by 2 kPa rms, of which 0.41 kPa")
    # Intervals of 10 % to either side: up to 0.22, and from 0.24 / 1.1 = 0.218 or 0.25 / 1.1 = 0.227 on.
    assert said(plant, k_0=(0.2, 0.24)) == []
    apart = said(plant, k_0=(0.2, 0.25))
    assert len(apart) == 1 and apart[0].startswith("the intervals of k_0 of A and of B do not overlap")
