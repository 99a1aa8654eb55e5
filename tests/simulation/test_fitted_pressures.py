"""Replays of a fit, against SciPy's high-order solver on the readable equations."""

import itertools

import numpy as np
import pytest
from readable_equations import chamber_rates, lane_rate
from scipy.integrate import solve_ivp

from pneumo.physics.cylinder import Chamber, Side, chamber_of
from pneumo.physics.models import MODELS, lane, lane_array
from pneumo.physics.valve import exact_gas
from pneumo.simulation.fitted_pressures import NODES, Inputs, pressures_of_sets, pressures_on_flows

LENGTH = 0.3  # s
V_D = np.array([[8e-6, 12e-6], [10e-6, 10e-6], [3e-5, 2e-6]])  # m^3, by set and chamber
START = np.array([[5e5, 4e5], [3e5, 6e5], [2e5, 2.2e5]])  # Pa
START_T = np.array([[293.0, 300.0], [280.0, 285.0], [310.0, 270.0]])  # K
MOTIONS = (1.0, 1.02)  # of `position`


def on_motions(u, motions, lanes, V_d, plant, h, stride, start, start_T=None, *, P_s=None, **of_sets):
    """Pressures of all sets of parameters on each motion, shape (motion, set, chamber, step)."""
    inputs = [Inputs(u, motion, plant, P_s) for motion in motions]

    def each(values):
        return None if values is None else np.concatenate([values] * len(motions))

    P = pressures_of_sets(
        inputs,
        np.repeat(range(len(motions)), len(lanes)),
        each(lanes),
        each(V_d),
        h,
        stride,
        each(start),
        each(start_T),
        **{name: each(values) for name, values in of_sets.items()},
    )
    return P.reshape(len(motions), len(lanes), *P.shape[1:])


def command(t):
    return 0.2 * np.sin(20 * t) + 0.3  # V; its sign stays: where it changes no method keeps its order


def position(t, size):
    return size * 0.02 * np.sin(9 * t), size * 0.18 * np.cos(9 * t)  # m, m/s


@pytest.fixture
def plant(plant):
    cylinder = plant.cylinder._replace(V_d_B=2 * plant.cylinder.V_d_A)
    gas = exact_gas(plant.gas.R, plant.gas.gamma)  # without the printed constants' jump
    return plant._replace(cylinder=cylinder, gas=gas)


def signals(h):
    at = h * (np.arange(round(LENGTH / h))[:, None] + NODES)
    return command(at), np.array([np.stack(position(at, size), axis=-1) for size in MOTIONS])


def exact(rates, plant, start):
    """Final state of both chambers, on each motion, by a solver of order eight."""
    result = []
    for size in MOTIONS:
        for side in Side:

            def f(t, y, side=side, size=size):
                x, v = position(t, size)
                return rates(side.sign * command(t), side.sign * x, side.sign * v, y, side)

            end = solve_ivp(f, (0, LENGTH), start[side], "DOP853", rtol=1e-11, atol=1e-6, max_step=0.01)
            result.append(end.y[0, -1])
    return np.reshape(result, (len(MOTIONS), 2))


def own_chamber(plant, i, side):
    """Chamber of a set, as `V_D` has it."""
    return Chamber(chamber_of(plant.cylinder, side).area, V_D[i, side])


@pytest.mark.parametrize(("model", "b"), [*((model, None) for model in MODELS), ("M8", 0.2), ("M8", 0.1)])
def test_reduced_models_are_those_of_the_readable_equations(plant, model, b):
    if b:  # the core's polynomial of the flow then has 14 terms, or 18
        plant = plant._replace(gas=plant.gas._replace(critical_ratio=b, elliptic=True))
    u, motions = signals(5e-4)
    rows = [lane(MODELS[model], n, plant.gas.gamma) for n in (1.0, 1.2, 1.35)]
    pressures = on_motions(u, motions, lane_array(rows), V_D, plant, 5e-4, 1, START)
    assert pressures.shape == (2, 3, 2, 601)
    np.testing.assert_array_equal(pressures[..., 0], [START] * 2)
    for i, row in enumerate(rows):

        def rates(u, x, v, y, side, row=row, i=i):
            return [lane_rate(u, x, v, y[0], own_chamber(plant, i, side), plant, row)]

        # A few errors of a third-order step of 5e-4 s: the test of its order says how they fall.
        np.testing.assert_allclose(pressures[:, i, :, -1], exact(rates, plant, START[i, :, None]), rtol=2e-6)


