"""Warnings of a fit on either side of their limits, and the numbers that they give."""

from types import SimpleNamespace

import numpy as np
import pytest

from pneumo.configuration.parameters import accuracy
from pneumo.fit import fit_warnings as warnings
from pneumo.fit.fit_problem import FULL, Problem, priors, search_value, si_value
from pneumo.fit.fit_result import Estimate
from pneumo.fit.residuals import Residual
from pneumo.fit.sensor_offsets import SensorOffset
from pneumo.fit.stage_signals import stage_signals

PERIOD, SAMPLES = 1e-3, 2000
T = PERIOD * np.arange(SAMPLES)
TWO, NONE = np.zeros(2), np.zeros((2, 0))


def problem_of(plant, *, u=None, x=None, P=None, **changes):
    """Problem of the full order on a record of 2 s, of a piston that rests in the middle."""
    u, x = (np.full(SAMPLES, 5.0) if u is None else u), (np.zeros(SAMPLES) if x is None else x)
    P = np.full((2, SAMPLES), 3e5) if P is None else P
    return Problem(FULL, plant, stage_signals(PERIOD, u, x, P, plant), {}, **changes)


def estimate_of(values, low=None, high=None, **more):
    return Estimate(values, low or {}, high or {}, TWO, TWO, NONE, **more)


@pytest.mark.parametrize(("name", "most"), [("k_0", 0.15), ("k_xu", 0.03), ("V_d_A", 0.05), ("V_d_B", 0.05)])
def test_residuals_are_doubted_where_they_move_a_parameter_by_more_than_decision_91_says(name, most):
    split = [Residual(1e3, 300.0, 1e3)] * 2

    def doubted(part, **options):
        return warnings.doubtful(split, {name: part * most}, {}, **options)

    assert not doubted(0.99) and doubted(1.01)
    factor = warnings.DISTRUST
    assert factor == 5.0  # of decision 91
    assert not doubted(4.99, factor=factor) and doubted(5.01, factor=factor)


def test_residuals_far_below_the_noise_or_what_is_configured_are_no_doubt():
    def doubted(coloured, **options):
        split = [Residual(1e3, 0.0, 1e3), Residual(1e3, coloured, 1e3)]
        return warnings.doubtful(split, {"k_0": 1.0}, {}, **options)

    assert not doubted(100.0) and doubted(300.0)  # Pa, of a noise of 1 kPa
    assert not doubted(499.0, least=500.0) and doubted(501.0, least=500.0)


def offsets_warned(A, B, expected=0.0):
    """Warnings of offsets of both sensors, each by value and deviation, kPa, and shift of V_d of A."""
    offsets = {
        f"offset_{side}": SensorOffset(1e3 * value, 1e3 * deviation, np.array([shift]))
        for side, (value, deviation, shift) in zip("AB", (A, B), strict=True)
    }
    return warnings.offset_warnings(estimate_of({}, expected={"V_d_A": expected}, offsets=offsets))


def test_an_offset_is_said_above_three_deviations_and_where_it_moves_a_parameter():
    none = (0.0, 1.0, 0.0)
    assert offsets_warned((2.99, 1.0, 0.2), none) == []
    (text,) = offsets_warned((-3.01, 1.0, 0.2), none)
    assert text.startswith("an offset of -3.01 kPa of the sensor of P_A") and "cannot tell" not in text
    assert offsets_warned((10.0, 1.0, 0.0499), none) == [] != offsets_warned((10.0, 1.0, -0.0501), none)
    assert offsets_warned((10.0, 1.0, 0.2), none, expected=0.201) == []
    assert offsets_warned((10.0, 1.0, 0.2), none, expected=0.199) != []


def test_offsets_of_about_the_same_certainty_are_named_together():
    (both,) = offsets_warned((12.0, 2.0, 0.2), (8.9, 1.0, 0.2))  # 6 and 8.9 deviations
    assert "12 kPa of the sensor of P_A" in both and " or an offset of 8.9 kPa" in both
    assert both.endswith(": this record cannot tell which")
    (alone,) = offsets_warned((12.0, 2.0, 0.2), (9.1, 1.0, 0.2))
    assert "P_A" not in alone and "9.1 kPa of the sensor of P_B" in alone and "cannot tell" not in alone


