"""Results of a fit: lights, order, the model that a configuration gets, and a summary without NaN."""

import json

import numpy as np
import pytest

from pneumo.fitting.fit_result import (
    ADDS_LITTLE,
    Estimate,
    FitResult,
    FitWarning,
    Reference,
    equally_good,
    first_words,
    fit_data,
    light,
    rms_of_chambers,
)
from pneumo.fitting.record.measurement import Measurement
from pneumo.statistics.intervals import Interval

NONE = np.zeros((2, 0))
PARAMETERS = ("k_0", "k_xu", "V_d_A", "lag", "T_in", "start_A")


def model(values, error, *, factor=1.1, at_bound=(), **more):
    low, high = ({name: value * f for name, value in values.items()} for f in (1 / factor, factor))
    P = np.full((2, 3), 4e5)
    return Estimate(values, low, high, np.full(2, 900.0), np.array([error] * 2), P, at_bound=at_bound, **more)


def result(estimates, **more):
    m = Measurement("m.csv", 1e-3, np.zeros(3), np.zeros(3), np.full((2, 3), 4e5))
    data = fit_data(m, estimates, PARAMETERS)
    return FitResult(data=data, notes=("n",), warnings=("w",), held_out_from=0.001, **more)


LIGHTS = [(1.4, False, "green"), (1.6, False, "yellow"), (1.4, True, "yellow")]
LIGHTS += [(2.9, True, "yellow"), (3.1, False, "red")]


@pytest.mark.parametrize(("ratio", "doubted", "colour"), LIGHTS)
def test_a_light_is_that_of_the_intervals_width_and_of_doubt(ratio, doubted, colour):
    assert light("k_0", Interval(1.0, 1.0, ratio), doubted) == colour


def test_an_open_end_is_red_but_a_search_from_zero_needs_no_lower_one():
    assert (
        light("k_0", Interval(1.0, np.nan, 1.1), False)
        == light("k_0", Interval(1.0, 0.9, np.nan), False)
        == "red"
    )
    assert light("lag", Interval(1e-3, np.nan, 2e-3), False) == "green"
    assert light("lag", Interval(1e-3, 0.0, np.nan), False) == "red"
    of_search = Reference(searched=0.1)  # s: green up to a twentieth of it, red above a seventh
    for high, colour in ((0.004, "green"), (0.008, "yellow"), (0.04, "red")):
        assert light("lag", Interval(1e-3, np.nan, high), False, of_search) == colour
    assert light("dead_time", Interval(1e-3, np.nan, 2e-3), False) == "red"  # it may be negative


@pytest.mark.parametrize(
    ("name", "half", "reference", "colour"),
    [
        ("T_in", 3.3, Reference(131.0, 6.0), "yellow"),  # as wide as the configuration says
        ("T_in", 2.5, Reference(131.0, 6.0), "yellow"),
        ("T_in", 2.3, Reference(131.0, 6.0), "green"),
        ("P_s", 13e3, Reference(1.39, 0.04), "yellow"),  # 2 % of 650 kPa
        ("P_s", 5e3, Reference(1.39, 0.04), "green"),
        ("b", 0.3, Reference(0.78, 1.0), "yellow"),  # narrower than stated, but red without that
        ("b", 0.3, Reference(0.78), "red"),
        ("null", 0.04, Reference(2.0), "green"),  # 5 % of the range is 0.1 V, 14 % is 0.28 V
        ("null", 0.06, Reference(2.0), "yellow"),
        ("null", 0.15, Reference(2.0), "red"),
    ],
)
def test_what_may_be_zero_is_judged_by_its_search_and_what_is_configured_by_its_accuracy(
    name, half, reference, colour
):
    value = {"T_in": 293.0, "P_s": 650e3, "b": 0.35, "null": 0.0}[name]
    interval = Interval(value, value - half, value + half)
    assert light(name, interval, False, reference) == colour
    assert light(name, interval, True, reference) == ("yellow" if colour == "green" else colour)


def test_a_line_says_where_the_record_adds_little_to_the_configuration():
    fits = {"full": model({"T_in": 293.0, "k_0": 0.5}, 500.0, factor=1.01)}
    fit = result(fits, references={"T_in": Reference(131.0, 6.0)})
    assert fit.lights["T_in"] == "yellow" and fit.reasons == {"T_in": ADDS_LITTLE}


def test_models_within_5_percent_of_the_best_are_equally_good():
    fits = {"M8": model({}, 1000.0), "M9": model({}, 1049.0), "M7": model({}, 1051.0)}
    assert equally_good(fits) == ["M8", "M9"]
    assert rms_of_chambers(np.array([3.0, 4.0])) == pytest.approx(12.5**0.5)
    assert rms_of_chambers(np.array([3.0, np.nan])) == 3.0