def full_order(plant, h, stride):
    gamma = plant.gas.gamma
    row = lane(MODELS["M10"], 1.0, gamma)._replace(a=0.0)
    u, motions = signals(h)
    return on_motions(u, motions, lane_array([row] * 3), V_D, plant, h, stride, START, START_T)


def test_full_order_chambers_are_those_of_the_readable_equations_at_third_order(plant):
    truth = []
    for i in range(3):

        def rates(u, x, v, y, side, i=i):
            return chamber_rates(u, x, v, y[0], y[1], own_chamber(plant, i, side), plant)

        truth.append(exact(rates, plant, np.stack([START[i], START_T[i]], axis=-1)))
    truth = np.stack(truth, axis=1)
    errors = [
        np.abs(full_order(plant, h, stride)[..., -1] - truth).max() for h, stride in ((1e-3, 1), (5e-4, 2))
    ]
    assert errors[0] < 1.0  # Pa, of 5e5
    assert 6.5 < errors[0] / errors[1] < 9.5  # halved steps: an eighth


def test_flows_in_place_of_a_valve_give_what_the_energy_balance_says(plant):
    h, (_, motions) = 5e-4, signals(5e-4)
    steps, m = len(motions[0]), np.array([2e-4, -1e-4])  # kg/s
    rows = lane_array([lane(MODELS["M3"], 1.0, plant.gas.gamma)] * 3)
    flow = np.broadcast_to(m, (steps, 3, 2))
    pressures = pressures_on_flows(motions[0], flow, rows, V_D, plant, h, 1, START)
    c, gas, T_0 = plant.cylinder, plant.gas, plant.conditions.T_0
    for i, side in itertools.product(range(3), Side):

        def rate(t, P, i=i, side=side):
            x, v = (side.sign * signal for signal in position(t, 1.0))
            area = (c.A_A, c.A_B)[side]
            V = V_D[i, side] + area * (c.stroke / 2 + x)
            return gas.gamma * (gas.R * T_0 * m[side] - P * area * v) / V  # (10), M3

        end = solve_ivp(rate, (0, LENGTH), [START[i, side]], "DOP853", rtol=1e-11, atol=1e-6)
        np.testing.assert_allclose(pressures[i, side, -1], end.y[0, -1], rtol=1e-7)


def test_a_chamber_that_leaves_the_positive_numbers_is_nan_and_its_neighbours_go_on(plant):
    u, motions = signals(5e-4)
    rows = lane_array([lane(MODELS["M3"], 1.0, plant.gas.gamma)] * 3)
    rows[1, 0] = 1e5  # an expansion that no step can follow
    pressures = on_motions(u, motions, rows, V_D, plant, 5e-4, 1, START)
    assert np.isnan(pressures[:, 1, :, -1]).all() and np.isfinite(pressures[:, [0, 2]]).all()