@pytest.fixture
def tried(plant, monkeypatch):
    """Warnings of causes, from the coloured residual, Pa, before, and with some causes fitted."""

    def warned(before, after, value, also=()):
        problem = problem_of(plant, also=also)

        def fitted(trial, **_):
            theta = trial.guess()
            cause = trial.also[-1]
            theta[trial.names.index(cause)] = search_value(cause, value)
            return SimpleNamespace(theta=theta)

        def split(trial, _theta):
            return [Residual(5e3, after.get(trial.also[-1], before), 1e3)] * 2

        monkeypatch.setattr(warnings, "fit", fitted)
        monkeypatch.setattr(warnings, "residuals", split)
        return warnings.cause_warnings(problem, [Residual(5e3, before, 1e3)] * 2)

    return warned


def test_a_cause_is_named_with_its_value_and_what_it_explains(tried):
    (text,) = tried(1050.1, {"skew": 210.0}, 2.5e-3)
    assert text == (
        "an x logged 2.5 ms later than the pressures (--also skew fits it)"
        " would reduce what is not noise from 1.1 to 0.21 kPa rms"
    )
    assert tried(1e3, {"skew": 600.0}, 2.5e-3) == [] != tried(1e3, {"skew": 400.0}, 2.5e-3)
    assert tried(1e3, {"skew": 100.0}, 2.5e-3, also=("skew",)) == []  # fitted already


def test_causes_that_explain_within_1_5_of_the_best_are_named_together(tried):
    (text,) = tried(4e3, {"skew": 1e3, "filter": 1.49e3, "lag": 0.0}, 2e-3)
    assert text.startswith("an x logged 2 ms later") and " or pressures filtered" in text
    assert text.endswith("from 4 to 1 kPa rms: this record cannot tell which")
    (text,) = tried(4e3, {"skew": 1e3, "filter": 1.51e3}, 2e-3)
    assert "filter" not in text and "cannot tell" not in text
    # What is far below the noise is not distinguished either.
    (text,) = tried(4e3, {"skew": 10.0, "filter": 150.0}, 2e-3)
    assert "--also filter" in text and "--also skew" in text


def test_two_coloured_residuals_count_by_their_root_mean_square():
    split = [Residual(0.0, 300.0, 0.0), Residual(0.0, 400.0, 0.0)]
    assert warnings._coloured(split) == pytest.approx(500 / 2**0.5, rel=1e-12)


def placed(plant, where, **signals):
    """Text on the place of a misfit that is in the samples `where`, beside a little everywhere."""
    problem = problem_of(plant, **signals)
    residual = np.where(where, 2e3, 20.0)
    return warnings.place_of_misfit(problem, estimate_of({})._replace(pressure=problem.signals.P - residual))


@pytest.fixture
def blocks():
    """Samples of 0.1 s in every second, on the blocks of 20 ms over which noise averages out."""
    return (np.arange(SAMPLES) % 1000 >= 400) & (np.arange(SAMPLES) % 1000 < 500)


def test_a_misfit_is_placed_at_a_stop(plant, blocks):
    half = plant.cylinder.stroke / 2
    rests = np.convolve(blocks, np.ones(21), "same") > 0  # 10 ms longer on either side
    for end in (half, -half):
        text = placed(plant, blocks, x=np.where(rests, 0.995 * end, 0.5 * end))
        # Of 1 s, 0.12 s at the stop and 0.05 s after it.
        assert text == ", 100 % of it within 50 ms of a stop (17 % of the time)"
        assert placed(plant, blocks, x=np.where(rests, 0.9 * end, 0.5 * end)) == ""


