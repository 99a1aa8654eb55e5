"""Results of a fit: lights, order, the model that a configuration gets, and a summary without NaN."""

import json

import numpy as np
import pytest

from pneumo.fitting.fit_result import Estimate, FitResult, fit_data
from pneumo.fitting.lights import light_and_reason, within_commands
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


OPEN = np.nan
LIGHTS = [  # parameter, ends, widths of the search and of what is stated, colour
    ("k_0", (1.0, 1.4), (), "green"),
    ("k_0", (1.0, 1.6), (), "yellow"),
    ("k_0", (1.0, 3.1), (), "red"),
    ("k_0", (OPEN, 1.1), (), "red"),
    ("k_0", (0.9, OPEN), (), "red"),
    ("lag", (OPEN, 2e-3), (), "green"),  # its search begins at zero
    ("lag", (0.0, OPEN), (), "red"),
    ("dead_time", (OPEN, 2e-3), (), "red"),  # it may be negative
    # Green up to a twentieth of the search, red above a seventh.
    ("lag", (OPEN, 0.004), (0.1,), "green"),
    ("null", (-0.06, 0.06), (2.0,), "yellow"),
    ("null", (-0.15, 0.15), (2.0,), "red"),
    ("T_in", (290.5, 295.5), (131.0, 6.0), "as stated"),  # hardly narrower than is stated
    ("T_in", (290.7, 295.3), (131.0, 6.0), "green"),
    ("P_s", (637e3, 663e3), (1.39, 0.04), "as stated"),
    ("P_s", (645e3, 655e3), (1.39, 0.04), "green"),
    ("b", (0.05, 0.65), (0.78, 1.0), "as stated"),  # red but for what is stated
    ("b", (0.05, 0.65), (0.78,), "red"),
]


@pytest.mark.parametrize(("name", "ends", "widths", "colour"), LIGHTS)
def test_a_light_is_that_of_the_intervals_width_and_of_doubt(name, ends, widths, colour):
    interval = Interval(np.nan, *ends)
    assert light_and_reason(name, interval, (), *widths)[0] == colour
    doubted, reason = light_and_reason(name, interval, ["first", "second"], *widths)
    assert doubted == ("red" if colour == "red" else "yellow")
    assert colour == "red" or reason.endswith("see the warnings")


@pytest.mark.parametrize(("reached", "light"), [(9.5, "green"), (4.5, "yellow")])
def test_the_valves_coefficient_is_green_up_to_the_largest_command_only(reached, light):
    found = within_commands({"k_xu": ("green", ""), "k_0": ("green", "")}, reached, 10.0)
    assert found["k_xu"][0] == light and found["k_0"] == ("green", "")
    assert light == "green" or "4.5 of 10 V" in found["k_xu"][1]


def test_the_best_model_is_the_first_reduced_one_without_a_parameter_on_its_bound():
    k_0 = {"k_0": 0.5}
    bound = model(k_0, 600.0, at_bound=("k_0",))
    fits = {"full": model(k_0, 500.0), "M8": bound, "M9": model(k_0, 700.0)}
    assert result(fits).best_model == "M9" and result({"full": fits["full"], "M8": bound}).best_model == "M8"
    assert result(fits).on_bound("M8") and not result(fits).on_bound("M9")
    assert result(fits).model_of_rig == "full"
    blind = fits["full"]._replace(low={}, high={})
    assert result(fits | {"full": blind}).model_of_rig == result({"M9": fits["M9"]}).model_of_rig == "M9"


def test_a_summary_has_plain_numbers_and_none_where_an_end_is_open():
    full = model({"k_0": 0.5}, 500.0)
    full = full._replace(low={"k_0": np.nan})
    summary = result({"full": full}, judgements={"k_0": ("red", "open")}).summary()
    json.dumps(summary, allow_nan=False)
    k_0 = summary["models"]["full"]["parameters"]["k_0"]
    assert k_0 == {"value": 0.5, "low": None, "high": 0.5 * 1.1, "unit": "W K-1"}
    assert summary["lights"] == {"k_0": "red"} and summary["held_out_from"] == 0.001
    assert (summary["notes"], summary["warnings"]) == (["n"], ["w"])
    assert summary["models"]["full"]["rms_held_out"] == [500.0, 500.0]
