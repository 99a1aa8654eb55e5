"""Parameters of a fit on the scale of their search: bounds, priors, starts, and a supply that sags."""

import numpy as np
import pytest

from pneumo import simulate
from pneumo.configuration.parameters import accuracy
from pneumo.fit.fit_problem import (
    FULL,
    SUPPLY_LINE,
    Problem,
    opened,
    priors,
    replayed_pressures,
    sagging_supply,
    search_value,
    si_value,
    with_causes,
)
from pneumo.fit.fit_result import Reference
from pneumo.fit.fitted_parameters import CAUSES, PARAMETERS, QUANTITIES
from pneumo.fit.measurement_fit import references
from pneumo.fit.stage_signals import stage_signals
from pneumo.physics.models import MODELS

SAMPLES = 2000  # of 1 ms


def problem_of(plant, u=5.0, P=(3e5, 4e5), **changes):
    P = np.broadcast_to(np.array(P)[:, None], (2, SAMPLES))
    signals = stage_signals(1e-3, np.full(SAMPLES, u), np.zeros(SAMPLES), P, plant)
    return Problem(FULL, plant, signals, {}, **changes)


def test_every_search_can_take_its_start_and_its_bounds_on_its_scale(plant):
    problem = problem_of(plant, also=CAUSES)
    assert {*CAUSES} <= {*problem.names}
    low, high = problem.bounds()
    guess = problem.guess()
    assert np.isfinite(low).all() and np.isfinite(high).all()
    assert np.all((low < guess) & (guess < high))
    for name in PARAMETERS:
        assert si_value(name, search_value(name, 0.3)) == pytest.approx(0.3, rel=1e-12)
        assert name in QUANTITIES
    for name in ("sag", "piston_leak", "valve_leak"):  # parts of a whole
        assert 0 == PARAMETERS[name].search.low < PARAMETERS[name].search.high < 1


def test_a_search_begins_at_the_configured_values_and_the_first_pressures(plant):
    problem = problem_of(plant)
    signals = problem.signals._replace(P=problem.signals.P + np.where(np.arange(SAMPLES) < 2, 0.0, 1e5))
    values = problem._replace(signals=signals).values(problem._replace(signals=signals).guess())
    assert (values["start_A"], values["start_B"]) == pytest.approx((3e5, 4e5), rel=1e-9)  # of the first 2 ms
    assert (values["V_d_A"], values["k_xu"]) == pytest.approx(
        (plant.cylinder.V_d_A, plant.valve.k_xu), rel=1e-9
    )


def test_a_parameter_on_a_bound_is_named_unless_it_begins_at_zero(plant):
    problem = problem_of(plant, also=("sag",))
    low, high = problem.bounds()
    within = 0.5 * (low + high)
    assert problem.at_bound(within) == ()
    assert {*problem.at_bound(high)} == {*problem.names}
    at_low = {*problem.at_bound(low)}
    assert at_low == {*problem.names} - {"lag", "sag"} and "dead_time" in at_low
    for part, reached in ((0.02, ()), (0.005, ("k_0",))):
        theta = within.copy()
        i = problem.names.index("k_0")
        theta[i] = high[i] - part * (high[i] - low[i])
        assert problem.at_bound(theta) == reached


def test_an_interval_is_compared_with_the_search_and_with_what_is_stated(plant):
    known = accuracy()._replace(T_in=3.0, exhaust=0.05)
    prior = priors(plant, problem_of(plant).signals, known, 700.0)
    widths = references(problem_of(plant, priors=prior, also=("P_s",)), known)
    c = plant.conditions
    assert widths["null"] == Reference(pytest.approx(0.2 * plant.valve.u_max), np.inf)
    assert widths["T_in"] == Reference(pytest.approx(0.45 * c.T_in), 6.0)
    assert widths["exhaust"] == Reference(pytest.approx(np.log(25)), 0.1)
    assert widths["P_s"].stated == np.inf  # fitted freely


def test_a_prior_holds_its_parameter_unless_that_is_fitted_freely(plant):
    known = accuracy()
    prior = priors(plant, problem_of(plant).signals, known, 700.0)
    assert "b" not in prior  # of a valve by ISO 6358 alone
    elliptic = plant._replace(gas=plant.gas._replace(elliptic=True))
    assert "b" in priors(elliptic, problem_of(plant).signals, known, 700.0)
    measured = problem_of(plant).signals._replace(P_s=np.full(SAMPLES, 7e5))
    assert "P_s" not in priors(plant, measured, known, 700.0)
    P_s = prior["P_s"]
    assert P_s.centre == np.log(plant.conditions.P_s)
    assert 1.96 * P_s.deviation == pytest.approx(known.P_s, rel=1e-12)  # an accuracy is a 95 % interval
    assert P_s.weight == pytest.approx((700.0 / plant.conditions.P_s / P_s.deviation) ** 2, rel=1e-12)

    problem = problem_of(plant, priors=prior)
    theta = problem.guess() + 0.1
    distances, weights = problem.prior_terms(theta)
    _, freed = problem._replace(also=("exhaust",)).prior_terms(theta)
    for i, name in enumerate(problem.names):
        if name not in prior:
            assert weights[i] == 0
        else:
            assert weights[i] == prior[name].weight > 0
            assert distances[i] == pytest.approx(theta[i] - prior[name].centre, rel=1e-12)
        assert freed[i] == (0.0 if name == "exhaust" else weights[i])
    assert problem._replace(also=("exhaust",)).names == problem.names