def test_a_misfit_is_placed_after_reversals_at_small_commands_and_high_pressures(plant, blocks):
    u_max = plant.valve.u_max
    reversed_u = np.where(np.arange(SAMPLES) % 1000 < 400, 0.5, -0.5) * u_max
    after = (np.arange(SAMPLES) % 1000 >= 400) & (np.arange(SAMPLES) % 1000 < 440)
    assert "within 50 ms of a reversal of u" in placed(plant, after, u=reversed_u)
    small = np.where(blocks, 0.05, 0.5) * u_max
    assert (
        placed(plant, blocks, u=small)
        == ", 100 % of it where u is below 10 % of its limit (10 % of the time)"
    )
    assert placed(plant, blocks, u=np.where(blocks, 0.15, 0.5) * u_max) == ""
    high = np.array([np.where(blocks, 6e5, 3e5), np.full(SAMPLES, 3e5)])
    assert placed(plant, blocks, P=high) == ", 100 % of it above 480 kPa (10 % of the time)"
    assert placed(plant, ~blocks, P=high) == "" == placed(plant, blocks | ~blocks, P=high)


def test_a_place_where_the_record_mostly_is_says_nothing(plant, blocks):
    high = np.array([np.where(blocks, 3e5, 6e5), np.full(SAMPLES, 3e5)])
    assert placed(plant, ~blocks, P=high) == ""  # all of the misfit, in nine tenths of the time


def test_what_is_configured_is_doubted_outside_its_accuracy_by_more_than_its_interval(plant):
    known = accuracy()
    signals = problem_of(plant).signals
    problem = problem_of(plant, priors=priors(plant, signals, known, 1e3))
    centre, deviation, _ = problem.priors["P_s"]
    usual = {name: si_value(name, x) for name, x in zip(problem.names, problem.guess(), strict=True)}
    usual |= {name: si_value(name, prior.centre) for name, prior in problem.priors.items()}

    def warned(distance, half=0.0):
        P_s = np.exp(centre + distance * deviation)
        ends = ({"P_s": P_s * np.exp(sign * half * deviation)} for sign in (-1, 1))
        return warnings.configured_warnings(problem, estimate_of(usual | {"P_s": P_s}, *ends))

    configured = plant.conditions.P_s
    assert warned(2.0) == [] == warned(-2.0)
    (text,) = warned(4.0)
    P_s = configured * np.exp(4 * deviation)
    assert text.startswith(f"a supply of {P_s / 1e3:.4g} kPa (configured: {configured / 1e3:.4g})")
    assert text.endswith("is outside its stated accuracy (--also P_s fits it freely)")
    assert len(warned(-4.0)) == 1
    # An interval of half two deviations of 95 per cent adds to the accuracy: four of those allowed are 9.
    assert warned(4.0, half=2 * 1.96) == [] != warned(9.0, half=2 * 1.96)
    assert warned(4.0, half=np.nan) == []  # an open end contradicts nothing


def test_a_reduced_models_residual_is_said_in_kPa_by_chamber():
    split = {"A": Residual(2345.5, 450.1, 1050.1), "B": Residual(2e3, 390.0, 1e3)}
    (text,) = warnings.residual_warnings("M8", split)
    assert text.startswith(
        "P_A: M8 is off by 2.35 kPa rms, of which 0.45 kPa are not noise (sensor: 1.1 kPa)"
    )


def test_the_full_orders_residual_is_said_with_its_effect(plant):
    problem, split = problem_of(plant), [Residual(2350.1, 410.0, 1050.1), Residual(3e3, 390.0, 1e3)]
    remainder = {"k_0": np.log(2.0), "k_xu": np.log(1.01)}
    estimate = estimate_of({}, remainder=remainder)._replace(pressure=problem.signals.P - 10.0)
    text = warnings.remainder_warning(problem, estimate, split)
    assert (
        "is off by 2.4 and 3 kPa rms, of which 0.41 and 0.39 kPa are not noise (sensors: 1.1 and 1 kPa)"
        in text
    )
    assert "this moves k_0 by 100 %, k_x k_u by 1 %, or more" in text
    far = estimate._replace(remainder={"k_0": 5.01 * 0.15})
    assert warnings.remainder_warning(problem, far, split).endswith("do not trust these parameters")


