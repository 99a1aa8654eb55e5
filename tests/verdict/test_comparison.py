"""Comparison of findings with printed numbers, and how numbers are written."""

import math

import pytest

from pneumo.verdict.claims import Claim, ToleranceClass
from pneumo.verdict.comparison import as_printed, compare, relative_deviation, where_true
from pneumo.verdict.sources import Finding


def claim(**changes) -> Claim:
    fields = {"id": "X", "where": "", "printed": "2.0", "kind": "rounded", "basis": "measured"}
    fields |= {"tolerance": "x", "compute": "x", "evidence": {"path": "results/x", "select": ""}}
    return Claim(**fields | changes)


def agreement(finding, measure, limit, floor=0.0, **changes):
    tolerance = ToleranceClass(measure=measure, limit=limit, floor=floor)
    return compare(claim(**changes), tolerance, finding).agreement


READ_OFF = {"tolerance": "read_off", "sigma": 0.1}


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
        (0.0119, "relative", 0.02, {"printed": "0.0108", "floor": 0.001}, None),  # the larger, not the sum
        (0.0118, "relative", 0.02, {"printed": "0.0108"}, None),
        (2.2, "sigma", 3.0, READ_OFF, "exact"),  # off a figure: within two sigma, close within three
        (1.8, "sigma", 3.0, READ_OFF, "exact"),
        (2.21, "sigma", 3.0, READ_OFF, "close"),
        (2.3, "sigma", 3.0, READ_OFF, "close"),
        (2.31, "sigma", 3.0, READ_OFF, None),
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
        (0.0, {"printed": "1.16e7"}, False, "0.00e0"),
    ],
)
def test_value_is_written_like_the_printed_one(value, changes, exact, text):
    assert as_printed(value, claim(**changes), exact) == text


SEEDS = {"seed_deviation": 0.2}


@pytest.mark.parametrize(
    ("value", "limit", "changes", "expected"),
    [
        (2.10, 0.1, SEEDS, "close"),  # half a unit, 0.05, and a quarter of 0.2
        (2.11, 0.1, SEEDS, None),
        (2.11, 0.1, {}, "close"),  # without a deviation the class alone
        (2.07, 0.01, SEEDS, None),  # never beyond the class
        (2.05, 0.01, SEEDS, "exact"),
    ],
)
def test_no_further_than_a_quarter_of_the_seed_deviation(value, limit, changes, expected):
    tolerance = ToleranceClass(measure="relative", limit=limit, seeds=0.25)
    assert compare(claim(**changes), tolerance, Finding(value)).agreement == expected


def test_a_signed_number_has_the_printed_sign():
    tolerance = ToleranceClass(measure="sigma", limit=0.1, seeds=0.25, signed=True)
    mu = claim(printed="-0.1", sigma=10.0, seed_deviation=2.0)
    assert compare(mu, tolerance, Finding(-0.4)).agreement == "close"
    assert compare(mu, tolerance, Finding(0.2)).agreement is None


@pytest.mark.parametrize(
    ("n", "cost", "expected"),
    [(1.35, 0.0, "exact"), (1.4, 0.04, "close"), (1.3, 0.04, "close"), (1.4, 0.06, None), (1.45, 0.0, None)],
)
def test_one_step_of_n_is_close_where_it_costs_little(n, cost, expected):
    tolerance = ToleranceClass(measure="index", limit=0.05, seeds=0.25)
    printed = claim(printed="1.35", seed_deviation=0.2)
    assert compare(printed, tolerance, Finding(n, margin=cost)).agreement == expected


@pytest.mark.parametrize(("margin", "expected"), [(0.06, "exact"), (0.04, "close"), (-0.04, None)])
def test_a_statement_true_by_chance_of_the_seeds_is_close(margin, expected):
    truth = ToleranceClass(measure="truth", limit=0.0, seeds=0.25)
    finding = Finding(holds=margin > 0, margin=margin)
    assert compare(claim(**SEEDS), truth, finding).agreement == expected
    decade = ToleranceClass(measure="log10", limit=0.1, seeds=0.25)
    for sense, value in (("at_most", 0.1 - margin), ("at_least", 0.1 + margin)):
        assert compare(claim(sense=sense, **SEEDS), decade, Finding(value)).agreement == expected


def test_where_statements_are_true():
    truth, decade = ToleranceClass(measure="truth", limit=0.0), ToleranceClass(measure="log10", limit=0.1)
    assert where_true(claim(), truth) == (0.0, math.inf)
    assert where_true(claim(sense="at_most"), decade) == (-math.inf, 0.1)
    assert where_true(claim(sense="at_least"), decade) == (0.1, math.inf)
    about = ToleranceClass(measure="relative", limit=0.1)
    assert where_true(claim(), about) == pytest.approx((1.8, 2.2))
    assert where_true(claim(sense="at_most"), about) == pytest.approx((-math.inf, 2.2))


@pytest.mark.parametrize(
    ("finding", "measure", "changes", "expected"),
    [
        (Finding(value=2.5), "relative", {}, 0.25),
        (Finding(value=-1.5), "relative", {"printed": "-2.0"}, 0.25),
        (Finding(value=2.5), "sigma", {"sigma": 5.0}, 0.1),
        (Finding(value=2.5), "sigma", {"sigma": 5.0, "tolerance": "read_off"}, 0.25),
        (Finding(value=3.0), "absolute", {"unit": "log10"}, 9.0),  # ten times the printed number
        (Finding(low=1.0, high=1.5), "relative", {}, -0.25),  # from the nearest of a range
        (Finding(low=1.0, high=3.0), "relative", {}, 0.0),
        (Finding(value=2.5), "log10", {}, None),
        (Finding(value=2.5), "truth", {}, None),
        (Finding(holds=True), "relative", {}, None),
        (Finding(value=2.5), "relative", {"printed": "0.0"}, None),
    ],
)
def test_deviation_as_a_fraction_of_the_printed_number(finding, measure, changes, expected):
    tolerance = ToleranceClass(measure=measure, limit=0.1)
    assert relative_deviation(claim(**changes), tolerance, finding) == pytest.approx(expected)
