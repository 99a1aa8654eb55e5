"""Results of a fit: lights, order, the model that a configuration gets, and a summary without NaN."""

import json

import numpy as np
import pytest

from pneumo.fitting.fit_result import (
    ADDS_LITTLE,
    NO_REFERENCE,
    Estimate,
    FitResult,
    FitWarning,
    Reference,
    fit_data,
    judged,
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


T_IN, SUPPLY, NULL = Reference(131.0, 6.0), Reference(1.39, 0.04), Reference(2.0)  # searched, and stated
LIGHTS = [  # value, ends, widths to compare with, colour without and with a doubt
    ("k_0", 1.0, (1.0, 1.4), NO_REFERENCE, "green", "yellow"),
    ("k_0", 1.0, (1.0, 1.6), NO_REFERENCE, "yellow", "yellow"),
    ("k_0", 1.0, (1.0, 3.1), NO_REFERENCE, "red", "red"),
    ("k_0", 1.0, (np.nan, 1.1), NO_REFERENCE, "red", "red"),
    ("k_0", 1.0, (0.9, np.nan), NO_REFERENCE, "red", "red"),
    ("lag", 1e-3, (np.nan, 2e-3), NO_REFERENCE, "green", "yellow"),  # its search begins at zero
    ("lag", 1e-3, (0.0, np.nan), NO_REFERENCE, "red", "red"),
    ("dead_time", 1e-3, (np.nan, 2e-3), NO_REFERENCE, "red", "red"),  # it may be negative
    # Green up to a twentieth of the search, red above a seventh.
    ("lag", 1e-3, (np.nan, 0.004), Reference(0.1), "green", "yellow"),
    ("lag", 1e-3, (np.nan, 0.008), Reference(0.1), "yellow", "yellow"),
    ("lag", 1e-3, (np.nan, 0.04), Reference(0.1), "red", "red"),
    ("null", 0.0, (-0.04, 0.04), NULL, "green", "yellow"),
    ("null", 0.0, (-0.06, 0.06), NULL, "yellow", "yellow"),
    ("null", 0.0, (-0.15, 0.15), NULL, "red", "red"),
    ("T_in", 293.0, (290.5, 295.5), T_IN, "yellow", "yellow"),  # hardly narrower than is stated
    ("T_in", 293.0, (290.7, 295.3), T_IN, "green", "yellow"),
    ("P_s", 650e3, (637e3, 663e3), SUPPLY, "yellow", "yellow"),
    ("P_s", 650e3, (645e3, 655e3), SUPPLY, "green", "yellow"),
    ("b", 0.35, (0.05, 0.65), Reference(0.78, 1.0), "yellow", "yellow"),  # red but for what is stated
    ("b", 0.35, (0.05, 0.65), Reference(0.78), "red", "red"),
]


@pytest.mark.parametrize(("name", "value", "ends", "reference", "colour", "doubted"), LIGHTS)
def test_a_light_is_that_of_the_intervals_width_and_of_doubt(name, value, ends, reference, colour, doubted):
    interval = Interval(value, *ends)
    assert judged(name, interval, reference=reference)[0] == colour
    assert judged(name, interval, ["odd"], reference)[0] == doubted


def test_a_line_says_where_the_record_adds_little_to_the_configuration():
    fits = {"full": model({"T_in": 293.0, "k_0": 0.5}, 500.0, factor=1.01)}
    fit = result(fits, references={"T_in": Reference(131.0, 6.0)})
    assert fit.lights["T_in"] == "yellow" and fit.reasons == {"T_in": ADDS_LITTLE}


def test_a_warning_colours_what_it_names_and_one_that_names_nothing_all():
    fits = {"full": model({"k_0": 0.5, "k_xu": 1e-6, "start_A": 4e5}, 500.0)}
    named = result(fits, of_rig=(FitWarning("the valve is odd", "k_xu"),))
    assert named.lights == {"k_0": "green", "k_xu": "yellow"}  # no light for a first pressure
    assert named.reasons == {"k_xu": "the valve is odd"}
    assert set(result(fits, of_rig=("rig",)).lights.values()) == {"yellow"}
    wide = result({"full": model({"k_0": 0.5, "k_xu": 1e-6}, 500.0, factor=1.3)})
    assert wide.reasons == dict.fromkeys(("k_0", "k_xu"), "wide interval")
    doubts = FitWarning("first of two words " * 4, "k_0"), FitWarning("second", "k_0")
    (text,) = result(fits, of_rig=doubts).reasons.values()
    assert text.startswith("first of two") and text.endswith(" ...") and len(text) <= 48
    vague = result({"full": model({"k_0": 0.5}, 500.0, factor=2.0)}, of_rig=("rig",))
    assert vague.reasons == {"k_0": "open or too wide an interval"}
    assert result({"M8": model({"k_0": 0.5}, 500.0)}).lights == {}


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