@pytest.mark.parametrize(("ratio", "odd"), [(1.99, False), (2.01, True), (0.501, False), (0.499, True)])
def test_a_dead_volume_is_odd_over_twice_or_under_half_of_the_default(plant, ratio, odd):
    volume = ratio * plant.cylinder.V_d_A
    assert bool(warnings.dead_volume_warnings("V_d_A", volume, plant)) == odd


def test_a_valve_is_early_in_a_note_below_a_sample_and_in_a_warning_from_one_on(plant):
    problem = problem_of(plant)
    usual = {name: si_value(name, x) for name, x in zip(problem.names, problem.guess(), strict=True)}

    def said(ms, high):
        estimate = estimate_of(usual | {"dead_time": 1e-3 * ms}, {}, {"dead_time": 1e-3 * high})
        doubts = warnings.parameter_warnings(problem, estimate)
        return warnings.early_notes(problem, estimate), [
            text for text in doubts if "--command linear" in text
        ]

    (note,), none = said(-0.99, -0.5)
    assert note.startswith("the valve acts 0.99 ms before its command was logged, less than a sample of 1 ms")
    none_noted, (warning,) = said(-1.01, -0.5)
    assert none == none_noted == [] and warning.parameters == ("dead_time",)
    assert said(-0.99, -0.05) == said(-1.01, 0.5) == ([], [])  # the interval reaches what clocks explain


def test_intervals_that_touch_or_have_an_open_end_are_not_apart():
    assert warnings.apart([(1.0, 2.0), (2.01, 3.0)]) and not warnings.apart([(1.0, 2.0), (2.0, 3.0)])
    assert not warnings.apart([(1.0, np.nan), (2.0, 3.0)]) and not warnings.apart([(1.0, 2.0), (np.nan, 3.0)])
    assert not warnings.apart([(1.0, 2.0)])


def test_reduced_models_on_a_bound_are_named_down_to_the_first_without():
    def model(value, *reached):
        return estimate_of({"k_0": value, "k_xu": 1e-6}, at_bound=reached)

    fits = {
        "full": model(9.0, "k_0"),
        "M8": model(0.02, "k_0"),
        "M9": model(0.5, "lag"),
        "M7": model(1, "k_0"),
    }
    (text,) = warnings.bounds_of_reduced(fits, ("k_0", "k_xu"))
    assert text == "M8: k_0 is on the bound of the search: 0.02 W K-1; not offered for a replay"
    del fits["M9"], fits["full"]
    assert [text[:3] for text in warnings.bounds_of_reduced(fits, ("k_0",))] == ["M8:", "M7:"]
    assert warnings.bounds_of_reduced({"full": model(9.0), "M8": model(0.02, "k_0")}, ("k_0",)) != []


# On either side of where two digits are rounded up: a factor of 1.001 would be seen.
NEAR_1_KPA = [(994.9, "0.99"), (995.1, "1")]


@pytest.mark.parametrize(("Pa", "kPa"), NEAR_1_KPA)
def test_pressures_of_warnings_are_exact_to_their_last_digit(plant, tried, Pa, kPa):
    (text,) = warnings.residual_warnings("M8", {"A": Residual(9970.0, Pa, Pa)})
    assert f"off by 9.97 kPa rms, of which {kPa} kPa are not noise (sensor: {kPa} kPa)" in text
    problem = problem_of(plant)
    estimate = estimate_of({})._replace(pressure=problem.signals.P - 10.0)
    text = warnings.remainder_warning(problem, estimate, [Residual(Pa, Pa, Pa)] * 2)
    both = f"{kPa} and {kPa}"
    assert f"off by {both} kPa rms, of which {both} kPa are not noise (sensors: {both} kPa)" in text
    (text,) = tried(10 * Pa, {"skew": Pa}, 2e-3)
    assert text.endswith(f"from {'9.9' if Pa < 995 else '10'} to {kPa} kPa rms")
    usual = {name: si_value(name, x) for name, x in zip(problem.names, problem.guess(), strict=True)}
    early = estimate_of(usual | {"dead_time": -1e-6 * Pa}, {}, {"dead_time": -5e-4})
    (note,) = warnings.early_notes(problem, early)
    assert note.startswith(f"the valve acts {kPa} ms before")