def test_a_supply_that_sags_is_followed(plant):
    h, row = 5e-4, lane(MODELS["M8"], 1.2, plant.gas.gamma)

    def supply(t):
        return plant.conditions.P_s * (0.8 + 0.1 * np.cos(12 * t))

    u, motions = signals(h)
    P_s = supply(h * (np.arange(len(u))[:, None] + NODES))
    pressures = on_motions(u, motions, lane_array([row]), V_D[:1], plant, h, 1, START[:1], P_s=P_s)
    for i, size in enumerate(MOTIONS):

        def rate(t, P, size=size):
            x, v = position(t, size)
            now = plant._replace(conditions=plant.conditions._replace(P_s=supply(t)))
            return [lane_rate(command(t), x, v, P[0], own_chamber(plant, 0, 0), now, row)]

        end = solve_ivp(rate, (0, LENGTH), START[0, :1], "DOP853", rtol=1e-11, atol=1e-6, max_step=0.01)
        np.testing.assert_allclose(pressures[i, 0, 0, -1], end.y[0, -1], rtol=2e-6)  # as above


def test_gas_that_enters_a_chamber_at_supply_pressure_brings_its_temperature(plant):
    """The piston makes room for warm gas, all in implicit steps; how the chamber empties then tells of it."""
    h, opens, length, v = 1e-3, 0.4, 0.6, 0.1  # from `opens` on the valve exhausts and the piston rests
    valve, c = plant.valve._replace(k_xu=10 * plant.valve.k_xu), plant.conditions
    plant = plant._replace(valve=valve, conditions=c._replace(T_in=c.T_in + 80))
    at = h * (np.arange(round(length / h))[:, None] + NODES)
    charging = at[:, :1] < opens - h / 2
    x = -0.03 + v * np.minimum(at, opens)
    motion = np.stack([x, np.where(charging, v, 0.0 * at)], axis=-1)
    u = np.where(charging, 5.0, -0.5 + 0.0 * at)
    row = lane_array([lane(MODELS["M10"], 1.0, plant.gas.gamma)._replace(a=0.0)])
    pressures = on_motions(
        u, motion[None], row, V_D[:1], plant, h, 1, np.array([[6e5, 2e5]]), np.full((1, 2), 293.0)
    )
    y = np.array([6e5, 293.0])
    for first, end, volts, speed in ((0.0, opens, 5.0, v), (opens, length, -0.5, 0.0)):

        def rates(t, y, volts=volts, speed=speed):
            x = -0.03 + v * min(t, opens)
            return chamber_rates(volts, x, speed, y[0], y[1], own_chamber(plant, 0, 0), plant)

        y = solve_ivp(rates, (first, end), y, "Radau", rtol=1e-9, atol=1e-4).y[:, -1]
        error = pressures[0, 0, 0, round(end / h)] - y[0]
        assert abs(error) < 100  # Pa; gas taken as cold as the chamber's: 1.4 kPa at the end


