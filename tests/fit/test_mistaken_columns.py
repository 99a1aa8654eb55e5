"""A mistake in the columns is named only where its correction makes a quick fit far better."""

import numpy as np
import pytest

from pneumo.fit import mistaken_columns
from pneumo.fit.mistaken_columns import corrected, mistake
from pneumo.fit.record.measurement import Measurement

RECORD = Measurement("m.csv", 1e-3, np.arange(3.0), np.arange(3.0) + 1, np.array([[2e5] * 3, [3e5] * 3]))
FLOWS = RECORD._replace(m=np.array([[1e-3] * 3, [-2e-3] * 3]))


@pytest.fixture
def told(monkeypatch, plant):
    """Sentence for rms errors of quick fits, kPa: as given, and with each correction in its order."""

    def of(as_given, *corrections):
        errors = iter([as_given, *corrections])
        monkeypatch.setattr(mistaken_columns, "quick_fit_error", lambda *_: 1e3 * next(errors))
        return mistake(RECORD, plant)

    return of


def test_a_correction_that_is_a_little_better_is_no_mistake(told):
    assert told(10, 20, 20, 20, 9) == told(10, 20, 20, 20, 7) == told(10, 20, 20, 20, 20) == ""
    assert "gauge" in told(10, 20, 20, 20, 3)


def test_the_best_correction_is_named_with_both_errors_in_kPa(told):
    text = told(12.3, 2.1, 9, 9, 3)
    assert text.startswith("m.csv: columns P_A and P_B look swapped")
    assert text.endswith("a quick fit of M6 is then off by 2.1 kPa RMS, and by 12.3 kPa as the columns are")
    assert "column x seems to have the wrong sign: chamber A" in told(10, 9, 1, 9, 3)
    assert "column u seems to have the wrong sign: positive" in told(10, 9, 9, 1, 3)


def test_each_correction_undoes_its_mistake():
    swapped, x, u, gauge = corrected(RECORD, 1e5).values()
    of_flows = [right.m for right in corrected(FLOWS, 1e5).values()]
    for found, expected in (
        (swapped.P, RECORD.P[::-1]),
        (x.x, -RECORD.x),
        (u.u, -RECORD.u),
        (gauge.P, RECORD.P + 1e5),
        (of_flows[2], -FLOWS.m),
        (of_flows[3], FLOWS.m[::-1]),
    ):
        np.testing.assert_array_equal(found, expected)
    assert len(of_flows) == 5  # no command that could have the wrong sign
