"""Flow through the servo-valve, eqs (1), (2) and (17)."""

import numpy as np
import paper_equations as paper
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from pneumo import testing as some
from pneumo.physics.valve import (
    Gas,
    Valve,
    chamber_flows,
    choked_flow,
    critical_ratio,
    exact_gas,
    laminar_factor,
    mass_flow,
    sonic_coefficient,
)
from pneumo.physics.valve_dynamics import beyond_dead_band

EPS = np.finfo(float).eps
AIR = exact_gas(287.0, 1.4)
RATIOS, AREAS = st.just(0.0) | st.floats(1e-6, 1.0), st.just(0.0) | st.floats(1e-10, 1e-4)
PRINTED = Gas(287.0, 1.4, 0.0404, 0.5283)


def subsonic_scale(A_t, P_u, T_u, gas):
    """Flow if the bracket of eq (1) were 1: the flow is this times the root of a difference of powers."""
    g = gas.gamma
    return A_t * P_u * (2 * g / ((g - 1) * gas.R * T_u)) ** 0.5


def test_constants_of_air_are_the_printed_ones():
    assert f"{critical_ratio(1.4):.4f}" == "0.5283"
    assert f"{sonic_coefficient(287.0, 1.4):.4f}" == "0.0404"


@given(some.gases(), some.pressures(), RATIOS, RATIOS, some.temperatures())
def test_flow_does_not_rise_with_downstream_pressure(gas, P_u, one, other, T_u):
    low, high = sorted((one * P_u, other * P_u))
    scale = subsonic_scale(1e-6, P_u, T_u, gas)
    # The bracket of eq (1) is a difference of powers up to 1: good to 4 ulp of 1, whatever its own size; the
    # sonic branch has powers up to 21 in its coefficient.
    lost = (4 * scale**2 + 64 * mass_flow(1e-6, P_u, low, T_u, gas) ** 2) * EPS
    assert mass_flow(1e-6, P_u, high, T_u, gas) ** 2 <= mass_flow(1e-6, P_u, low, T_u, gas) ** 2 + lost


@given(some.gases(), some.pressures(), some.temperatures())
def test_branches_meet_at_the_critical_ratio(gas, P_u, T_u):
    sonic, subsonic = (
        mass_flow(1e-6, P_u, share * gas.critical_ratio * P_u, T_u, gas) for share in (0.9999999, 1.0000001)
    )
    # The maximum is flat: 1e-7 away the flow differs by about its square. The rest as for the coefficient.
    assert subsonic == pytest.approx(sonic, rel=1e-13 + 16 * EPS * (gas.gamma + 1) / (gas.gamma - 1))


def test_printed_constants_drop_at_the_critical_ratio_and_nowhere_else():
    # Downwards in P_d flow must not drop. With 0.0404 it does, by 0.05 %, where the sonic branch begins.
    P_d = np.linspace(1.0, 0.0, 20001) * 7e5  # in steps that hit 0.5283 P_u
    flow = np.array([mass_flow(1e-6, 7e5, P, 293.0, PRINTED) for P in P_d])
    drops = np.flatnonzero(np.diff(flow) < 0)
    assert len(drops) == 1
    (k,) = drops
    assert P_d[k + 1] / 7e5 <= 0.5283 < P_d[k] / 7e5
    assert f"{100 * (1 - flow[k + 1] / flow[k]):.2f}" == "0.05"
    exact = np.array([mass_flow(1e-6, 7e5, P, 293.0, AIR) for P in P_d])
    assert (np.diff(exact) >= -4 * EPS * exact[1:]).all()  # flat to rounding where it is sonic or nearly so


@given(some.gases(), some.pressures(), some.temperatures(), st.integers(0, 100))
@example(exact_gas(287.0, 4 / 3), 1e5, 293.0, 1)  # (1 - eps)^(2/gamma) is half-way between two floats
def test_flow_is_real_and_forward_however_near_the_pressures(gas, P, T, ulps):
    # A negative bracket would give a complex number in Python and NaN in compiled code.
    flow = mass_flow(1e-6, P, P * (1 - ulps * EPS / 2), T, gas)
    assert isinstance(flow, float)
    assert flow >= 0


