"""What a fit hands from one of its parts to the next: samples, errors of model and configuration, starts."""

from types import SimpleNamespace

import numpy as np
import pytest

from pneumo.configuration.parameters import accuracy
from pneumo.errors import InputError
from pneumo.fit import estimate as fit_estimate
from pneumo.fit import measurement_fit
from pneumo.fit.estimate import best_start, estimate, first_pressures
from pneumo.fit.fit_problem import FULL, Problem, priors, replayed_pressures, si_value
from pneumo.fit.fit_result import Estimate
from pneumo.fit.measurement_fit import fit_measurement
from pneumo.fit.parameter_intervals import HALF_WIDTH
from pneumo.fit.record.measurement import Measurement
from pneumo.fit.residuals import Residual
from pneumo.fit.stage_signals import stage_signals
from pneumo.physics.models import MODELS

SAMPLES = 301
X = 0.03 * np.sin(0.02 * np.arange(SAMPLES))
U = np.where(np.arange(SAMPLES) % 100 < 50, 4.0, -4.0)


class Reached(Exception):
    pass


def signals_of(plant, period=1e-3, samples=SAMPLES):
    P = np.full((2, samples), 4e5) + np.arange(samples)
    return stage_signals(period, U[:samples], X[:samples], P, plant)


def test_an_estimate_is_uncertain_by_the_models_error_and_by_what_is_configured(plant, monkeypatch):
    """Each in units of P_s, on the part fitted; an accuracy is 1.96 standard deviations."""
    record, errors = signals_of(plant), []
    problem = Problem(MODELS["M7"], plant, record.part(0, 180), {})
    theta, count = problem.guess(), len(problem.names)
    best = SimpleNamespace(theta=theta, residual=np.zeros((2, 181)), jacobian=None, squares=1.0)
    replayed = replayed_pressures(problem, theta[None])[0, 0]
    moved = np.outer([3.0, 4.0], np.arange(1.0, count + 1))

    def covariances(_best, model_error):
        errors.append(model_error)
        return np.zeros((2, count, count))

    fakes = {
        "fit": lambda problem, **_: best,
        "changes_of": lambda *_: np.zeros((0, 2, 181)),
        "configured_shifts": lambda *_: moved,
        "covariances": covariances,
        "likelihoods": lambda fits: np.ones(len(fits)),
        "first_pressures": lambda problem: problem.guess(),
        "remainder_shifts": lambda fit: np.zeros(count),
        "inverse_curvature": lambda fit: None,
        "parameter_interval": lambda *_: (-np.inf, -9.0),
        "misfit": lambda *_: 0.01,
        "definite": lambda _: True,
        "parameter_shifts": lambda *_: {},
    }
    for name, fake in fakes.items():
        monkeypatch.setattr(fit_estimate, name, fake)
    reference = np.full((2, SAMPLES), 1e9)
    reference[:, :181] = replayed + np.array([[300.0], [-400.0]])
    found = estimate(MODELS["M7"], plant, record, noisy=None, known=accuracy(), reference=reference)
    P_s = plant.conditions.P_s
    assert errors == [pytest.approx(181 * 25e4 / P_s**2, rel=1e-6)]
    halves = HALF_WIDTH * 5 * np.arange(1, count + 1) / 1.96
    assert list(found.expected.values()) == pytest.approx(halves, rel=1e-9)
    assert found.of_configuration == pytest.approx(0.01 * P_s)
    # A dead volume ends at the lower bound of its search, other parameters are open.
    low, _ = problem.bounds()
    assert found.low["V_d_A"] == pytest.approx(si_value("V_d_A", low[problem.names.index("V_d_A")]))
    assert np.isnan(found.low["k_xu"]) and found.high["k_xu"] == pytest.approx(np.exp(-9.0))
    monkeypatch.setattr(fit_estimate, "covariances", lambda *_: np.zeros((2, count, count)))
    plain = estimate(MODELS["M7"], plant, record, noisy=None, known=accuracy(), intervals=())
    assert plain.low == plain.high == {}


def test_first_pressures_are_fitted_to_no_more_steps_than_a_fit_takes(plant, monkeypatch):
    monkeypatch.setattr(fit_estimate, "MOST_STEPS", 100)
    record, sizes = signals_of(plant, 2e-3), []
    assert record.stride == 2

    def fitted(problem):
        sizes.append(problem.signals.P.shape[1])
        return SimpleNamespace(theta=problem.guess())

    monkeypatch.setattr(fit_estimate, "fit", fitted)
    fixed = {"n": 1.2, "k_xu": plant.valve.k_xu, "V_d_A": 1e-6, "V_d_B": 1e-6}
    problem = Problem(MODELS["M7"], plant, record, fixed)
    np.testing.assert_array_equal(first_pressures(problem), problem.guess())
    assert sizes == [51]


