"""Parts of an estimate: what is fitted of a record, what is slight, laws of the wall, notes, validation."""

from types import SimpleNamespace

import numpy as np
from synthetic_records import synthetic_record, true_parameters

from pneumo.configuration.parameters import accuracy
from pneumo.fit import measurement_fit
from pneumo.fit.estimate import alike_notes, at_temperature, error_line, ranked, slight, split_of
from pneumo.fit.fit_problem import FULL, Problem
from pneumo.fit.fit_result import Estimate, FitResult, fit_data
from pneumo.fit.fitted_parameters import REPORTED, STARTS
from pneumo.fit.measurement_fit import fitted_too, long_notes, uncorrected_notes, validation
from pneumo.fit.parameter_intervals import HALF_WIDTH
from pneumo.fit.record.measurement import Measurement
from pneumo.fit.stage_signals import stage_signals
from pneumo.fit.wall_laws import averaged_shift, likelihoods, wall_law_notes
from pneumo.physics.valve_dynamics import ValveDynamics

NONE = np.zeros((2, 0))


def estimate_of(error=0.0, values=None, **more):
    return Estimate(values or {}, {}, {}, np.full(2, error), np.full(2, error), NONE, **more)


def signals_of(plant, samples=1001, **changes):
    zero = np.zeros(samples)
    return stage_signals(1e-3, zero, zero, np.full((2, samples), 4e5), plant)._replace(**changes)


def test_three_fifths_of_a_record_are_fitted_and_of_a_long_one_a_minute_at_1_kHz(plant):
    assert split_of(signals_of(plant)) == 600 and split_of(signals_of(plant), 0.25) == 250
    long = SimpleNamespace(P=np.empty((2, 200_001)), stride=1, period=1e-3)
    assert split_of(long) == 60_000
    assert split_of(SimpleNamespace(P=long.P, stride=4)) == 15_000
    assert long_notes(SimpleNamespace(P=np.empty((2, 100_001)), period=1e-3), 60_000, 0.6) == []
    short = SimpleNamespace(P=np.empty((2, 101)), period=1.0)
    assert long_notes(short, 60, 0.6) == []
    assert long_notes(short, 59, 0.6) == ["a long record: the first 59 s are fitted, the other 41 s held out"]
    assert long_notes(long, 60_000, 0.6) == [
        "a long record: the first 60 s are fitted, the other 140 s held out"
    ]


def test_a_part_of_the_signals_begins_and_ends_with_its_samples(plant):
    whole = signals_of(plant, begins=(0, 300, 700))
    whole = whole._replace(
        P=np.arange(2002.0).reshape(2, 1001),
        P_s=np.arange(len(whole.u) * 3.0).reshape(-1, 3),
        flow=np.zeros((len(whole.u), 3, 2)),
    )
    part = whole.part(100, 500)
    np.testing.assert_array_equal(part.P, whole.P[:, 100:501])
    assert len(part.u) == len(part.motion) == len(part.P_s) == len(part.flow) == 400 * whole.stride
    assert part.P_s[0, 0] == whole.P_s[100 * whole.stride, 0]
    assert part.begins == (0, 200) and part.pieces == [(0, 199), (200, 400)]
    assert whole.pieces == [(0, 299), (300, 699), (700, 1000)]
    assert whole.part(300, 700).begins == (0,)  # a record that begins at either end is no cut


def test_a_shift_is_slight_below_a_small_part_of_every_interval():
    sizes = np.array([1.0, 10.0]) / HALF_WIDTH
    both = np.array([np.diag(sizes**2), 0.01 * np.diag(sizes**2)])  # half-widths of 1 and 10
    assert slight(np.array([0.01, -0.1]), both)
    assert not slight(np.array([0.1, 0.0]), both) and not slight(np.array([0.0, -1.0]), both)
    assert slight(np.array([0.01, -0.1]), both[::-1])


def test_a_measured_temperature_is_that_of_surroundings_supply_and_reference(plant):
    assert at_temperature(plant, np.nan) == plant
    c = at_temperature(plant, 301.0).conditions
    assert (c.T_amb, c.T_in, c.T_0) == (301.0, 301.0, 301.0)
    assert c._replace(T_amb=0.0, T_in=0.0, T_0=0.0) == plant.conditions._replace(T_amb=0.0, T_in=0.0, T_0=0.0)


def test_models_are_ranked_by_the_part_held_out_and_notes_name_several():
    fits = {"M1": estimate_of(3e3), "M2": estimate_of(1234.0), "M3": estimate_of(2e3)}
    assert list(ranked(fits)) == ["M2", "M3", "M1"]
    assert error_line("M2", fits["M2"]) == "M2: rms 1.23 kPa on the part held out"
    assert error_line("M2", estimate_of(1235.5)) == "M2: rms 1.24 kPa on the part held out"
    assert alike_notes(["M2"]) == alike_notes([]) == []
    (note,) = alike_notes(["M2", "M3"])
    assert note.startswith("this record does not distinguish M2; M3:")
    assert uncorrected_notes(fits) == []
    (note,) = uncorrected_notes(fits | {"M4": estimate_of(1.0, uncorrected=True)})
    assert note.startswith("M4: the curvature")


