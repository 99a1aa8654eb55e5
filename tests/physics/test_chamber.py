"""Cylinder and chamber: geometry, Newton's law, eqs (4), (5), (7), (8), and what they must conserve."""

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

# Wall laws as exponents of A_q/A_q0 and PT/(P_0 T_0).
CONSTANT, AREA_ONLY, FULL = (0.0, 0.0), (1.0, 0.0), (1.0, 0.5)  # eqs (13), (11), (7)


def arguments_with_temperature():
    """Arguments of the full-order chamber, temperature a state of its own and no index n."""
    return st.builds(
        lambda a, T: {k: v for k, v in a.items() if k != "n"} | {"T": T},
        arguments(),
        some.temperatures(),
    )


def heat_of(a, law=FULL):
    PT_ratio = a["P"] * a["T"] / (a["P_0"] * a["T_0"])
    return wall_heat(a["T"], wall_conductance(a["k_0"], a["A_q"] / a["A_q0"], PT_ratio, *law), a["T_amb"])


def full_order(a, heat=None):
    """Rates (dP/dt, dT/dt) of the package's chamber."""
    heat = heat_of(a) if heat is None else heat
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


@given(some.cylinders(), some.positions(1.0))
def test_the_two_chambers_share_the_stroke(cylinder, fraction):
    x = fraction * cylinder.stroke / 2
    V_A, V_B = (volume(s * x, chamber_of(cylinder, side), cylinder) for side, s in enumerate((1, -1)))
    assert V_A > 0 < V_B
    whole = cylinder.V_d_A + cylinder.V_d_B + cylinder.A_A * cylinder.stroke
    assert abs(V_A + V_B - whole) <= 4 * EPS * whole  # six roundings of half an ulp at most


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


@given(arguments_with_temperature())
def test_wall_heat_opposes_the_temperature_difference(a):
    for law in (CONSTANT, AREA_ONLY, FULL):
        heat = heat_of(a, law)
        assert heat * (a["T_amb"] - a["T"]) >= 0
        assert (heat == 0) == (a["k_0"] == 0 or a["T_amb"] == a["T"])
    closed = a | {"dV_dt": 0.0, "m_in": 0.0, "m_out": 0.0}
    for rate in full_order(closed):  # a closed chamber at rest warms up or cools down towards its walls
        assert rate * (a["T_amb"] - a["T"]) >= 0
        assert (rate == 0) == (heat_of(closed) == 0)


@given(arguments_with_temperature())
def test_mass_is_conserved(a):
    # m = P V / (R T), so dm/dt = m (dP/P + dV/V - dT/T), and that is m_in - m_out.
    P, T, V, m = a["P"], a["T"], a["V"], a["P"] * a["V"] / (a["R"] * a["T"])
    dP, dT = full_order(a)
    dm_dt = m * (dP / P + a["dV_dt"] / V - dT / T)
    # Both rates are good to some ulp of the sum of their terms, which cancel here.
    scale = m * (dP_scale(a) / P + abs(a["dV_dt"]) / V + dT_scale(a) / T)
    assert dm_dt == pytest.approx(a["m_in"] - a["m_out"], abs=16 * EPS * scale)


@given(arguments_with_temperature())
def test_energy_is_conserved(a):
    # d(m c_v T)/dt = c_p (m_in T_in - m_out T) + Q - P dV/dt.
    P, T, V, R, g = a["P"], a["T"], a["V"], a["R"], a["gamma"]
    c_p, c_v, m = g * R / (g - 1), R / (g - 1), P * V / (R * T)
    dP, dT = full_order(a)
    inside = c_v * ((a["m_in"] - a["m_out"]) * T + m * dT)
    supplied = c_p * (a["m_in"] * a["T_in"] - a["m_out"] * T) + heat_of(a) - P * a["dV_dt"]
    # Eq (4) says the same without the mass: m c_v T = P V / (gamma - 1).
    by_pressure = (V * dP + P * a["dV_dt"]) / (g - 1)
    scale = c_v * ((a["m_in"] + a["m_out"]) * T + m * dT_scale(a))
    scale += (V * dP_scale(a) + P * abs(a["dV_dt"])) / (g - 1)
    assert inside == pytest.approx(supplied, abs=16 * EPS * scale)  # as above
    assert by_pressure == pytest.approx(supplied, abs=16 * EPS * scale)


@given(arguments_with_temperature())
def test_closed_chamber_without_wall_heat_is_isentropic(a):
    a = a | {"m_in": 0.0, "m_out": 0.0, "k_0": 0.0}
    dP, dT = full_order(a)
    shrinking = a["dV_dt"] / a["V"]
    # d(ln P + gamma ln V) = 0 and d(ln T + (gamma - 1) ln V) = 0, to three or four roundings.
    assert dP / a["P"] == pytest.approx(-a["gamma"] * shrinking, rel=4 * EPS)
    assert dT / a["T"] == pytest.approx(-(a["gamma"] - 1) * shrinking, rel=4 * EPS)


@given(arguments_with_temperature())
def test_closed_chamber_held_at_wall_temperature_is_isothermal(a):
    # Infinite wall heat is whatever holds T: the heat that makes eq (5) zero makes eq (4) keep P V.
    a = a | {"m_in": 0.0, "m_out": 0.0, "T": a["T_amb"]}
    dP, dT = full_order(a, heat=a["P"] * a["dV_dt"])
    rate = abs(a["dV_dt"]) / a["V"]
    # Terms gamma and gamma - 1 times the rate cancel, each with a few roundings.
    assert dP / a["P"] == pytest.approx(-a["dV_dt"] / a["V"], abs=8 * EPS * rate)
    assert dT / a["T"] == pytest.approx(0, abs=8 * EPS * rate)


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