@given(some.plants(), some.voltages(), some.pressures(), some.temperatures())
def test_chamber_flows_against_the_literal_equation(plant, u, P, T):
    c = plant.conditions
    P_port = c.P_s if u >= 0 else c.P_atm
    A_t = plant.valve.k_xu * abs(u)
    into = P_port >= P
    P_u, P_d, T_u = (P_port, P, c.T_in) if into else (P, P_port, T)
    m_in, m_out = chamber_flows(u, P, T, Valve(plant.valve.k_xu, 10.0), PRINTED, c)
    literal = paper.mass_flow(A_t, P_u, P_d, T_u, 1.4, 287.0)
    assert (m_out if into else m_in) == 0
    scale = subsonic_scale(A_t, P_u, T_u, PRINTED)
    assert max(m_in, m_out) ** 2 == pytest.approx(literal**2, rel=16 * EPS, abs=4 * EPS * scale**2)


# What a bought valve has beside: ISO 6358's ellipse, asymmetry, leakage


@given(some.pressures(), some.temperatures(), st.floats(0.05, 0.6), st.floats(0.0, 1.0))
def test_ellipse_of_iso_6358(P_u, T_u, b, fraction):
    gas = AIR._replace(critical_ratio=b, elliptic=True)
    ratio = b + fraction * (1 - b)
    choked = choked_flow(1e-6, P_u, T_u, gas)
    flow = mass_flow(1e-6, P_u, ratio * P_u, T_u, gas)
    # (flow / choked)^2 + ((r - b) / (1 - b))^2 = 1; two divisions and a product round, each share <= 1
    assert (flow / choked) ** 2 + fraction**2 == pytest.approx(1, abs=20 * EPS / (1 - b))
    assert mass_flow(1e-6, P_u, 0.9 * b * P_u, T_u, gas) == choked


@given(some.plants(), some.voltages(), some.pressures(), some.temperatures(), st.floats(0.1, 3.0))
def test_exhaust_scales_the_path_to_the_atmosphere_alone(plant, u, P, T, exhaust):
    flows = chamber_flows(u, P, T, plant.valve._replace(exhaust=exhaust), plant.gas, plant.conditions)
    usual = chamber_flows(u, P, T, plant.valve, plant.gas, plant.conditions)
    factor = exhaust if u < 0 else 1.0
    assert flows == pytest.approx([factor * m for m in usual], rel=4 * EPS)  # products in another order


@given(some.plants(), some.voltages(), some.pressures(), some.temperatures(), st.floats(1e-12, 1e-6))
def test_leak_is_a_restriction_to_either_port_beside_the_valve(plant, u, P, T, leak):
    c, gas = plant.conditions, plant.gas
    m_in, m_out = chamber_flows(u, P, T, plant.valve._replace(leak=leak), gas, c)
    open_ = chamber_flows(u, P, T, plant.valve, gas, c)
    ways = [
        (mass_flow(leak, port, P, c.T_in, gas), 0.0) if port >= P else (0.0, mass_flow(leak, P, port, T, gas))
        for port in (c.P_s, c.P_atm)
    ]
    # All flows are proportional to areas; areas are added before, here flows after.
    expected = [sum(path[i] for path in (open_, *ways)) for i in range(2)]
    assert [m_in, m_out] == pytest.approx(expected, rel=8 * EPS)


@given(
    some.plants(),
    some.voltages(),
    some.pressures(),
    some.temperatures(),
    st.floats(1e-12, 1e-6),
    st.booleans(),
)
def test_net_leak_passes_the_difference_of_both_flows(plant, u, P, T, leak, curved):
    valve = plant.valve._replace(leak=leak).with_linearity(0.05 if curved else 0.0)
    m_in, m_out = chamber_flows(u, P, T, valve, plant.gas, plant.conditions)
    net = chamber_flows(u, P, T, valve._replace(net_leak=True), plant.gas, plant.conditions)
    assert net == (max(m_in - m_out, 0), max(m_out - m_in, 0))


@pytest.mark.parametrize("laminar", [1e-3, 0.05])
def test_flow_follows_its_law_but_where_pressures_are_nearly_equal(laminar):
    factors = [laminar_factor(5e5, 5e5 * (1 - part * laminar), laminar) for part in (0.0, 0.25, 1.5, 4.0)]
    assert factors == pytest.approx([0.0, 0.5, 1.0, 1.0], abs=1e-12)


@pytest.mark.parametrize(
    ("u", "seen"), [(-0.5, -0.3), (-0.2, 0.0), (0.0, 0.0), (0.3, 0.0), (0.4, 0.0), (1.0, 0.6)]
)
def test_a_command_within_the_dead_band_is_none_and_beyond_it_less_by_the_band(u, seen):
    assert beyond_dead_band(u, null=0.1, dead_band=0.3) == pytest.approx(seen, abs=1e-15)
    assert beyond_dead_band(u, null=0.1, dead_band=0.0) == u - 0.1
