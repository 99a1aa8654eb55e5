"""One step of the observers' filter, uncompiled: rates, noise, stops, limits, the order of its rule."""

import numpy as np
import pytest
from array_equations import array_rates
from paper_study import STUDY

from pneumo.evidence.at_work.observers import filter_noise, reduced
from pneumo.physics.cylinder import Side, chamber_of
from pneumo.physics.models import MODELS, lane
from pneumo.simulation.full_order_replay import FullRow
from pneumo.simulation.kalman_filter import (
    FIRST_LN_K_0,
    FIRST_PRESSURE,
    FIRST_TEMPERATURE,
    SIZE,
    FilterModel,
    correct,
    correct_all,
    estimated,
    first_estimate,
    model_rates,
    predict,
)
from pneumo.simulation.reference import lane_rate

pytestmark = pytest.mark.uncompiled

CLOSED = STUDY.experiments["E10"]
PLANT, H = CLOSED.plant, CLOSED.h
C, CYLINDER = PLANT.conditions, PLANT.cylinder
LANE = lane(MODELS["M8"], 1.35, PLANT.gas.gamma)
SILENT, T_0 = filter_noise(0.0, 0.0), C.T_0
MODEL = reduced(LANE)
FILTERS = [
    FilterModel(full, estimates_k_0, LANE, FullRow())
    for full in (False, True)
    for estimates_k_0 in (False, True)
]
all_filters = pytest.mark.parametrize(
    "model", FILTERS, ids=lambda model: f"full {model.full}, k_0 {model.estimates_k_0}"
)


def first_covariance():
    """First covariance of all states, whether a model has them or not."""
    return first_estimate(0.0, np.full(2, C.P_0), PLANT, SILENT)[1]


def after(y, u=1.0, noise=SILENT, h=H, steps=1, model=MODEL):
    """State and covariance after some steps from the first covariance."""
    y, covariance, W = np.array([*y, T_0, T_0, 0.0][:SIZE]), first_covariance(), np.empty((4, SIZE, SIZE))
    for _ in range(steps):
        predict(y, covariance, u, PLANT, model, noise, h, W)
    return y, covariance


def test_the_first_estimate_rests_with_known_position_and_pressures():
    y, covariance = first_estimate(0.01, np.array([4e5, 5e5]), PLANT, SILENT)
    assert y.tolist() == [0.01, 0.0, 4e5, 5e5, T_0, T_0, 0.0]
    variances = np.diag(covariance)
    assert np.array_equal(covariance, np.diag(variances)) and (variances > 0).all()
    assert variances[0] == SILENT.x_variance
    deviations = [FIRST_PRESSURE] * 2 + [FIRST_TEMPERATURE] * 2 + [FIRST_LN_K_0]
    np.testing.assert_allclose(np.sqrt(variances[2:]), deviations, rtol=1e-15)  # a square and its root


@all_filters
@pytest.mark.parametrize("u", [1.0, -1.0])
def test_the_estimate_moves_at_the_rates_of_the_readable_equations(model, u):
    y, h = np.array([0.005, 0.1, 5.2e5, 4.7e5, 296.0, 290.0, 0.3]), 1e-7
    rates = (after(y, u, h=h, model=model)[0] - y) / h
    plant = PLANT._replace(k_0=PLANT.k_0 * (np.exp(0.3) if model.estimates_k_0 else 1.0))
    by_chamber = [0, 1, 2, 4, 3, 5]  # the order of the full-order states
    closed = CLOSED._replace(plant=plant)  # a reference whose error commands u
    expected = array_rates(y[by_chamber], y[0] + u / CLOSED.drive.k_p, closed)[by_chamber]
    if not model.full:
        expected[2:] = 0.0  # temperatures rest
        for side in Side:
            of_chamber = (side.sign * value for value in (u, y[0], y[1]))
            expected[2 + side] = lane_rate(*of_chamber, y[2 + side], chamber_of(CYLINDER, side), plant, LANE)
    # A rate changes within a step by h / 2 over the shortest time in which it changes, a millisecond.
    np.testing.assert_allclose(rates, [*expected, 0.0], rtol=5e-5)