@pytest.mark.parametrize("u", [5.0, -5.0])
def test_gas_that_a_piston_pushes_out_through_a_wide_valve_stays_just_above_the_ports_pressure(plant, u):
    h, steps, v, P_port = 1e-3, 100, -0.1, plant.conditions.P_s if u > 0 else plant.conditions.P_atm
    plant = plant._replace(valve=plant.valve._replace(k_xu=20 * plant.valve.k_xu), k_0=0.0)
    at = h * (np.arange(steps)[:, None] + NODES)
    motion, row = np.stack([0.02 + v * at, v + 0.0 * at], axis=-1), lane(MODELS["M10"], 1.0, plant.gas.gamma)
    start, start_T = np.full((3, 2), 1.02 * P_port), np.full((3, 2), 400.0)  # far from T_0
    rows = lane_array([row._replace(a=0.0)] * 3)
    pressures = on_motions(u + 0.0 * at, motion[None], rows, V_D, plant, h, 1, start, start_T)
    late = h * np.arange(steps // 2, steps + 1)
    for i in range(3):

        def rates(t, y, i=i):
            return chamber_rates(u, 0.02 + v * t, v, y[0], y[1], own_chamber(plant, i, 0), plant)

        first = start[i, 0], start_T[i, 0]
        above = solve_ivp(rates, (0, late[-1]), first, "Radau", late, rtol=1e-9, atol=1e-4).y[0] - P_port
        error = pressures[0, i, 0, steps // 2 :] - P_port - above
        # Explicit and implicit steps alternate: errors are up to two thirds of what is above. A pressure held
        # at the port's would be off by all of it, and explicit steps alone by ten times as much.
        assert np.sqrt((error**2).mean()) < 0.9 * above.min()
        assert np.median(error + above) == pytest.approx(np.median(above), rel=0.05)


@pytest.mark.parametrize("name", ["M7", "M8"])  # gas enters at the chamber's temperature, or at the supply's
@pytest.mark.parametrize("full", [True, False])
def test_supply_temperature_and_exhaust_of_a_set_are_those_of_a_plant_that_has_them(plant, full, name):
    u, motions = signals(5e-4)
    u = np.where(np.arange(len(u))[:, None] % 200 < 100, 2.0, -2.0) + 0.0 * u  # chambers reach both ports
    plant = plant._replace(valve=plant.valve._replace(k_xu=20 * plant.valve.k_xu))
    row = lane_array([lane(MODELS[name], 1.2, plant.gas.gamma)] * 2)
    inputs, starts = (u, motions, row, V_D[:2]), (5e-4, 1, START[:2], START_T[:2] if full else None)
    T_in, exhaust = np.array([330.0, 280.0]), np.array([0.7, 1.4])
    together = on_motions(*inputs, plant, *starts, T_in=T_in, exhaust=exhaust)
    for i in range(2):
        conditions = plant.conditions._replace(T_in=T_in[i])
        own = plant._replace(conditions=conditions, valve=plant.valve._replace(exhaust=exhaust[i]))
        expected = on_motions(*inputs, own, *starts)[:, i]
        np.testing.assert_allclose(together[:, i], expected, rtol=1e-10)
    assert np.abs(together[:, 0] / on_motions(*inputs, plant, *starts)[:, 0] - 1).max() > 0.01


def full_order_rows(plant, count):
    return lane_array([lane(MODELS["M10"], 1.0, plant.gas.gamma)._replace(a=0.0)] * count)


def test_a_set_notices_neither_others_that_meet_their_port_nor_how_many_there_are(plant):
    plant = plant._replace(valve=plant.valve._replace(k_xu=20 * plant.valve.k_xu))
    c, count = plant.conditions, 9
    start = np.tile([0.5 * c.P_s, 2 * c.P_atm], (count, 1))
    start[4, 0] = 0.999 * c.P_s  # the only chamber that meets a port
    u, rest = np.full((1, 3), 5.0), np.full((1, 1, 3, 2), [0.02, 0.0])

    def replayed(sets):
        rows, V_d = full_order_rows(plant, len(sets)), np.full((len(sets), 2), 3e-5)
        T = np.full((len(sets), 2), 293.0)
        return on_motions(u, rest, rows, V_d, plant, 1e-3, 1, start[sets], T)[0]

    together = replayed(np.arange(count))
    for i in (0, 4, 8):
        np.testing.assert_array_equal(together[i], replayed(np.array([i]))[0])
    assert together[4, 0, 1] == pytest.approx(c.P_s, rel=1e-3)
    assert together[4, 0, 1] != start[4, 0] and together[0, 0, 1] < 0.9 * c.P_s


def test_a_pressure_depends_smoothly_on_how_near_the_port_it_starts(plant):
    plant = plant._replace(valve=plant.valve._replace(k_xu=20 * plant.valve.k_xu))
    count = 100
    start = np.tile(plant.conditions.P_s * np.linspace(0.9, 0.99, count)[:, None], 2)
    u, rest = np.full((1, 3), 5.0), np.full((1, 1, 3, 2), [0.02, 0.0])
    V_d, T = np.full((count, 2), 3e-5), np.full((count, 2), 293.0)
    end = on_motions(u, rest, full_order_rows(plant, count), V_d, plant, 1e-3, 1, start, T)[0, :, 0, 1]
    # Steps are explicit at first and implicit at last; less and less of a difference is left, without a jump.
    slope = np.diff(end) / np.diff(start[:, 0])
    assert np.all(np.diff(slope) < 0) and slope[-1] < 0.6 * slope[0]


@pytest.mark.parametrize("z", [-1.5, -1.8])
def test_a_step_to_just_below_zero_pressure_has_failed(plant, z):
    """The polynomial of a third-order step is 0.06 at -1.5 and -0.15 at -1.8."""
    h, c = 1e-3, plant.cylinder
    V = V_D[0, 0] + c.A_A * c.stroke / 2
    motion = np.full((1, 1, 3, 2), [0.0, -z * V / (plant.gas.gamma * c.A_A * h)])
    rows, shut = lane_array([lane(MODELS["M3"], 1.0, plant.gas.gamma)]), np.zeros((1, 3))
    by_valve = on_motions(shut, motion, rows, V_D[:1], plant, h, 1, START[:1])[0, 0, 0, 1]
    by_flow = pressures_on_flows(motion[0], np.zeros((1, 3, 2)), rows, V_D[:1], plant, h, 1, START[:1])[
        0, 0, 1
    ]
    factor = 1 + z + z**2 / 2 + z**3 / 6
    np.testing.assert_allclose([by_valve, by_flow], START[0, 0] * factor if factor > 0 else np.nan, rtol=1e-9)


def test_more_replays_than_the_work_array_holds_are_made_in_turn(plant):
    count = 70  # two motions would be 140 lanes
    u, motions = (signal[..., :4, :] if signal.ndim == 2 else signal[:, :4] for signal in signals(5e-4))
    motions = np.concatenate([motions, 0.9 * motions[:1]])
    rows = lane_array([lane(MODELS["M8"], n, plant.gas.gamma) for n in np.linspace(1.0, 1.4, count)])
    fixed = np.tile(V_D[:1], (count, 1)), plant, 5e-4, 1, np.tile(START[:1], (count, 1))
    together = on_motions(u, motions, rows, *fixed)
    for i in range(3):
        np.testing.assert_array_equal(together[i], on_motions(u, motions[i : i + 1], rows, *fixed)[0])


@pytest.mark.parametrize("full", [True, False])
def test_sets_with_inputs_of_their_own_have_the_pressures_of_each_alone(plant, full):
    u, motions = signals(5e-4)
    valve, c, gas = plant.valve, plant.conditions, plant.gas
    inputs = [
        Inputs(u, motions[0], plant),
        Inputs(-u, motions[1], plant._replace(conditions=c._replace(P_s=1.1 * c.P_s, P_atm=0.9 * c.P_atm))),
        Inputs(u - 0.5, motions[0], plant._replace(valve=valve._replace(k_xu=3 * valve.k_xu, exhaust=0.7))),
        Inputs(u, motions[1], plant._replace(gas=gas._replace(critical_ratio=0.3, elliptic=True))),
        Inputs(u, motions[0], plant._replace(conditions=c._replace(T_in=330.0)), c.P_s + 1e4 * u),
    ]
    inputs_of = np.arange(20) * 7 % 5  # in no order
    rows = lane_array([lane(MODELS["M8"], n, gas.gamma) for n in np.linspace(1.1, 1.4, 20)])
    V_d, start, start_T = (np.resize(values, (20, 2)) for values in (V_D, START, START_T))
    first = start, start_T if full else None
    together = pressures_of_sets(inputs, inputs_of, rows, V_d, 5e-4, 1, *first)
    for i in range(20):
        one = slice(i, i + 1)
        alone = start[one], start_T[one] if full else None
        only = [inputs[inputs_of[i]]]
        P = pressures_of_sets(only, np.zeros(1, int), rows[one], V_d[one], 5e-4, 1, *alone)
        np.testing.assert_allclose(together[i], P[0], rtol=1e-13)  # one factor is rounded differently
