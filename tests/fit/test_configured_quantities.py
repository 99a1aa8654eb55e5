"""Quantities configured a little wrong are fitted within their accuracy, or widen the intervals."""

import numpy as np
import pytest

from benchmarks.bench_rig import bench_record, purpose_rig
from benchmarks.fit_bench import believed_plant
from pneumo.configuration.parameters import accuracy
from pneumo.fit.configured_quantities import (
    CHANGED,
    changes_of,
    configured_shifts,
    misfit,
    parameter_shifts,
    prior_shifts,
    shifts,
)
from pneumo.fit.estimate import estimate, split_of
from pneumo.fit.fit_problem import FULL, Problem, priors
from pneumo.fit.fitted_parameters import CONFIGURED, SHIFTING
from pneumo.fit.least_squares import fit, without_spikes
from pneumo.fit.measurement_fit import fit_measurement
from pneumo.fit.parameter_intervals import inverse_curvature
from pneumo.fit.record.measurement import Measurement
from pneumo.fit.residuals import quantum, sensor_noise
from pneumo.fit.stage_signals import stage_signals

pytestmark = pytest.mark.xdist_group("fit doubts")  # its fixtures take seconds
RIG, SECONDS = purpose_rig(), 5.0


@pytest.fixture(scope="module")
def columns():
    return bench_record(RIG, np.random.default_rng(3), SECONDS)


def plant_of(rig, tmp_path_factory):
    return believed_plant(rig, tmp_path_factory.mktemp("rig"))


@pytest.fixture(scope="module")
def problem(columns, tmp_path_factory):
    plant = plant_of(RIG, tmp_path_factory)
    P = np.array([columns["P_A"], columns["P_B"]])
    record = stage_signals(1e-3, columns["u"], columns["x"], P, plant)
    first = record.part(0, split_of(record))
    return Problem(FULL, plant, first, {}, priors=priors(plant, first, accuracy(), 1e3))


@pytest.fixture(scope="module")
def optimum(problem):
    return fit(problem, tolerance=1e-8)


def test_b_exhaust_and_supply_that_are_configured_a_little_wrong_are_fitted(columns, tmp_path_factory):
    believed = RIG._replace(b=RIG.b + 0.05, P_s=0.995 * RIG.P_s, C=1.1 * RIG.C)
    plant = plant_of(believed, tmp_path_factory)
    P = np.array([columns["P_A"], columns["P_B"]])
    found = fit_measurement(Measurement("m", 1e-3, columns["u"], columns["x"], P), plant, [])
    assert found.warnings == ()
    full = found.estimates("full")
    # Before, an error of b of 0.005 alone was 40 % of k_0.
    assert full["k_0"].value == pytest.approx(RIG.k_0, rel=0.1)
    assert full["b"].value == pytest.approx(RIG.b, abs=0.02)
    assert full["P_s"].value == pytest.approx(RIG.P_s, rel=1e-3)
    assert full["exhaust"].value == pytest.approx(1.0, abs=0.02)
    truth = {"k_0": RIG.k_0, "b": RIG.b, "P_s": RIG.P_s, "exhaust": 1.0, "V_d_A": RIG.V_A, "V_d_B": RIG.V_B}
    for name, value in truth.items():
        assert full[name].low < value < full[name].high, name


def test_a_supply_that_is_not_as_warm_as_configured_is_fitted(columns, tmp_path_factory):
    supply = {"T_in_K": RIG.T_amb + 2.0, "T_amb_K": RIG.T_amb}
    plant = believed_plant(RIG, tmp_path_factory.mktemp("warm"), supply)
    P = np.array([columns["P_A"], columns["P_B"]])
    found = fit_measurement(Measurement("m", 1e-3, columns["u"], columns["x"], P), plant, [])
    full = found.estimates("full")
    assert found.warnings == ()
    # To first order C moved by a third of what it did: the valley of C, b, exhaust and supply is curved.
    assert full["k_0"].value == pytest.approx(RIG.k_0, rel=0.1)
    assert full["T_in"].value == pytest.approx(RIG.T_amb, abs=1.0)
    assert full["T_in"].low < RIG.T_amb < full["T_in"].high


def test_what_another_law_of_the_wall_explains_is_no_remainder(tmp_path_factory, monkeypatch):
    columns = bench_record(RIG._replace(e_A=0.0, e_PT=0.0, k_0=3.0), np.random.default_rng(3), SECONDS)
    plant = plant_of(RIG, tmp_path_factory)
    P = np.array([columns["P_A"], columns["P_B"]])
    record = stage_signals(1e-3, columns["u"], columns["x"], P, plant)
    known = {"noisy": None, "prior": priors(plant, record, accuracy(), 1e3), "known": accuracy()}
    covered = estimate(FULL, plant, record, **known)
    assert covered.low["k_0"] < 3.0 < covered.high["k_0"]
    monkeypatch.setattr("pneumo.fit.wall_laws.WALL_LAWS", {FULL.wall: ""})
    alone = estimate(FULL, plant, record, **known)
    assert covered.remainder["k_0"] < 0.5 * alone.remainder["k_0"]