@all_filters
def test_noise_adds_its_variance(model):
    start = [0.01, 0.2, 4e5, 5e5]
    silent, noisy = (after(start, noise=noise, model=model)[1] for noise in (SILENT, filter_noise(2.0, 1e6)))
    T_noise = 1e6 * T_0 / C.P_0 if model.full else 0.0
    added = H * np.square([0.0, 2.0 / CYLINDER.M, 1e6, 1e6, T_noise, T_noise, 0.0])
    np.testing.assert_allclose(noisy - silent, np.diag(added), rtol=1e-9, atol=1e-9)


def test_the_rule_is_of_second_order():
    start = [0.01, 0.2, 4e5, 5e5]
    true = after(start, h=H / 64, steps=64)[0]
    one, two = (abs(after(start, h=H / k, steps=k)[0] - true)[2:4].max() for k in (1, 2))
    assert one / two == pytest.approx(4, rel=0.2)


def test_a_stop_holds_the_piston():
    y, _ = after([CYLINDER.x_max - 1e-5, 0.5, C.P_0, C.P_0])
    assert y[:2].tolist() == [CYLINDER.x_max, 0.0]


def test_the_infinite_slope_of_the_flow_at_equal_pressures_is_limited():
    _, covariance = after([0.0, 0.0, C.P_s - 1.0, C.P_0], u=10.0)
    # With the rate's derivative at -1/h, a step halves the error: 1 - 1 + 1/2.
    assert covariance[2, 2] == pytest.approx(first_covariance()[2, 2] / 4, rel=0.05)


def test_pressures_stay_possible():
    beyond, limits = [0.0, 0.0, 3 * C.P_s, C.P_atm / 10], [2 * C.P_s, C.P_atm / 2]
    assert after(beyond, u=0.0)[0][2:4].tolist() == limits
    y = np.array([*beyond, T_0, T_0, 0.0])
    correct_all(y, first_covariance(), np.nan, np.full(2, np.nan), PLANT, MODEL, SILENT)
    assert y[2:4].tolist() == limits


@pytest.mark.parametrize("measured", [0, 1, 2])
def test_each_pressure_that_is_measured_corrects_its_own(measured):
    y, read = np.array([0.0, 0.0, C.P_0, C.P_0, T_0, T_0, 0.0]), C.P_0 + np.array([2e4, -3e4])
    known = np.where(np.arange(2) < measured, read, np.nan)
    correct_all(y, first_covariance(), 0.0, known, PLANT, MODEL, SILENT)
    expected = np.where(np.arange(2) < measured, read, C.P_0)
    assert y[2:4] == pytest.approx(expected, abs=150)  # the sensor's variance is a 400th of the first


@all_filters
def test_the_covariance_moves_by_differences_of_the_prediction(model):
    start = np.array([0.005, 0.1, 5.2e5, 4.7e5, 296.0, 290.0, 0.1])
    names = [s for s in range(SIZE) if s < 4 or (s < 6 and model.full) or (s == 6 and model.estimates_k_0)]
    steps = np.array([1e-6, 1e-4, 10.0, 10.0, 0.01, 0.01, 1e-3])
    columns = []
    for s in names:
        up, down = (after(start + sign * steps * (np.arange(SIZE) == s), model=model)[0] for sign in (1, -1))
        columns.append((up - down)[names] / (2 * steps[s]))
    F, C_0 = np.column_stack(columns), first_covariance()[np.ix_(names, names)]
    noise = np.zeros(len(names))
    if model.estimates_k_0:
        noise[-1] = H * 0.01**2
    expected = F @ C_0 @ F.T + np.diag(noise)
    covariance = after(start, model=model)[1][np.ix_(names, names)]
    scale = np.sqrt(np.diag(expected))
    # One-sided differences of the filter, over larger steps, leave less than a hundredth of a step's change.
    np.testing.assert_allclose(
        covariance / np.outer(scale, scale), expected / np.outer(scale, scale), atol=1e-2
    )


def test_k_0_and_temperatures_are_kept_possible():
    model = FILTERS[-1]
    y = np.array([0.0, 0.0, C.P_0, C.P_0, 3 * T_0, T_0 / 3, 9.0])
    correct_all(y, first_covariance(), np.nan, np.full(2, np.nan), PLANT, model, SILENT)
    assert y[4:].tolist() == [2 * T_0, T_0 / 2, np.log(10.0)]


