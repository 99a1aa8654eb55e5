"""Fits: exact signals give the truth back, derivatives are right, intervals hold or are open."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from synthetic_records import synthetic_record, true_parameters

from pneumo.configuration.parameters import accuracy
from pneumo.errors import InputError
from pneumo.fit import estimate as fit_estimate
from pneumo.fit import parameter_intervals as fit_intervals
from pneumo.fit.closed.thermal_time_constant import transient
from pneumo.fit.estimate import estimate, split_of
from pneumo.fit.fit_problem import FULL, Problem, priors, replayed_pressures, si_value
from pneumo.fit.least_squares import (
    Fit,
    descend,
    evaluate,
    fit,
    pressure_and_jacobian,
    squares_at,
    without_spikes,
)
from pneumo.fit.parameter_intervals import HALF_WIDTH, covariances, parameter_interval, profile_interval
from pneumo.fit.record.measurement import Measurement
from pneumo.fit.stage_signals import FEW_PAIRS, smoothing, stage_signals, with_added_noise
from pneumo.physics.models import MODELS, lane, lane_array
from pneumo.runs import OPEN_LOOP
from pneumo.simulation.fitted_pressures import pressures_of_sets
from pneumo.simulation.full_order import run

MOVED = [0.05, 0.4, 0.1, 0.1, -0.1, 0.01, -0.01]  # beside the guess


@pytest.fixture(scope="module")
def known():
    return synthetic_record(8, "M7")


def record_of(known, x=None, P=None):
    x, P = known.x if x is None else x, known.P if P is None else P
    return stage_signals(known.period, known.u, x, P, known.configured)


def problem_of(known, model, record=None, noises=lambda _: None):
    record = record or record_of(known)
    first = record.part(0, split_of(record))
    return Problem(MODELS[model], known.configured, first, {}, noises(first))


@pytest.mark.parametrize("model", ["M7", "M10"])
def test_replayed_pressures_give_their_parameters_back(model):
    problem = problem_of(synthetic_record(8, model), model)
    theta = problem.guess() + MOVED
    P = replayed_pressures(problem, theta[None])[0, 0]
    exact = problem._replace(signals=problem.signals._replace(P=P))
    found = fit(exact, tolerance=1e-12)
    np.testing.assert_allclose(found.theta, theta, atol=1e-4)  # the step of the differences


@pytest.mark.parametrize("model", ["M8", "M9"])
def test_parameters_become_lanes_dead_volumes_and_starts(model):
    problem = problem_of(synthetic_record(8), model)
    thetas = problem.guess() + np.outer([0.0, 1.0], [0.05, 0.4, 0.2, 0.3, -0.3, 0.02, -0.02])
    found = replayed_pressures(problem, thetas)

    p, s = problem.plant, problem.signals
    for theta, pressure in zip(thetas, found[0], strict=True):
        n, k_0, k_xu, V_A, V_B, P_A, P_B = map(si_value, problem.names, theta)
        own = p._replace(k_0=k_0, valve=p.valve._replace(k_xu=k_xu))
        lanes, V_d = lane_array([lane(MODELS[model], n, 1.4)]), np.array([[V_A, V_B]])
        start = np.array([[P_A, P_B]])
        one = pressures_of_sets(s.u, s.motion[None], lanes, V_d, own, s.h, s.stride, start)[0, 0]
        np.testing.assert_allclose(pressure, one, rtol=1e-9)  # the order of sums, in all steps


def test_a_sum_of_squares_without_derivatives_is_that_with_them(known):
    record = record_of(known)
    noises = with_added_noise(record.part(0, split_of(record)), 1)
    first = record.part(0, split_of(record))
    problem = Problem(
        FULL, known.configured, first, {}, noises, priors=priors(known.configured, first, accuracy(), 1e3)
    )
    theta = problem.guess() + 0.01
    assert squares_at(problem, theta) == pytest.approx(evaluate(problem, theta).squares, rel=1e-12)
    plain = problem._replace(noisy=None)
    assert squares_at(plain, theta) == pytest.approx(evaluate(plain, theta).squares, rel=1e-12)


def test_priors_are_rows_of_the_least_squares(known):
    """A prior adds its weight to the curvature, and its weight times the distance to slope and sum."""
    first = record_of(known).part(0, 200)
    prior = priors(known.configured, first, accuracy(), 1e3)
    held = Problem(FULL, known.configured, first, {}, priors=prior)
    theta = held.guess() + 0.01
    free = held._replace(priors={name: row._replace(weight=0.0) for name, row in prior.items()})
    with_priors, without = evaluate(held, theta), evaluate(free, theta)
    weights = np.array([prior[name].weight if name in prior else 0.0 for name in held.names])
    distance = np.array(
        [x - prior[n].centre if n in prior else 0.0 for n, x in zip(held.names, theta, strict=True)]
    )
    J = without.jacobian.reshape(-1, len(theta))
    np.testing.assert_allclose(without.curvature, J.T @ J, rtol=1e-12, atol=1e-12 * np.max(J.T @ J))
    added = with_priors.curvature - without.curvature
    # What is left of large sums is their rounding.
    np.testing.assert_allclose(added, np.diag(weights), rtol=1e-6, atol=1e-14 * np.max(J.T @ J))
    np.testing.assert_allclose(without.slope - with_priors.slope, weights * distance, rtol=1e-6, atol=1e-12)
    more = float(weights @ distance**2)
    assert with_priors.squares - without.squares == pytest.approx(more, rel=1e-6, abs=1e-14)
    np.testing.assert_array_equal(with_priors.prior, weights)


@pytest.mark.parametrize("rough", [False, True])
def test_noise_in_the_position_is_left_out_only_where_it_hardly_matters(rough, known, monkeypatch):
    noise = 1e-3 if rough else 1e-5  # m
    record = record_of(known, x=known.x + np.random.default_rng(5).normal(0.0, noise, len(known.x)))
    noises = with_added_noise(record.part(0, split_of(record)), FEW_PAIRS + 1)

    noisy_of = []

    def counted(problem, *rest, **options):
        noisy_of.append(len(problem.noisy))
        return descend(problem, *rest, **options)

    monkeypatch.setattr(fit_estimate, "descend", counted)

    def found():
        given = {"noisy": noises, "intervals": ("k_xu",), "known": accuracy()}
        return estimate(MODELS["M7"], known.configured, record, **given)

    short = found()
    monkeypatch.setattr(fit_estimate, "SLIGHT", -1.0)  # never
    exact = found()
    few = 2 * FEW_PAIRS  # then all, but where the noise hardly matters
    assert noisy_of == ([few, few + 2] if rough else [few]) + [few, few + 2]
    if rough:  # there the shorter way is not taken
        assert short.values == exact.values and short.high == exact.high
        return
    half = np.log(exact.high["k_xu"] / exact.low["k_xu"]) / 2
    assert short.high != exact.high
    for name in ("values", "low", "high"):
        moved = np.log(getattr(short, name)["k_xu"] / getattr(exact, name)["k_xu"])
        # SLIGHT of it by the noise, and the rest by six noises in place of eight.
        assert abs(moved) < 0.2 * half, name


@pytest.mark.slow
def test_slope_is_that_of_the_corrected_squares():
    def noises(first):
        # Ten times the noise, so that its effect on the slope counts beside what is measured.
        pair = with_added_noise(first, 1)
        middle = np.mean(pair, axis=0)
        return middle + 10 * (pair - middle)

    problem = problem_of(synthetic_record(6, "M9"), "M9", noises=noises)
    near = fit(problem._replace(noisy=None)).theta  # where only the correction has a slope left
    step = 1e-4
    for theta in (problem.guess(), near):
        here = evaluate(problem, theta)
        for i in range(3):
            move = step * np.eye(len(theta))[i]
            up, down = evaluate(problem, theta + move), evaluate(problem, theta - move)
            # One-sided differences of the replay are off by half a step times its second derivative.
            assert (down.squares - up.squares) / (4 * step) == pytest.approx(here.slope[i], rel=5e-2)


@settings(max_examples=20)
# 0.1 to 1 % of full scale, which is 2 here; below, ever more of the noise passes for motion.
@given(noise=st.floats(2e-3, 2e-2), seed=st.integers(0, 1000))
def test_smoothing_finds_the_noise(noise, seed):
    t = np.arange(2000) * 1e-3
    x = np.sin(5 * t) + np.random.default_rng(seed).normal(0, noise, len(t))
    _, found = smoothing(x, 1e-3)
    # A variance of 2000 samples has a standard error of 3 %, its root half of that: five of these.
    assert found == pytest.approx(noise, rel=0.08)


@pytest.mark.slow
def test_interval_contains_the_truth_and_is_open_where_the_record_is_blind(known):
    problem = problem_of(known, "M7")
    best = fit(problem)
    both = covariances(best)
    i = problem.names.index("k_xu")
    variance = both[:, i, i].max()
    low, high = profile_interval(problem, best, i, variance)
    assert low < np.log(known.truth.valve.k_xu) < high
    # The interval of a near-linear parameter is that of its standard error.
    assert high - low == pytest.approx(2 * HALF_WIDTH * np.sqrt(variance), rel=0.15)
    low, high = parameter_interval(problem, best, best, i, both)
    assert high - low == pytest.approx(2 * HALF_WIDTH * np.sqrt(variance), rel=1e-6)
    shut = np.zeros_like(problem.signals.u)  # a closed valve says nothing of its area
    blind = problem._replace(signals=problem.signals._replace(u=shut))
    shut = fit(blind)
    assert not np.isfinite(parameter_interval(blind, shut, shut, i, covariances(shut))).any()


def test_where_a_deviance_is_one_follows_from_a_parabola_at_the_best_and_an_exponential_farther_out():
    assert fit_intervals.crossing(0.0, 0.0, 4.0, 16.0) == pytest.approx(1.0)
    assert fit_intervals.crossing(1.0, np.exp(-1), 3.0, np.e) == pytest.approx(2.0)


@pytest.mark.parametrize(
    "deviance",
    [
        lambda theta: np.exp(2 * theta) - np.exp(-10),  # of k_0, from the bound on: linear in k_0
        lambda theta: ((theta + 5) / 4) ** 2,
        lambda theta: 1e3 * (theta + 5) ** 2,
    ],
)
def test_ends_of_a_profile_are_found_however_it_bends(deviance, monkeypatch):
    """The best is on the lower bound, as k_0 often is; 1 is what an interval allows."""
    allowed, theta = 4 * HALF_WIDTH**2, np.array([-5.0])
    flat = Fit(
        theta, np.zeros((2, 1)), np.full((2, 1, 1), 0.5**0.5), 7.0, theta, np.eye(1), np.eye(1), np.zeros(1)
    )
    problem = SimpleNamespace(bounds=lambda: np.array([[-5.0], [3.0]]))

    def fixed(_problem, fit, _index, value, _start, _negligible):
        return fit._replace(theta=np.array([value]), squares=fit.squares + allowed * deviance(value))

    monkeypatch.setattr(fit_intervals, "fit_with_one_fixed", fixed)
    low, high = profile_interval(problem, flat, 0, variance=4.0)
    assert low == -np.inf
    exact = brentq(lambda theta: deviance(theta) - 1, -5.0, 3.0)
    assert high == pytest.approx(exact, abs=0.05)  # decision 149: within 5 %


@pytest.mark.slow
def test_interval_of_a_reduced_model_allows_for_its_own_error():
    known = synthetic_record(9012)  # the full order's
    record, held = record_of(known), []
    noises = with_added_noise(record.part(0, split_of(record)), FEW_PAIRS)
    full = estimate(FULL, known.configured, record, noisy=noises, intervals=())
    of_k_0 = {"noisy": noises, "intervals": ("k_0",)}
    for reference in (None, full.pressure):
        found = estimate(MODELS["M8"], known.configured, record, reference=reference, **of_k_0)
        held.append(not known.truth.k_0 > found.high["k_0"])
    # Noise hides that M8 is off; the full order shows it.
    assert held == [False, True]


def test_bounds_limit_a_flat_direction_and_nothing_else():
    bounds = np.array([[-1.0, -2.0, -1.0], [1.0, 2.0, 1.0]])
    known = np.diag([0.04, 0.25, 0.01])
    np.testing.assert_allclose(fit_intervals.bounded(known, bounds), known, rtol=1e-12)
    open_one = np.array([1.0, 0.01, 0.0])
    found = fit_intervals.bounded(known + 1e6 * np.outer(open_one, open_one), bounds)
    assert found[0, 0] == pytest.approx(1.0, rel=1e-3)  # half the distance of the bounds, squared
    assert found[1, 1] == pytest.approx(0.25, rel=1e-3)  # what it had, and not 1e6 * 0.01**2 more
    assert found[2, 2] == pytest.approx(0.01)


@pytest.mark.slow
def test_estimates_scatter_by_their_standard_error(known):
    """Fits of one motion with fresh noises scatter by the standard error that each of them states."""
    spread, said = [], []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        x = known.x_exact + rng.normal(0, known.noise * known.truth.cylinder.stroke, len(known.x))
        P = known.P_exact + rng.normal(0, known.noise * 1e6, known.P.shape)
        noises = partial(with_added_noise, pairs=FEW_PAIRS, seed=seed)
        best = fit(problem_of(known, "M7", record_of(known, x, P), noises))
        spread.append(best.theta)
        said.append(np.diagonal(covariances(best), axis1=1, axis2=2).max(axis=0))
    ratio = np.std(spread, axis=0, ddof=1) / np.sqrt(np.median(said, axis=0))
    # Eight fits know their scatter to 27 %; three pairs of noise give a standard error to 29 %, the median of
    # eight such to 13 %: three times the two together.
    assert np.all((ratio > 0.1) & (ratio < 1.9)), ratio


def test_a_leaking_valve_is_refused_in_one_line(known):
    leaking = known.configured._replace(valve=known.configured.valve._replace(leak=1e-8))
    with pytest.raises(InputError, match=r"^valve: leak = 1e-08 m2.*leak_dm3_per_sbar.*$"):  # . is no newline
        fit(problem_of(known, "M7")._replace(plant=leaking))


@pytest.mark.slow
def test_estimates_of_a_few_cases_hold_the_truth():
    inside = []
    for seed in (8, 16):
        known = synthetic_record(seed, "M7")
        record = record_of(known)
        others = with_added_noise(record.part(0, split_of(record)))
        found = estimate(MODELS["M7"], known.configured, record, noisy=others, intervals=("k_xu",))
        inside.append(found.low["k_xu"] <= true_parameters(known)["k_xu"] <= found.high["k_xu"])
        # Nothing can be nearer than the noise; the right model is not much farther.
        assert 0.95 < found.held_out.mean() / (known.noise * 1e6) < 1.3
    assert any(inside)  # both miss once in 400


@pytest.mark.parametrize("side", ["A", "B"])
def test_thermal_time_constant_of_a_full_order_transient(plant, side):
    T = plant.conditions.T_0 - 15.0
    held = plant._replace(cylinder=plant.cylinder._replace(M=1e6))
    states = run(np.array([0, 0, 5e5, T, 5e5, T]), np.zeros(4001), 0.0, OPEN_LOOP, held, 1e-3).states
    P = states[:, [2, 4]].T + np.random.default_rng(1).normal(0, 500.0, (2, 4001))
    m = Measurement("m", 1e-3, np.zeros(4001), states[:, 0], P)
    found = transient(m, held, side)
    # lambda changes with the root of PT, some 5 % over the transient, and the time constant with it.
    assert found.k_0 == pytest.approx(plant.k_0, rel=0.05)
    assert found.k_0_low < found.k_0 < found.k_0_high


def test_exact_signals_have_no_error_in_the_part_held_out(known):
    record = record_of(known).part(0, 1000)
    problem = Problem(MODELS["M7"], known.configured, record, {})
    theta = problem.guess() + MOVED
    exact = record._replace(P=replayed_pressures(problem, theta[None])[0, 0])
    split = split_of(record)
    found = estimate(MODELS["M7"], known.configured, exact, noisy=None, intervals=())
    assert found.pressure.shape == exact.P.shape and found.low == {}
    # Its own beginning is fitted, and one part in 1e4 of the parameters is what the differences allow.
    np.testing.assert_allclose(found.pressure, exact.P, rtol=1e-3)
    assert np.all(found.rms < 100.0) and np.all(found.held_out < 100.0)
    later = np.sqrt(np.mean((exact.P - found.pressure)[:, split:] ** 2, axis=1))
    np.testing.assert_allclose(found.held_out, later, rtol=1e-6)
    assert found.values["n"] == pytest.approx(1.25, abs=1e-3)
    # What is held out is 40 % of the record, and is not fitted: there a wider valve is seen as an error.
    assert split == 600
    wider = replayed_pressures(problem, (theta + 0.5 * np.eye(7)[2])[None])[0, 0]
    P = np.where(np.arange(1001) > split, wider, exact.P)
    changed = estimate(MODELS["M7"], known.configured, exact._replace(P=P), noisy=None, intervals=())
    assert np.all(changed.rms < 100.0) and np.all(changed.held_out > 1000.0)


def test_slope_curvature_and_scatter_are_those_of_explicit_sums(known):
    first = record_of(known).part(0, 150)
    noisy = with_added_noise(first, 2)
    middle = noisy.mean(axis=0)
    noisy = middle + 10 * (noisy - middle)  # its effect counts beside what is measured
    problem = Problem(MODELS["M7"], known.configured, first, {}, noisy)
    theta = problem.guess() + MOVED
    P, J = pressure_and_jacobian(problem, theta)
    (P, *P_b), (J, *J_b) = P, without_spikes(J)
    mean_P, mean_J = np.mean(P_b, axis=0), np.mean(J_b, axis=0)
    residual = first.P / known.configured.conditions.P_s - (2 * P - mean_P)

    def product(a, b):
        return a.reshape(residual.size, -1).T @ b.reshape(residual.size, -1)

    d, J_d = [P - mean_P for P in P_b], [J - mean_J for J in J_b]
    squares = np.sum(residual**2) - np.mean([np.sum(one**2) for one in d])
    slope = product(2 * J - mean_J, residual) + np.mean(
        [product(*b) for b in zip(J_d, d, strict=True)], axis=0
    )
    curvature = product(2 * J - mean_J, 2 * J - mean_J) - np.mean([product(b, b) for b in J_d], axis=0)
    scatter = np.cov([product(*b)[:, 0] for b in zip(J_b, d, strict=True)], rowvar=False)
    found = evaluate(problem, theta)
    assert found.squares == pytest.approx(squares, rel=1e-10)
    for sums, expected in (
        (found.slope, slope[:, 0]),
        (found.curvature, curvature),
        (found.scatter, scatter),
    ):
        # The order of sums.
        np.testing.assert_allclose(sums, expected, rtol=1e-9, atol=1e-10 * np.abs(expected).max())
