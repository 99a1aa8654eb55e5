"""Cylinder and chamber: geometry, Newton's law, and the literal eqs (4), (5), (7), (8)."""

import math

import numpy as np
import paper_equations as paper
import pytest
from hypothesis import given
from hypothesis import strategies as st
from model_rates import arguments

from pneumo import testing as some
from pneumo.physics.chamber import dP_dt, dT_dt, wall_conductance, wall_heat
from pneumo.physics.cylinder import Cylinder, acceleration, chamber_of, heat_area, motion, stopped, volume

EPS = np.finfo(float).eps
D = Cylinder(
    0.02, 0.1, math.pi * 1e-4, math.pi * 1e-4, 1.571e-6, 1.571e-6, 1.5, 100.0, -0.05, 0.05
)  # Table 2


def arguments_with_temperature():
    """Arguments of the full-order chamber, temperature a state of its own and no index n."""
    return st.builds(
        lambda a, T: {k: v for k, v in a.items() if k != "n"} | {"T": T}, arguments(), some.temperatures()
    )


def heat_of(a):
    """Wall heat by eqs (7), (8)."""
    PT_ratio = a["P"] * a["T"] / (a["P_0"] * a["T_0"])
    return wall_heat(a["T"], wall_conductance(a["k_0"], a["A_q"] / a["A_q0"], PT_ratio, 1.0, 0.5), a["T_amb"])


def full_order(a):
    """Rates (dP/dt, dT/dt) of the package's chamber."""
    heat = heat_of(a)
    names = ("P", "T", "V", "dV_dt", "m_in", "m_out", "T_in")
    state, g = [a[name] for name in names], a["gamma"]
    return dP_dt(*state, heat, g, g, g, a["R"], g), dT_dt(*state, heat, a["R"], g)


def heat_scale(a):
    """Size of the wall heat before T_amb - T cancels."""
    return heat_of(a | {"T_amb": a["T_amb"] + 2 * a["T"]})


def dP_scale(a):
    """Sum of the sizes of eq (4)'s terms, Pa/s: the scale of its rounding error."""
    flows = a["R"] * (a["m_in"] * a["T_in"] + a["m_out"] * a["T"])
    return (a["gamma"] * (a["P"] * abs(a["dV_dt"]) + flows) + (a["gamma"] - 1) * heat_scale(a)) / a["V"]


def dT_scale(a):
    """Sum of the sizes of eq (5)'s terms, K/s."""
    g, T, P, V = a["gamma"], a["T"], a["P"], a["V"]
    flows = a["R"] * T / P * (a["m_in"] * (g * a["T_in"] + T) + a["m_out"] * T * (g - 1))
    return (T * abs(a["dV_dt"]) * (g - 1) + flows + (g - 1) * T / P * heat_scale(a)) / V


def test_geometry_of_the_printed_cylinders():
    # Dead volume is 10 % of the half-stroke volume, A_q(0) two faces and half the bore's wall: section 2.2.
    assert volume(-D.stroke / 2, chamber_of(D, 0), D) == D.V_d_A
    assert pytest.approx(0.1 * D.A_A * D.stroke / 2, rel=1e-3) == D.V_d_A  # Table 2 prints four digits
    assert heat_area(0.0, D) == pytest.approx(2 * D.A_A + math.pi * D.bore * D.stroke / 2, rel=4 * EPS)
    assert heat_area(-D.stroke / 2, D) == pytest.approx(2 * D.A_A, rel=4 * EPS)  # only the end faces are left


@given(some.cylinders(), some.positions(3.0), some.velocities(), st.floats(-100, 100))
def test_end_stops(cylinder, fraction, v, a):
    x_0, v_0 = stopped(fraction * cylinder.stroke / 2, v, v, cylinder)
    assert cylinder.x_min <= x_0 <= cylinder.x_max
    if abs(fraction) < 1:
        assert (x_0, v_0) == (fraction * cylinder.stroke / 2, v)
        assert motion(x_0, v_0, a, cylinder) == (v, a)
    else:
        side = math.copysign(1, fraction)
        assert x_0 == side * cylinder.stroke / 2
        assert v_0 * side <= 0  # at rest, or already on its way back
        assert motion(x_0, 0.0, side * abs(a) + side, cylinder) == (0, 0)  # pushed onto the stop
        assert motion(x_0, 0.0, -side * abs(a), cylinder) == (0, -side * abs(a))  # pushed off it


@given(arguments_with_temperature())
def test_full_order_rates_and_wall_heat_are_those_of_the_literal_equations(a):
    # Two orders of writing, some 25 roundings of at most half an ulp of the sum of terms.
    rates = zip(full_order(a), paper.full_order(**a), (dP_scale(a), dT_scale(a)), strict=True)
    for ours, literal, scale in rates:
        assert ours == pytest.approx(literal, abs=16 * EPS * scale)
    state = [a[name] for name in ("P", "T", "T_amb", "P_0", "T_0")]
    literal = paper.heat_transfer(*state, a["k_0"] / a["A_q0"], a["A_q"])
    assert heat_of(a) == pytest.approx(literal, rel=8 * EPS)  # five products, a quotient and a root


@given(some.cylinders(), some.pressures(), some.velocities(), st.floats(-1e4, 1e4), st.floats(-1e3, 1e3))
def test_load_is_a_force_that_stays(cylinder, P, v, force, load):
    loaded = cylinder._replace(load=load)
    balanced = acceleration(0.0, P, P, force, loaded)
    assert balanced == (force + load) / cylinder.M
    # Sums in another order: rounded at the size of the largest term.
    scale = (abs(force) + abs(load) + cylinder.k_f * abs(v)) / cylinder.M
    assert acceleration(v, P, P, force, loaded) == pytest.approx(
        acceleration(v, P, P, force + load, cylinder), abs=8 * EPS * scale
    )


@given(some.cylinders(), some.velocities(), st.floats(-1e4, 1e4), st.floats(1e-3, 1e3))
def test_coulomb_friction_opposes_motion_and_holds_what_rests(cylinder, v, force, coulomb):
    free = acceleration(v, 1e5, 1e5, force, cylinder) * cylinder.M
    net = acceleration(v, 1e5, 1e5, force, cylinder._replace(coulomb=coulomb)) * cylinder.M
    if v:
        assert net == pytest.approx(free - math.copysign(coulomb, v), abs=8 * EPS * (abs(free) + coulomb))
    else:
        held = math.copysign(min(coulomb, abs(force)), force)
        assert net == pytest.approx(force - held, abs=8 * EPS * (abs(force) + coulomb))


def test_a_piston_comes_to_rest_only_with_coulomb_friction():
    assert stopped(0.0, -0.1, 0.2, D) == (0.0, -0.1)
    rough = D._replace(coulomb=5.0)
    assert stopped(0.0, -0.1, 0.2, rough) == (0.0, 0.0)
    assert stopped(0.0, 0.1, 0.2, rough) == (0.0, 0.1)
    assert stopped(0.0, 0.1, 0.0, rough) == (0.0, 0.1)  # it has just begun to move