def states_of(model):
    """Indices of the states that a model uses."""
    return [s for s in range(SIZE) if s < 4 or (s < 6 and model.full) or (s == 6 and model.estimates_k_0)]


def some_covariance(seed):
    L = np.random.default_rng(seed).normal(size=(SIZE, SIZE))
    return L @ L.T + np.eye(SIZE)


@all_filters
@pytest.mark.parametrize("u", [1.0, -1.0])
def test_derivatives_are_those_of_the_rates_and_move_the_covariance(model, u):
    def rates(y):
        dy = np.empty(SIZE)
        model_rates(y, u, PLANT, model, dy)
        return dy

    start, W = np.array([0.005, 0.1, 5.2e5, 4.7e5, 296.0, 290.0, 0.3]), np.zeros((4, SIZE, SIZE))
    steps = np.diag(1e-4 * np.array([CYLINDER.stroke, 1.0, C.P_0, C.P_0, T_0, T_0, 1.0]))
    slopes = [(rates(start + step) - rates(start - step)) / (2 * step.sum()) for step in steps]
    before, y = some_covariance(3), start.copy()
    after = before.copy()
    predict(y, after, u, PLANT, model, SILENT, H, W)
    used = np.ix_(states_of(model), states_of(model))
    # One-sided differences of the filter, over 1e-3 of each scale, of curved rates.
    np.testing.assert_allclose(W[0][used], np.column_stack(slopes)[used], rtol=0.01)
    A, F = W[0][used], W[1][used]
    np.testing.assert_allclose(F, np.eye(len(A)) + H * A + H**2 / 2 * A @ A, rtol=1e-9)
    expected = F @ before[used] @ F.T
    if model.estimates_k_0:
        expected[-1, -1] += H * 0.01**2
    np.testing.assert_allclose(after[used], expected, rtol=1e-9)


@all_filters
@pytest.mark.parametrize("s", [0, 2, 3])
def test_a_reading_corrects_all_states_by_their_covariance_with_it(model, s):
    y, covariance, used = np.arange(1.0, SIZE + 1), some_covariance(s), states_of(model)
    gain = covariance[:, s] / (covariance[s, s] + 0.5)
    expected = covariance - np.outer(gain, covariance[s])
    moved = y + np.where(np.isin(np.arange(SIZE), used), gain * (9.0 - y[s]), 0.0)
    correct(y, covariance, s, 9.0, 0.5, model)
    np.testing.assert_allclose(y, moved, rtol=1e-12)
    np.testing.assert_allclose(covariance[np.ix_(used, used)], expected[np.ix_(used, used)], rtol=1e-9)


def test_a_position_that_is_not_read_corrects_nothing_and_one_that_is_its_own_state():
    for x, expected in ((np.nan, 0.0), (1e-3, 5e-4)):  # the reading is as uncertain as the first estimate
        y, covariance = first_estimate(0.0, np.full(2, C.P_0), PLANT, SILENT)
        correct_all(y, covariance, x, np.full(2, np.nan), PLANT, MODEL, SILENT)
        assert y[0] == pytest.approx(expected, rel=1e-12) and y[1:4].tolist() == [0.0, C.P_0, C.P_0]


def test_the_first_estimate_is_corrected_by_the_first_reading_and_kept_before_the_first_step():
    plain, missing = getattr(estimated, "py_func", estimated), np.full((3, 2), np.nan)
    x, first = np.array([0.01, np.nan, np.nan]), np.array([4e5, 5e5])
    estimates, variances = plain(x, missing, np.ones(3), first, MODEL, PLANT, SILENT, H)
    assert estimates[0].tolist() == [0.01, 0.0, 4e5, 5e5, T_0, T_0, 0.0]
    expected = [SILENT.x_variance / 2, 1e-3**2, 2e4**2, 2e4**2, 5.0**2, 5.0**2, np.log(2.7) ** 2]
    np.testing.assert_allclose(variances[0], expected, rtol=1e-12)
    assert (estimates[1:, 2] > 4e5).all() and (variances[1:, 0] > variances[0, 0]).all()
