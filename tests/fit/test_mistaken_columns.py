"""A mistake in the columns is named only where its correction makes a quick fit far better."""

from types import SimpleNamespace

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
    text = told(99.9, 9.99, 50, 50, 30)
    assert text.startswith("m.csv: columns P_A and P_B look swapped")
    assert text.endswith("a quick fit of M6 is then off by 9.99 kPa RMS, and by 99.9 kPa as the columns are")
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


@pytest.mark.parametrize(("samples", "fitted"), [(6000, 4001), (300, 300)])
def test_the_error_is_that_of_a_fit_to_the_first_four_seconds_with_air_between_its_two_limits(
    monkeypatch, plant, samples, fitted
):
    def signals(period, u, x, P, plant, *, command, P_s, m):
        assert [s.shape[-1] for s in (u, x, P, P_s, m)] == [fitted] * 5
        return "signals"

    def problem(model, plant, record, fixed):
        assert record == "signals" and 1.0 < fixed["n"] < plant.gas.gamma

    def fit(problem, *, tolerance, most):
        assert tolerance < 0.1
        return SimpleNamespace(residual=np.array([[3e-3, 0.0], [-4e-3, 0.0]]))

    for name, function in (("stage_signals", signals), ("Problem", problem), ("fit", fit)):
        monkeypatch.setattr(mistaken_columns, name, function)
    u = np.zeros(samples)
    record = Measurement("m.csv", 1e-3, u, u, np.array([u, u]), m=np.array([u, u]), P_s=u)
    error = mistaken_columns.quick_fit_error(record, plant, "held")
    assert error == pytest.approx(2.5e-3 * plant.conditions.P_s, rel=1e-12)