def test_a_dead_band_is_fitted_too_where_one_is_configured():
    record = Measurement("m", 1e-3, np.zeros(3), np.zeros(3), np.zeros((2, 3)))
    band = ValveDynamics(dead_band=0.2)
    assert fitted_too(["A_B", "A_B"], record, ValveDynamics()) == ("A_B",)
    assert fitted_too(["A_B"], record, band) == ("A_B", "dead_band")
    assert fitted_too(["dead_band"], record, band) == ("dead_band",)
    assert fitted_too([], record._replace(m=np.zeros((2, 3))), band) == ()  # no valve is fitted


def test_laws_weigh_by_the_likelihood_of_white_noise():
    rng = np.random.default_rng(3)
    residual = rng.normal(0.0, 2.0, (2, 20_000))
    noise = np.mean(np.diff(residual, axis=1) ** 2) / 2
    first, second = (
        SimpleNamespace(squares=squares, residual=residual) for squares in (1e5, 1e5 + 3 * noise)
    )
    odds = np.exp(-1.5)  # half of the difference over the variance
    np.testing.assert_allclose(likelihoods([first, second]), np.array([1, odds]) / (1 + odds), rtol=1e-9)
    np.testing.assert_allclose(likelihoods([second, first]), np.array([odds, 1]) / (1 + odds), rtol=1e-9)
    # The best fit's noise counts, not that of a fit that leaves more.
    worse = SimpleNamespace(squares=1e5 + 3 * noise, residual=100 * residual)
    np.testing.assert_allclose(likelihoods([first, worse]), np.array([1, odds]) / (1 + odds), rtol=1e-9)


def test_estimates_shift_to_the_mean_over_laws_and_starts_do_not(plant):
    problem = Problem(FULL, plant, signals_of(plant), {})
    laws = np.array([np.zeros(len(problem.names)), np.ones(len(problem.names))])
    shift = averaged_shift(problem, laws, np.array([0.75, 0.25]))
    assert dict(zip(problem.names, shift, strict=True)) == {
        name: 0.0 if name in STARTS else 0.25 for name in problem.names
    }


def test_a_law_is_said_where_the_mean_over_laws_differs_by_more_than_1_percent():
    full = estimate_of(values={"k_0": 0.5}, laws={"k_0": 0.3, "lambda A_q": 0.7})
    for mean, said in ((0.5045, False), (0.4955, False), (0.507, True), (0.493, True)):
        assert bool(wall_law_notes(full._replace(averaged={"k_0": mean}))) == said
    (note,) = wall_law_notes(full._replace(averaged={"k_0": 0.55}, laws={"k_0": 0.9, "lambda A_q": 0.1}))
    assert note.startswith("a wall whose conductance is constant fits the record best")
    assert note.endswith("in proportion to its area and the root of P T, with k_0 = 0.5 W/K")


def test_another_record_judges_the_fitted_models_by_their_own_starts():
    known = synthetic_record(8, "M7")
    record = Measurement("m", known.period, known.u, known.x, known.P)
    true = true_parameters(known)
    P = np.zeros((2, len(known.u)))

    def errors(**changes):
        values = true | changes
        fits = {"M7": Estimate(values, {}, {}, np.zeros(2), np.zeros(2), P)}
        fit = FitResult(
            data=fit_data(record, fits, (*REPORTED, *STARTS)), notes=(), warnings=(), held_out_from=0.0
        )
        return validation(fit, record, known.configured)["M7"]

    noise = known.noise * 1e6  # Pa, of the sensors
    # What is left is their noise, and some from the position's: as at the estimates of a few cases.
    assert np.all((errors() > 0.9 * noise) & (errors() < 1.3 * noise))
    np.testing.assert_allclose(errors(start_A=1e5, start_B=9e5), errors(), rtol=1e-6)  # fitted there
    assert errors(k_xu=1.2 * true["k_xu"]).min() > 3 * noise


def test_reduced_models_are_compared_with_pressures_without_the_sensors_offsets(plant, monkeypatch):
    """With the replay of the full order, or with what was measured where that is far from noise."""
    record = signals_of(plant, 401)
    replayed, count = np.full(record.P.shape, 5e5), []

    def fitted(*_, intervals, **__):
        count.append(len(intervals))
        valve = dict.fromkeys(("lag", "dead_time", "null"), 0.0)
        return estimate_of(values=valve | {"offset_A": 8e3, "offset_B": -2e3})._replace(pressure=replayed)

    def rough(problem):
        return SimpleNamespace(theta=problem.guess(), residual=np.zeros(problem.signals.P.shape))

    monkeypatch.setattr(measurement_fit, "best_start", rough)
    monkeypatch.setattr(measurement_fit, "estimate", fitted)
    monkeypatch.setattr(measurement_fit, "residuals", lambda *_: [])
    monkeypatch.setattr(measurement_fit, "covariances", lambda rough: (rough, rough))
    for name in ("remainder_shifts", "expected_shifts"):
        monkeypatch.setattr(measurement_fit, name, lambda rough: 0 * rough.theta)
    options = {"noisy": None, "also": (), "known": accuracy(), "part": 0.6, "long": False}
    for far, pressure in ((False, replayed), (True, record.P)):
        monkeypatch.setattr(measurement_fit, "doubtful", lambda *_, far=far: far)
        found = measurement_fit._full_order(record, plant, record.P, **options)
        np.testing.assert_array_equal(found.reference, pressure - np.array([[8e3], [-2e3]]))
        np.testing.assert_array_equal(found.record.P, record.P - np.array([[8e3], [-2e3]]))
    assert count[0] > 0 == count[1]
