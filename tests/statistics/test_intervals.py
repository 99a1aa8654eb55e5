"""Intervals where samples are few."""

import numpy as np
import pytest

from pneumo.statistics.intervals import FEWEST, quotient_interval


@pytest.mark.parametrize("counted", [0, 1, FEWEST - 1, FEWEST, FEWEST + 1])
def test_a_quotient_has_an_interval_from_enough_samples_that_count(counted):
    sums, counts = np.zeros(30), np.zeros(30)
    sums[:counted], counts[:counted] = np.arange(counted), 2.0
    value, low, high = quotient_interval(sums, counts)
    if counted:
        assert value == pytest.approx(sums.sum() / (2 * counted))
    assert np.isfinite([low, high]).all() == (counted >= FEWEST) and not low > high
