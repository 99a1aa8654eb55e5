"""Comparison of findings with printed numbers, and how numbers are written."""

import pytest

from pneumo.verdict.claims import Claim, ToleranceClass
from pneumo.verdict.comparison import as_printed, compare
from pneumo.verdict.sources import Finding


def claim(**changes) -> Claim:
    fields = {"id": "X", "where": "", "printed": "2.0", "kind": "rounded", "tolerance": "x", "compute": "x"}
    fields |= {"evidence": {"path": "results/x", "select": ""}}
    return Claim(**fields | changes)


def agreement(finding, measure, limit, floor=0.0, **changes):
    tolerance = ToleranceClass(measure=measure, limit=limit, floor=floor)
    return compare(claim(**changes), tolerance, finding).agreement


@pytest.mark.parametrize(
    ("value", "measure", "limit", "changes", "expected"),
    [
        (2.05, "relative", 0.1, {}, "exact"),  # the edge of half a unit
        (2.0501, "relative", 0.1, {}, "close"),
        (2.2, "relative", 0.1, {}, "close"),  # the edge of the class
        (2.2001, "relative", 0.1, {}, None),
        (1.7999, "relative", 0.1, {}, None),
        (2.06, "absolute", 0.05, {}, None),
        (1.0, "relative", 0.1, {"sense": "at_most"}, "exact"),
        (2.2, "relative", 0.1, {"sense": "at_most"}, "close"),
        (2.3, "relative", 0.1, {"sense": "at_most"}, None),
        (2.5, "sigma", 0.1, {"sigma": 5.0}, "close"),
        (2.6, "sigma", 0.1, {"sigma": 5.0}, None),
        (24.0, "relative", 0.0, {"printed": "20", "digits": 1}, "exact"),
        (0.205, "relative", 0.0, {"printed": "20", "scale": 0.01}, "exact"),
        (-2.05, "relative", 0.0, {"printed": "-2.0"}, "exact"),
        (0.1, "log10", 0.1, {"sense": "at_most"}, "exact"),
        (0.11, "log10", 0.1, {"sense": "at_most"}, None),
        (0.11, "log10", 0.1, {"sense": "at_least"}, "exact"),
        (-0.2, "log10", 0.1, {"sense": "at_least"}, None),
        (0.0118, "relative", 0.02, {"printed": "0.0108", "floor": 0.001}, "close"),
        (0.0118, "relative", 0.02, {"printed": "0.0108"}, None),
    ],
)
def test_numbers(value, measure, limit, changes, expected):
    assert agreement(Finding(value), measure, limit, **changes) == expected


@pytest.mark.parametrize(
    ("finding", "measure", "limit", "changes", "expected"),
    [
        (Finding(2.09, swing=10.0), "swing", 0.01, {}, "close"),
        (Finding(2.11, swing=10.0), "swing", 0.01, {}, None),
        (Finding(low=2.3, high=3.0), "relative", 0.1, {}, None),
        (Finding(low=1.0, high=3.0), "relative", 0.1, {}, "close"),  # the paper does not say which run
        (Finding(holds=True), "truth", 0.0, {}, "exact"),
        (Finding(holds=False), "truth", 0.0, {}, None),
        (Finding(shown="×"), "absolute", 0.0, {"printed": "×"}, "exact"),
        (Finding(shown="✓"), "absolute", 0.0, {"printed": "×"}, None),
    ],
)
def test_swings_intervals_statements_and_marks(finding, measure, limit, changes, expected):
    assert agreement(finding, measure, limit, **changes) == expected


@pytest.mark.parametrize(
    ("value", "changes", "exact", "text"),
    [
        (1.2345e7, {"printed": "1.16e7"}, False, "1.23e7"),
        (1.1649e7, {"printed": "1.16e7"}, True, "1.16e7"),
        (1.1601e7, {"printed": "1.16e7"}, False, "1.1601e7"),  # not equal, so it must not look so
        (0.05, {"printed": "0.5"}, False, "0.05"),
        (41.2e6, {"printed": "45.0", "scale": 1e6}, False, "41.2"),
        (-23.4, {"printed": "-6.14e1"}, False, "-2.34e1"),
        (0.547, {"printed": "40", "scale": 0.01}, False, "55"),
        (1056, {"printed": "912"}, False, "1056"),
    ],
)
def test_value_is_written_like_the_printed_one(value, changes, exact, text):
    assert as_printed(value, claim(**changes), exact) == text