def test_a_supply_sags_by_its_fraction_at_full_flow_after_its_time_constant(plant):
    sag, P_s = 0.2, plant.conditions.P_s
    b, u_max = plant.gas.critical_ratio, plant.valve.u_max

    def supplied(u, P):
        signals = problem_of(plant, u, P).signals
        return sagging_supply(signals, signals.u, plant, sag), signals.h

    choked, free = 0.5 * b * P_s, (0.5 + 0.5 * b) * P_s  # the second is half way from b to the supply
    pressure, h = supplied(u_max, (choked, free))
    np.testing.assert_array_equal(pressure, pressure[:, :1] * np.ones(3))
    # 40 time constants after the flow began.
    assert pressure[-1, 0] == pytest.approx((1 - sag) * P_s, rel=1e-9)
    k = round(SUPPLY_LINE / h)
    assert pressure[k - 1, 0] == pytest.approx(P_s * (1 - sag * (1 - np.exp(-1))), rel=1e-9)
    for u, P, flow in (
        (0.5 * u_max, (choked, free), 0.5),  # half open
        (-u_max, (choked, free), 0.75**0.5),  # B is filled: an ellipse at half of its axis
        (-u_max, (free, choked), 1.0),
        (u_max, (P_s, choked), 0.0),  # no flow into a full chamber
    ):
        assert supplied(u, P)[0][-1, 0] == pytest.approx(P_s * (1 - sag * flow), rel=1e-9)


def test_reduced_models_get_the_fitted_valve_and_pressures_without_offsets(plant):
    signals = problem_of(plant).signals
    valve = {"lag": 0.0, "dead_time": 0.0, "null": 0.5}
    found = opened(signals, valve | {"offset_A": 8e3, "offset_B": -2e3})
    np.testing.assert_allclose(found.u, signals.u - 0.5, atol=1e-5)  # a lag of none is 1 ns
    np.testing.assert_allclose(signals.P - found.P, np.array([[8e3], [-2e3]]) * np.ones(SAMPLES), rtol=1e-9)


def test_what_was_fitted_replaces_what_is_configured(plant):
    changed = with_causes(plant, {"P_s": 6.5e5, "A_B": 1e-3, "skew": 1e-3, "k_0": 9.0})
    expected = plant._replace(
        conditions=plant.conditions._replace(P_s=6.5e5), cylinder=plant.cylinder._replace(A_B=1e-3)
    )
    assert changed == expected


def test_a_reduced_model_has_no_valve_and_no_temperature(plant):
    names = problem_of(plant)._replace(model=MODELS["M5"]).names
    assert names == ("n", "k_xu", "V_d_A", "V_d_B", "start_A", "start_B")


def test_bounds_of_a_search_lie_as_far_on_either_side_of_what_is_configured():
    for name, parameter in PARAMETERS.items():
        search = parameter.search
        low, high = search.low, search.high
        if low < 0 and name != "dead_time":  # clocks are early by less than valves are late
            assert low == -high and search.start == 0, name
        elif low > 0 and isinstance(search.start, str) and "." in search.start and search.times:
            # Of multiples of it one is the inverse of the other, to the digits that are written.
            assert high == (round(1 / low) if low <= 0.5 else pytest.approx(1 / low, rel=0.021)), name


def test_a_replay_of_the_full_order_follows_its_simulation(plant):
    """The simulation has force balance and adaptive steps; the replay reads its position and command."""
    ticks = np.arange(1200)
    command = 0.8 * np.sign(np.sin(ticks / 150) + np.sin(ticks / 57)) + 0.3 * np.sin(ticks / 23)
    run = simulate(plant, 1e-3, command=command)
    P = np.array([run.P_A, run.P_B])
    problem = Problem(FULL, plant, stage_signals(1e-3, run.u, run.x, P, plant), {})
    c, air = plant.cylinder, plant.conditions
    values = {"k_0": plant.k_0, "k_xu": plant.valve.k_xu, "V_d_A": c.V_d_A, "V_d_B": c.V_d_B}
    values |= {"start_A": P[0, 0], "start_B": P[1, 0], "start_T_A": air.T_0, "start_T_B": air.T_0}
    theta = problem.inner(values | dict.fromkeys(("lag", "dead_time", "null"), 0.0))
    replayed = replayed_pressures(problem, theta[None])[0, 0]
    # A spline through exact samples of the position leaves 1e-6 of a swing.
    assert np.abs(replayed - P).max() < 1e-5 * np.ptp(P)


def test_shown_units_are_those_of_their_factors():
    factors = {
        "kPa": 1e-3,
        "ms": 1e3,
        "cm³": 1e6,
        "mm²": 1e6,
        "mm²/V": 1e6,
        "%": 100,
        "mg/(s bar)": 1e6 * 1e5,
    }
    for quantity in QUANTITIES.values():
        assert quantity.factor == factors.get(quantity.shown_unit, 1), quantity.name