@pytest.mark.parametrize("far", [False, True])
def test_a_search_begins_again_with_each_configured_quantity_free_where_residuals_are_large(
    plant, monkeypatch, far
):
    record, searches = signals_of(plant), []
    prior = priors(plant, record, accuracy(), 1e3)
    problem = Problem(FULL, plant, record, {}, priors=prior)
    squares = iter([4.0, 9.0, 3.0, 9.0, 2.0, 9.0, 5.0])

    def fitted(problem, **options):
        searches.append((problem.also, options))
        theta = problem.guess()
        if problem.also:
            theta[problem.names.index(problem.also[0])] += 0.01
        return SimpleNamespace(theta=theta, squares=next(squares))

    monkeypatch.setattr(fit_estimate, "fit", fitted)
    split = [Residual(2e3, 10.0, 1e3), Residual(2e3, 2e3 if far else 0.0, 1e3)]
    monkeypatch.setattr(fit_estimate, "residuals", lambda *_: split)
    found = best_start(problem)
    assert found.squares == (2.0 if far else 4.0)
    assert [also for also, _ in searches] == (
        [()] + [a for name in prior for a in ((name,), ())] if far else [()]
    )
    for (also, free), (_, held) in zip(searches[1::2], searches[2::2], strict=True):
        assert 0 < free["tolerance"] <= 1e-3 and 10 <= free["most"] <= 20  # a start is enough
        moved = held["start"] - problem.guess()
        assert moved[problem.names.index(also[0])] == pytest.approx(0.01)
        assert np.count_nonzero(np.abs(moved) > 1e-9) == 1


def measured(**changes):
    P = np.full((2, SAMPLES), 4e5) + np.arange(SAMPLES)
    return Measurement("m", 1e-3, U, X, P)._replace(**changes)


def test_the_full_order_is_fitted_to_the_first_part_with_six_noises(plant, monkeypatch):
    def stopped(record, _plant, _measured, *, noisy, **_):
        raise Reached(record.P.shape[1], len(noisy), noisy.shape[1], record.stride)

    monkeypatch.setattr(measurement_fit, "_full_order", stopped)
    with pytest.raises(Reached) as found:
        fit_measurement(measured(), plant, [])
    samples, noises, steps, stride = found.value.args
    assert (samples, noises, steps) == (SAMPLES, 6, 180 * stride)


def test_a_start_is_searched_on_the_first_part_from_its_first_sample_on(plant, monkeypatch):
    def stopped(problem):
        raise Reached(problem.signals.P)

    monkeypatch.setattr(measurement_fit, "best_start", stopped)
    record = signals_of(plant)
    options = {"noisy": None, "also": (), "known": accuracy(), "part": 0.6, "long": False}
    with pytest.raises(Reached) as found:
        measurement_fit._full_order(record, plant, record.P, **options)
    np.testing.assert_array_equal(found.value.args[0], record.P[:, :181])


def test_pressures_of_a_reduced_model_have_the_sensors_offsets_again():
    P = np.array([[1e5, 2e5], [3e5, 4e5]])
    fitted = Estimate({}, {}, {}, np.zeros(2), np.zeros(2), P)
    for long, kind in ((False, np.float64), (True, np.float32)):
        kept = measurement_fit._kept(fitted, np.array([[8e3], [-2e3]]), long).pressure
        np.testing.assert_array_equal(kept, [[1.08e5, 2.08e5], [2.98e5, 3.98e5]])
        assert kept.dtype == kind


@pytest.mark.parametrize(
    ("valve", "record", "also", "words"),
    [
        ({"leak": 1e-9}, {}, ("exhaust", "sag"), "--also exhaust: needs the fit of the full order"),
        ({"laminar": 0.01}, {}, ("sag",), "--also sag: needs"),
        ({}, {"m": np.zeros((2, SAMPLES))}, ("sag",), "--also sag: needs"),
        ({}, {}, ("sag", "u"), "--also u: must be one of"),
        ({}, {"P_s": np.full(SAMPLES, 7e5)}, ("sag", "P_s"), "--also P_s: m has the supply pressure"),
    ],
)
def test_a_cause_that_cannot_be_fitted_is_refused(plant, valve, record, also, words):
    changed = plant._replace(valve=plant.valve._replace(**valve))
    with pytest.raises(InputError, match=words):
        fit_measurement(measured(**record), changed, ["M8"], also=also)


def test_a_measured_supply_or_no_full_order_is_refused_with_no_cause_that_needs_it():
    supply = measured(P_s=np.full(SAMPLES, 7e5))
    for also, record, full in (((), supply, True), (("sag",), supply, True), (("P_s",), measured(), True)):
        measurement_fit._check_also(also, record, full)
    measurement_fit._check_also((), measured(), False)
