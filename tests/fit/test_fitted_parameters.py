"""Table of fitted parameters: how far each search goes, on which scale, and the parameters of each record."""

import pytest

from pneumo.fit.fitted_parameters import (
    CONFIGURED,
    MOST_RECORDS,
    PARAMETERS,
    QUANTITIES,
    REPORTED,
    STARTS,
    STARTS_OF_ONE,
)

# Lowest value, highest and start of a search that no configured value scales; a wider or narrower one puts
# other parameters on their bounds.
SEARCHES = {
    "n": (0.8, 1.8, 1.2),  # isothermal is 1, the largest gamma of a gas 5/3
    "k_0": (0.3, 1000.0, "catalogue"),  # W/(m^2 K): a tenth of still air, ten times a jet
    "k_xu": (0.05, 20.0, "valve.k_xu"),
    "V_d_A": (0.02, 50.0, "cylinder.V_d_A"),
    "V_d_B": (0.02, 50.0, "cylinder.V_d_B"),
    "start_A": (0.1, 3.0, "record"),
    "start_B": (0.1, 3.0, "record"),
    "lag": (0.0, 0.05, 0.0),  # s
    "dead_time": (-0.02, 0.05, 0.0),  # s
    "null": (-0.1, 0.1, 0.0),  # of the largest command
    "b": (0.02, 0.8, "gas.critical_ratio"),
    "P_s": (0.5, 2.0, "conditions.P_s"),
    "exhaust": (0.2, 5.0, "valve.exhaust"),
    "T_in": (0.8, 1.25, "conditions.T_in"),
    "A_B": (0.5, 2.0, "cylinder.A_B"),
    "C_B": (0.3, 3.0, 1.0),
    "dead_band": (0.0, 0.2, 0.0),  # of the largest command
    "hysteresis": (0.0, 0.1, 0.0),
    "sag": (0.0, 0.6, 0.0),
    "piston_leak": (0.0, 0.3, 0.0),  # of the valve's C
    "valve_leak": (0.0, 0.3, 0.0),
    "skew": (-0.03, 0.03, 0.0),  # s
    "filter": (0.0, 0.05, 0.0),  # s
    "offset_A": (-1e5, 1e5, 0.0),  # Pa
    "offset_B": (-1e5, 1e5, 0.0),
}


@pytest.mark.parametrize("name", SEARCHES)
def test_a_search_goes_as_far_as_the_parameter_may_be(name):
    assert PARAMETERS[name].search[:3] == SEARCHES[name]


def test_a_search_is_linear_where_the_parameter_may_be_zero_or_its_range_is_small():
    linear = {name for name, row in PARAMETERS.items() if not row.search.logarithmic}
    from_zero = {name for name, row in PARAMETERS.items() if row.search.low <= 0}
    assert linear == from_zero | {"n", "b", "T_in"}


def test_starts_are_the_first_pressures_and_temperatures_of_each_of_eight_records():
    assert STARTS_OF_ONE == ("start_A", "start_B", "start_T_A", "start_T_B") == STARTS[:4]
    assert MOST_RECORDS == 8 and len(STARTS) == 4 * MOST_RECORDS
    assert STARTS[4] == "start_2_A" and STARTS[-1] == "start_T_8_B"
    quantity = QUANTITIES["start_T_8_B"]
    assert quantity.name == "the first temperature of B in record 8"
    assert quantity.heading == "first T of B in record 8"
    assert QUANTITIES["start_T_B"].name == "the first temperature of B"  # of a record alone
    assert PARAMETERS["start_T_8_B"].search == PARAMETERS["start_T_B"].search


def test_intervals_are_of_all_parameters_but_starts_causes_and_what_is_configured():
    assert CONFIGURED == ("b", "P_s", "exhaust", "T_in")
    assert REPORTED == ("n", "k_0", "k_xu", "V_d_A", "V_d_B", "lag", "dead_time", "null")