@pytest.mark.parametrize("quantity", ["the zero of x", "T_amb", "P_atm"])
def test_shifts_are_those_of_a_fit_with_the_quantity_changed(problem, optimum, quantity):
    # A tenth of the accuracy: 3 K of T_amb are too much for the first order.
    known = type(accuracy())(*(0.1 * limit for limit in accuracy()))
    moved = shifts(changes_of(problem, optimum.theta, known), optimum.jacobian, inverse_curvature(optimum))
    row = SHIFTING.index(quantity)
    changed = CHANGED[quantity](problem, known)
    again = fit(changed, tolerance=1e-8, start=optimum.theta)
    expected = again.theta - optimum.theta
    for name in ("k_0", "k_xu", "V_d_A", "V_d_B"):
        i = problem.names.index(name)
        # The search ends where the sum of squares changes by 1e-8: 2e-4 of k_0, the least known.
        assert moved[row, i] == pytest.approx(expected[i], rel=0.2, abs=2e-4), name


def test_a_wrong_zero_of_x_is_a_dead_volume(problem, optimum):
    changes = changes_of(problem, optimum.theta, accuracy())
    moved = shifts(changes, optimum.jacobian, inverse_curvature(optimum))
    volume = problem.plant.cylinder.A_A * accuracy().x_zero
    V_d = problem.values(optimum.theta)["V_d_A"]
    shift = moved[SHIFTING.index("the zero of x"), problem.names.index("V_d_A")]
    assert shift * V_d == pytest.approx(-volume, rel=0.05)  # the wall's area changes too


def test_a_wrong_zero_of_x_leaves_no_residual_but_wrong_gains_do(problem, optimum):
    known, P_s = accuracy(), problem.plant.conditions.P_s

    def left(known):
        changes = changes_of(problem, optimum.theta, known)
        return P_s * misfit(changes, optimum.jacobian, inverse_curvature(optimum))

    exact = type(known)(*(0.0 * limit for limit in known))
    zero, gains = (left(exact._replace(**{name: getattr(known, name)})) for name in ("x_zero", "P_gain"))
    assert zero < 0.2 * gains  # Pa: the dead volumes take it up, but for the wall's area
    assert left(exact._replace(P_gain=0.1 * known.P_gain)) == pytest.approx(0.1 * gains, rel=0.05)
    assert left(known) > gains


def test_intervals_allow_for_what_is_configured(problem):
    split = {"part": 0.6, "prior": problem.priors}
    narrow, wide = (
        estimate(FULL, problem.plant, problem.signals, noisy=None, known=known, **split)
        for known in (None, accuracy())
    )
    width = {name: [e.high[name] - e.low[name] for e in (narrow, wide)] for name in ("V_d_A", "V_d_B")}
    volume = 2 * problem.plant.cylinder.A_A * accuracy().x_zero  # both ends
    for before, after in width.values():
        assert after > before and after > 0.8 * volume  # the zero of x alone, of the smaller area of B


def test_a_derivative_at_a_port_counts_like_others():
    J = np.ones((1, 2, 1000, 1))
    J[0, 0, 500] = 1e4
    limited = without_spikes(J.copy())
    assert np.ptp(limited[0, 1]) == 0
    # Its square was 1e5 times the sum of all others; some ten times the rms is left.
    assert np.sum(limited[0, 0] ** 2) < 0.02 * np.sum(J[0, 0] ** 2)
    steady = np.exp(-np.arange(1000) / 20.0)[None, None, :, None]  # of a first pressure
    np.testing.assert_array_equal(without_spikes(steady.copy()), steady)


@pytest.mark.parametrize("every", [1, 2, 5, 10])
def test_noise_is_that_of_the_sensor_at_every_rate(problem, optimum, every):
    residual = optimum.residual[:, ::every] * problem.plant.conditions.P_s
    noise = sensor_noise(problem.signals.P[:, ::every], residual)
    assert noise == pytest.approx(1e3, rel=0.15)  # 300 samples of 10 ms give the median within 7 %


def test_a_quantised_signal_has_the_noise_of_its_steps():
    t = np.arange(2000) / 1e3
    P = 4e5 + 1e5 * np.sin(3 * t)
    rounded = np.round(P / 244.0) * 244.0
    assert quantum(rounded) == pytest.approx(244.0) and quantum(P) == 0
    noise = sensor_noise(np.array([rounded, rounded]), np.array([rounded - P] * 2))
    assert noise == pytest.approx(244.0 / 12**0.5, rel=0.5)