def test_a_warning_colours_what_it_names_and_one_that_names_nothing_all():
    fits = {"full": model({"k_0": 0.5, "k_xu": 1e-6, "start_A": 4e5}, 500.0)}
    named = result(fits, of_rig=(FitWarning("the valve is odd", "k_xu"),))
    assert named.lights == {"k_0": "green", "k_xu": "yellow"}  # no light for a first pressure
    assert named.reasons == {"k_xu": "the valve is odd"}
    assert set(result(fits, of_rig=("rig",)).lights.values()) == {"yellow"}
    wide = result({"full": model({"k_0": 0.5, "k_xu": 1e-6}, 500.0, factor=1.3)})
    assert wide.reasons == dict.fromkeys(("k_0", "k_xu"), "wide interval")
    vague = result({"full": model({"k_0": 0.5}, 500.0, factor=2.0)}, of_rig=("rig",))
    assert vague.reasons == {"k_0": "open or too wide an interval"}
    assert result({"M8": model({"k_0": 0.5}, 500.0)}).lights == {}


def test_first_words_end_at_a_word():
    assert first_words("short") == "short"
    words = first_words("a warning with many words " * 4)
    assert len(words) <= 48 and words.endswith(" ...") and words.startswith("a warning with many words a")


def test_the_best_model_is_the_first_reduced_one_without_a_parameter_on_its_bound():
    k_0 = {"k_0": 0.5}
    bound = model(k_0, 600.0, at_bound=("k_0",))
    fits = {"full": model(k_0, 500.0), "M8": bound, "M9": model(k_0, 700.0)}
    assert result(fits).best_model == "M9" and result({"full": fits["full"], "M8": bound}).best_model == "M8"
    assert result(fits).on_bound("M8") and not result(fits).on_bound("M9")
    assert result(fits).model_of_rig == "full"
    blind = fits["full"]._replace(low={}, high={})
    assert result(fits | {"full": blind}).model_of_rig == result({"M9": fits["M9"]}).model_of_rig == "M9"


def test_a_full_order_is_replayed_with_its_own_values_and_reported_with_the_mean():
    full = model({"k_0": 0.5, "k_xu": 1e-6}, 500.0, averaged={"k_0": 0.55})
    of_full = result({"full": full})
    assert of_full.estimates("full")["k_0"] == Interval(0.55, 0.5 / 1.1, 0.5 * 1.1)
    assert of_full.replayed("full")["k_0"] == Interval(0.5, 0.5 / 1.1, 0.5 * 1.1)
    assert "V_d_A" not in of_full.estimates("full")


def test_a_summary_has_plain_numbers_and_none_where_an_end_is_open():
    full = model({"k_0": 0.5}, 500.0)
    summary = result({"full": full._replace(low={"k_0": np.nan})}).summary()
    json.dumps(summary, allow_nan=False)
    k_0 = summary["models"]["full"]["parameters"]["k_0"]
    assert k_0 == {"value": 0.5, "low": None, "high": 0.5 * 1.1, "unit": "W K-1"}
    assert summary["lights"] == {"k_0": "red"} and summary["held_out_from"] == 0.001
    assert (summary["notes"], summary["warnings"]) == (["n"], ["w"])
    assert summary["models"]["full"]["rms_held_out"] == [500.0, 500.0]


def test_a_correlation_is_of_the_parameters_that_a_model_has():
    related = {"k_0": {"k_0": 1.0, "k_xu": -0.3}, "k_xu": {"k_0": -0.3, "k_xu": 1.0}}
    table = result({"full": model({"k_0": 0.5, "k_xu": 1e-6}, 500.0, correlation=related)}).correlation(
        "full"
    )
    assert list(table.columns) == list(table.index) == ["k_0", "k_xu"]
    assert table.loc["k_0", "k_xu"] == -0.3


def test_of_several_good_models_the_best_is_offered_and_of_several_doubts_the_first_is_said():
    fits = {name: model({"k_0": 0.5}, error) for name, error in (("M8", 6e2), ("M9", 7e2), ("M7", 8e2))}
    assert result(fits).best_model == "M8"
    doubts = FitWarning("first of two", "k_0"), FitWarning("second of two", "k_0")
    of_full = result({"full": model({"k_0": 0.5}, 500.0)}, of_rig=doubts)
    assert of_full.reasons == {"k_0": "first of two"}
