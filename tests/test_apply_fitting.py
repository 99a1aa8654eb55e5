"""Fits: exact signals give the truth back, derivatives are right, intervals hold or are open."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneumo.apply.coverage import truth_of
from pneumo.apply.disturbance import disturbed
from pneumo.apply.estimate import estimate, split_of
from pneumo.apply.fitting import PARAMETERS, Problem, evaluated, fit, replayed
from pneumo.apply.intervals import covariance, profile
from pneumo.apply.measurement import Measurement
from pneumo.apply.signals import signals, smoothing
from pneumo.apply.synthetic import case
from pneumo.apply.thermal import transient
from pneumo.physics.experiment import Drive
from pneumo.physics.models import MODELS, lane, lane_array
from pneumo.simulate.datum import run
from pneumo.simulate.driven import driven


def problem_of(known, model):
    record = signals(known.period, known.u, known.x, known.P, 10.0)
    return Problem(MODELS[model], known.configured, record.part(0, split_of(record)), {})


@pytest.mark.parametrize("model", ["M7", "M10"])
def test_replayed_pressures_give_their_parameters_back(model):
    known = case(8, model)
    problem = problem_of(known, model)
    theta = problem.guess()
    theta += [0.05, 0.4, 0.1, 0.1, -0.1, 0.01, -0.01]
    P = replayed(problem, theta[None], problem.signals.inputs)[0]
    exact = problem._replace(signals=problem.signals._replace(P=P))
    found = fit(exact, tolerance=1e-12)
    np.testing.assert_allclose(found.theta, theta, atol=1e-4)  # the step of the differences


@pytest.mark.parametrize("model", ["M8", "M9"])
def test_lanes_stand_for_valve_wall_and_dead_volumes(model):
    known = case(8)
    problem = problem_of(known, model)
    theta = problem.guess() + np.array([0.05, 0.4, 0.2, 0.3, -0.3, 0.02, -0.02])
    n, k_0, k_xu, V_A, V_B, *_ = (
        PARAMETERS[name].outer(value) for name, value in zip(problem.names, theta, strict=True)
    )
    found = replayed(problem, theta[None], problem.signals.inputs)[0]

    rows = lane_array([lane(MODELS[model], n, 1.4)])
    start = np.exp(theta[None, -2:])
    for side, V_d in enumerate((V_A, V_B)):
        p = problem.plant
        own = p._replace(k_0=k_0, valve=p.valve._replace(k_xu=k_xu), cylinder=p.cylinder._replace(V_d=V_d))
        s = problem.signals
        expected = driven(s.inputs, rows, own, s.h, s.stride, start)[0, side]
        np.testing.assert_allclose(
            found[side], expected, rtol=1e-9
        )  # the order of sums, over thousands of steps


def test_slope_is_that_of_the_corrected_squares():
    known = case(6, "M9")
    record = signals(known.period, known.u, known.x, known.P, 10.0)
    first = record.part(0, split_of(record))
    problem = Problem(MODELS["M9"], known.configured, first, {}, disturbed(first)[:2])
    theta = problem.guess()
    here = evaluated(problem, theta)
    step = 1e-4
    for i in range(3):
        move = step * np.eye(len(theta))[i]
        up, down = evaluated(problem, theta + move), evaluated(problem, theta - move)
        assert (down.squares - up.squares) / (4 * step) == pytest.approx(here.slope[i], rel=2e-2)


@settings(deadline=None, max_examples=20)
# 0.1 to 1 % of full scale, which is 2 here; below, ever more of the noise passes for motion.
@given(noise=st.floats(2e-3, 2e-2), seed=st.integers(0, 1000))
def test_smoothing_finds_the_noise(noise, seed):
    t = np.arange(2000) * 1e-3
    x = np.sin(5 * t) + np.random.default_rng(seed).normal(0, noise, len(t))
    _, found = smoothing(x, 1e-3)
    # A variance of 2000 samples has a standard error of 3 %, its root half of that: five of these.
    assert found == pytest.approx(noise, rel=0.08)


def test_interval_holds_what_is_known_and_is_open_where_nothing_is():
    known = case(8, "M7")
    problem = problem_of(known, "M7")
    best = fit(problem)
    spread = covariance(best)
    i = problem.names.index("k_xu")
    interval = profile(problem, best, i, spread[i, i])
    assert interval.low < np.log(known.truth.valve.k_xu) < interval.high
    # The interval of a near-linear parameter is that of its standard error.
    assert interval.high - interval.low == pytest.approx(2 * 1.96 * np.sqrt(spread[i, i]), rel=0.15)
    still = problem.signals.inputs.copy()
    still[:, :, 0] = 0.0  # a closed valve says nothing of its area
    blind = problem._replace(signals=problem.signals._replace(inputs=still))
    shut = fit(blind)
    width = profile(blind, shut, i, max(covariance(shut)[i, i], 1.0))
    assert not np.isfinite(width.low)
    assert not np.isfinite(width.high)


def test_estimates_of_a_few_cases_hold_the_truth():
    inside = []
    for seed in (8, 16, 24):
        known = case(seed, "M7")
        record = signals(known.period, known.u, known.x, known.P, 10.0)
        others = disturbed(record.part(0, split_of(record)))
        found = estimate(MODELS["M7"], known.configured, record, others=others, intervals=("k_xu",))
        inside.append(found.low["k_xu"] <= truth_of(known)["k_xu"] <= found.high["k_xu"])
        # Nothing can be nearer than the noise; the right model is not much farther.
        assert 0.95 < found.held_out.mean() / (known.noise * 1e6) < 1.3
    assert sum(inside) >= 2  # all three miss at most once in a hundred thousand, two in 140


def test_start_is_where_the_replay_begins(plant):
    inputs = np.zeros((5, 6, 3))

    rows = lane_array([lane(MODELS["M10"], 1.3, 1.4), lane(MODELS["M1"], 1.0, 1.4)])
    start = np.array([[4e5, 5e5], [3e5, 6e5]])
    found = driven(inputs, rows, plant, 1e-3, 1, start)
    np.testing.assert_array_equal(found[:, :, 0], start)
    # A closed valve and constant temperature leave M1 where it is.
    np.testing.assert_allclose(found[1], np.repeat(start[1][:, None], 6, axis=1), rtol=1e-12)


@pytest.mark.parametrize("side", ["A", "B"])
def test_thermal_time_constant_of_a_full_order_transient(plant, side):
    T_0 = plant.conditions.T_0
    state = np.array([0.0, 0.0, 5e5, T_0 - 15.0, 5e5, T_0 - 15.0])
    held = plant._replace(cylinder=plant.cylinder._replace(M=1e6))
    steps = round(4.0 / 1e-3)
    states = run(state, np.zeros(steps + 1), 0.0, Drive(False, 0.0, np.inf), held, 1e-3)
    rng = np.random.default_rng(1)
    P = states[:, [2, 4]].T + rng.normal(0, 500.0, (2, steps + 1))
    m = Measurement("m", 1e-3, np.zeros(steps + 1), states[:, 0], P, None, np.nan, ())
    found = transient(m, held, side)
    # lambda changes with the root of PT, some 5 % over the transient, and the time constant with it.
    assert found.k_0 == pytest.approx(plant.k_0, rel=0.05)
    assert found.k_0_low < found.k_0 < found.k_0_high