def test_each_quantity_is_changed_by_its_accuracy_and_nothing_else(problem):
    problem = problem._replace(signals=problem.signals._replace(P_s=np.full_like(problem.signals.u, 7e5)))
    known, plant, signals = accuracy(), problem.plant, problem.signals
    c, air = plant.cylinder, plant.conditions
    factor = 1 + known.bore
    cylinders = {
        "the bore": c._replace(bore=c.bore * factor, A_A=c.A_A * factor**2, A_B=c.A_B * factor**2),
        "the stroke": c._replace(stroke=c.stroke + known.stroke),
    }
    surroundings = {
        "T_amb": air._replace(T_amb=air.T_amb + known.T_amb),
        "P_atm": air._replace(P_atm=air.P_atm * (1 + known.P_atm)),
    }
    gains = np.array([[1 + known.P_gain], [1.0]])
    measured = {
        "the zero of x": {"motion": signals.motion + np.array([known.x_zero, 0.0])},
        "the scale of x": {"motion": signals.motion * (1 + known.x_scale)},
        "the gain of P_A": {"P": signals.P * gains},
        "the gain of P_B": {"P": signals.P * gains[::-1]},
        "the gain of P_s": {"P_s": signals.P_s * (1 + known.P_gain)},
    }
    assert {*cylinders, *surroundings, *measured} == {*CHANGED}
    for name, change in CHANGED.items():
        changed = change(problem, known)
        expected = plant._replace(cylinder=cylinders.get(name, c), conditions=surroundings.get(name, air))
        assert changed.plant == expected, name
        for field in ("u", "motion", "P", "P_s"):
            right = measured.get(name, {}).get(field, getattr(signals, field))
            np.testing.assert_allclose(getattr(changed.signals, field), right, rtol=1e-12, err_msg=name)


def test_a_prior_that_is_off_shifts_parameters_as_a_fit_with_another_centre(problem, optimum):
    known = type(accuracy())(*(0.1 * limit for limit in accuracy()))  # small, as above
    inverse = inverse_curvature(optimum)
    moved = prior_shifts(problem, inverse, optimum.prior, known)
    for row, name in enumerate(CONFIGURED):
        if name not in problem.priors:
            continue
        prior = problem.priors[name]
        other = prior._replace(centre=prior.centre + getattr(known, name))
        again = fit(
            problem._replace(priors={**problem.priors, name: other}), tolerance=1e-8, start=optimum.theta
        )
        i = problem.names.index(name)
        # First order, and searches that end where the sum of squares changes by 1e-8, as above.
        assert moved[row, i] == pytest.approx(again.theta[i] - optimum.theta[i], rel=0.2, abs=2e-5), name


def test_priors_weigh_by_the_noise_of_the_sensors(columns, tmp_path_factory, monkeypatch):
    class Found(Exception):
        pass

    def stopped(*_, prior, **__):
        raise Found(prior)

    monkeypatch.setattr("pneumo.fit.measurement_fit.estimate", stopped)
    plant, P = plant_of(RIG, tmp_path_factory), np.array([columns["P_A"], columns["P_B"]])
    with pytest.raises(Found) as found:
        fit_measurement(Measurement("m", 1e-3, columns["u"], columns["x"], P), plant, [])
    (prior,) = found.value.args
    for _, deviation, weight in prior.values():
        # 3,000 samples and third differences know a noise of 1 kPa to some 3 %.
        assert weight**0.5 * deviation * plant.conditions.P_s == pytest.approx(1e3, rel=0.15)


def test_no_shift_is_larger_than_the_distance_of_the_bounds(problem, optimum):
    changes = changes_of(problem, optimum.theta, accuracy())
    low, high = problem.bounds()
    usual, far, back = (configured_shifts(problem, optimum, f * changes, accuracy()) for f in (1, 1e9, -1e9))
    sure = np.abs(usual[: len(changes)]) > 1e-6  # of both chambers and most quantities
    assert sure.any(axis=0).all() and sure.any(axis=1).sum() >= 7
    for found, sign in ((far, 1), (back, -1)):
        expected = sign * np.sign(usual[: len(changes)]) * (high - low)
        np.testing.assert_array_equal(found[: len(changes)][sure], expected[sure])


def test_what_parameters_do_not_take_up_is_left_as_a_standard_deviation():
    """A change by an accuracy is half a 95 % interval: 1.96 deviations; those of several add by squares."""
    J = np.ones((2, 50, 1))
    J[1] = 2.0
    taken, left = 0.3 * J[..., 0], np.tile([0.1, -0.1], (2, 25))
    inverse = np.array([[1 / np.sum(J**2)]])
    assert misfit(np.array([taken]), J, inverse) == pytest.approx(0.0, abs=1e-12)
    assert misfit(np.array([taken + left]), J, inverse) == pytest.approx(0.1 / 1.96, rel=1e-9)
    both = np.array([taken + left, 2 * left])
    assert misfit(both, J, inverse) == pytest.approx(5**0.5 * 0.1 / 1.96, rel=1e-9)


def test_shifts_are_in_SI_units_from_the_estimate_on(problem, optimum):
    moved = np.zeros((2, len(problem.names)))
    index = {name: problem.names.index(name) for name in ("V_d_A", "null")}
    moved[0, index["V_d_A"]], moved[1, index["null"]] = np.log(2.0), 0.03
    found, values = parameter_shifts(problem, optimum, moved), problem.values(optimum.theta)
    assert found["V_d_A"] == pytest.approx([values["V_d_A"], 0.0], rel=1e-9, abs=1e-20)
    assert found["null"] == pytest.approx([0.0, 0.03], abs=1e-12)
