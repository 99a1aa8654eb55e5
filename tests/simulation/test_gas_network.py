"""A network of gas nodes: the study's own equations, what is conserved, and its limits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paper_study import STUDY
from readable_equations import chamber_rates
from scipy.integrate import cumulative_trapezoid, solve_ivp
from scipy.linalg import expm

from pneumo import testing as some
from pneumo.physics.cylinder import Side, chamber_of, heat_area
from pneumo.physics.models import MODELS, WallLaw, full_order_lane, lane
from pneumo.physics.valve import choked_flow, exact_gas, mass_flow
from pneumo.simulation.gas_network import LAMINAR, Link, Node, fastest_rate, replay

AIR = exact_gas(287.05, 1.4)
H, SAMPLES = 1e-3, 200
ONES = np.ones(SAMPLES)
SUPPLY = (7e5, 293.0)
FULL = full_order_lane(1.4, WallLaw(0.0, 0.0))
MODEL_NAMES = [*MODELS, None]


def node(P=1e5, T=293.0, of=FULL, **wall):
    return Node(of, P, T, 5e5, 293.0, 293.0, **wall)


def of_model(name, n=1.3):
    return lane(MODELS[name], n, 1.4)


@pytest.mark.parametrize("name", MODEL_NAMES)
@pytest.mark.parametrize("u", [4.0, -4.0])
def test_one_chamber_follows_the_equations_of_the_study(name, u):
    plant = next(iter(STUDY.experiments.values())).plant
    plant = plant._replace(k_0=2.0, valve=plant.valve._replace(leak=0.0, laminar=LAMINAR))
    cylinder, c, v, P = plant.cylinder, plant.conditions, 0.3, 3e5
    chamber = chamber_of(cylinder, Side.A)
    lane = of_model(name) if name else full_order_lane(plant.gas.gamma)
    full = bool(lane.full)

    def rates(t, y):
        return chamber_rates(u, v * t, v, y[0], y[-1], chamber, plant, lane)[: len(y)]

    t = H * np.arange(SAMPLES)
    start = [P, 300.0] if full else [P]
    truth = solve_ivp(rates, (0, t[-1]), start, "DOP853", t, rtol=1e-10, atol=1e-4, max_step=H).y
    x = v * t
    V = cylinder.V_d_A + cylinder.A_A * (cylinder.stroke / 2 + x)
    ratio = np.array([heat_area(at, cylinder) for at in x]) / heat_area(0.0, cylinder)
    area = plant.valve.k_xu * abs(u)
    gas_node = Node(lane, P, 300.0, c.P_0, c.T_0, c.T_amb, plant.k_0)
    outside = (c.P_s if u > 0 else c.P_atm, c.T_in)
    got = replay([gas_node], [Link(1, 0)], [outside], V[None], area * ONES[None], plant.gas, H, ratio[None])
    # Fifth-order steps of 1 ms, against pressures that change within 10 ms; the proportional flow near equal
    # pressures has a kink where it begins, which costs an order.
    np.testing.assert_allclose(got.P[0], truth[0], rtol=1e-5)
    if full:
        np.testing.assert_allclose(got.T[0], truth[1], rtol=1e-5)


@settings(max_examples=30, deadline=None)
@given(
    P=st.lists(some.pressures(), min_size=3, max_size=3),
    T=st.lists(some.temperatures(), min_size=3, max_size=3),
    V=st.lists(st.floats(1e-5, 1e-2), min_size=3, max_size=3),
    A=st.lists(st.floats(0.0, 1e-5), min_size=3, max_size=3),
    c=st.floats(1.0, 100.0),
)
def test_mass_and_energy_of_all_nodes_and_stores_are_conserved(P, T, V, A, c):
    nodes = [node(p, t, k_store=2.0, c_store=c) for p, t in zip(P, T, strict=True)]
    links = [Link(0, 1), Link(1, 2, 0.3), Link(2, 0)]
    volumes, areas = np.outer(V, ONES), np.outer(A, ONES)
    r = replay(nodes, links, [], volumes, areas, AIR, H)
    mass = (r.P * volumes / (AIR.R * r.T)).sum(axis=0)
    energy = (r.P * volumes / (AIR.gamma - 1) + c * r.T_store).sum(axis=0)
    # What the steps lose: P and T are integrated, not mass. At most 4e-5 in 300 violent cases.
    np.testing.assert_allclose(mass, mass[0], rtol=1e-4)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-8)


def test_gas_that_fills_a_vessel_brings_its_enthalpy():
    P_1, T_1, T_s = 1e4, 280.0, SUPPLY[1]
    r = replay([node(P_1, T_1)], [Link(1, 0)], [SUPPLY], 1e-3 * ONES[None], 2e-5 * ONES[None], AIR, H)
    # Mass that enters has gamma T_s for its share of the energy; first steps change P by a third.
    expected = AIR.gamma * T_s / (1 + P_1 / r.P[0] * (AIR.gamma * T_s / T_1 - 1))
    np.testing.assert_allclose(r.T[0], expected, rtol=1e-4)
    assert r.P[0, -1] > 5e5 and r.T[0, -1] > 1.35 * T_s


def test_a_check_valve_lets_gas_in_only():
    both = [node(5e5), node(1e5)]
    V, A = 1e-4 * np.ones((2, SAMPLES)), 2e-6 * ONES[None]
    out = replay(both, [Link(1, 0, back=0.0)], [], V, A, AIR, H)
    np.testing.assert_array_equal(out.P, out.P[:, :1] * ONES)
    assert replay(both, [Link(0, 1, back=0.0)], [], V, A, AIR, H).P[1, -1] > 2e5


def test_a_wall_heats_up_to_its_temperature_in_the_time_of_its_conductance():
    V, k, P, T = 1e-4, 2.0, 2e5, 350.0
    r = replay([node(P, T, k_0=k)], [], [], V * ONES[None], np.empty((0, SAMPLES)), AIR, H)
    capacity = P * V / (AIR.R * T) * AIR.R / (AIR.gamma - 1)
    # Constant volume and mass: temperature decays exponentially, steps of fifth order.
    expected = 293.0 + (T - 293.0) * np.exp(-k / capacity * H * np.arange(SAMPLES))
    np.testing.assert_allclose(r.T[0], expected, rtol=1e-9)
    np.testing.assert_allclose(r.P[0] / r.T[0], P / T, rtol=1e-9)


HOT = (5e5, 400.0)  # as warm as the estimate of the fastest rate takes the gas
IN, OUT = Link(1, 0), Link(0, 1)


def hot_node(P=0.9999 * HOT[0], T=HOT[1], lane=FULL, **wall):
    return Node(lane, P, T, *HOT, HOT[1], **wall)


@pytest.mark.parametrize(
    ("node", "links", "area", "decays"),
    [
        (hot_node(), [IN], 1e-6, "P"),
        (hot_node(), [IN, OUT], 1e-6, "P"),  # both areas
        (hot_node(), [OUT._replace(back=3.0)], 1e-6, "P"),  # the larger area of both directions
        (hot_node(), [IN._replace(back=0.2)], 1e-6, "P"),
        (hot_node(HOT[0], 399.0, k_0=3.0), [], 0.0, "T"),
        (hot_node(HOT[0], 399.0, lane=FULL._replace(wall_scale=2.0), k_0=3.0), [], 0.0, "T"),
        (
            hot_node(HOT[0], 399.0, k_store=4.0, c_store=1e6),
            [],
            0.0,
            "T",
        ),  # a store that keeps its temperature
    ],
)
def test_the_longest_step_is_stable_and_not_much_shorter(node, links, area, decays):
    V, areas, end = np.full((1, 2), 1e-4), np.full((len(links), 2), area), {"P": HOT[0], "T": HOT[1]}[decays]
    fastest = fastest_rate([node], links, [HOT], V, areas, AIR)
    h = 1e-3 / fastest  # so short that the decay is exponential
    before, after = end - getattr(replay([node], links, [HOT], V, areas, AIR, h), decays)[0]
    assert 2.0 < np.log(before / after) / h / fastest < 3.3  # where the method's steps cease to be stable


def test_a_replay_ends_where_a_pressure_is_not_positive_and_a_node_is_far_too_fast_for_its_samples():
    V = 1e-4 * np.linspace(1.0, 3.0, SAMPLES)
    isothermal = replay([node(1e5, of=of_model("M1"))], [], [], V[None], np.empty((0, SAMPLES)), AIR, H)
    assert np.isfinite(isothermal.P).all()
    shrunk = replay([node(1e5)], [], [], -V[None] + 2e-4, np.empty((0, SAMPLES)), AIR, H)
    assert np.isnan(shrunk.P[0, -1]) and np.isfinite(shrunk.P[0, 0])
    # A search over a rig's volumes reaches nodes that would take 10^12 steps a sample.
    got = replay([node()], [Link(1, 0)], [SUPPLY], 1e-18 * ONES[None], 1e-6 * ONES[None], AIR, H)
    assert np.isnan(got.P).all() and got.P.shape == (1, SAMPLES)


def test_a_valve_that_opens_linearly_beside_one_that_is_shut_lets_in_its_integral():
    V, opening = 1e-3, 1e-6 * np.linspace(0.0, 1.0, SAMPLES) ** 2
    shut_first = [Link(1, 0), Link(1, 0)]
    r = replay([node(1e5)], shut_first, [SUPPLY], V * ONES[None], np.array([0 * ONES, opening]), AIR, H)
    sonic = choked_flow(1.0, *SUPPLY, AIR)  # all the time, and so independent of the chamber
    let_in = cumulative_trapezoid(opening, dx=H, initial=0)
    np.testing.assert_allclose(r.P[0], 1e5 + AIR.gamma * AIR.R * SUPPLY[1] * sonic * let_in / V, rtol=1e-10)
    assert 1.05e5 < r.P[0, -1] < AIR.critical_ratio * SUPPLY[0]


@pytest.mark.parametrize("b", [np.nan, 0.3])
@pytest.mark.parametrize("ratio", [0.99, 0.6, 0.2])
def test_gas_flows_through_a_link_by_its_law(b, ratio):
    h, P, V, area = 1e-7, ratio * SUPPLY[0], 1e-4, 1e-6
    r = replay([node(P)], [Link(1, 0, b)], [SUPPLY], np.full((1, 2), V), np.full((1, 2), area), AIR, h)
    gas = AIR if np.isnan(b) else AIR._replace(critical_ratio=b, elliptic=True)
    rate = AIR.gamma * AIR.R * SUPPLY[1] * mass_flow(area, SUPPLY[0], P, SUPPLY[1], gas) / V
    assert (r.P[0, 1] - P) / h == pytest.approx(rate, rel=1e-3)  # it hardly changes in so short a step


@pytest.mark.parametrize("c_store", [0.05, 1e-10])  # one so small that it follows at once
def test_a_store_takes_heat_from_the_gas_and_gives_it_to_the_wall(c_store):
    V, P, T, k_0, k_store, k_back = 1e-4, 2e5, 350.0, 0.3, 0.4, 0.7
    gas_node = node(P, T, k_0=k_0, k_store=k_store, c_store=c_store, k_back=k_back)
    r = replay([gas_node], [], [], V * ONES[None], np.empty((0, SAMPLES)), AIR, H)
    capacity = P * V / T / (AIR.gamma - 1)
    rates = [
        [-(k_0 + k_store) / capacity, k_store / capacity],
        [k_store / c_store, -(k_store + k_back) / c_store],
    ]
    for sample in (1, 20, SAMPLES - 1):
        expected = expm(H * sample * np.array(rates)) @ [T - 293.0, 0.0]
        found = [r.T[0, sample] - 293.0, r.T_store[0, sample] - 293.0]
        np.testing.assert_allclose(found, expected, rtol=1e-7)
