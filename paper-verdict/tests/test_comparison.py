"""Comparison of findings with printed numbers, and how numbers are written."""

import pytest

from paper_verdict.claims import Claim, ToleranceClass
from paper_verdict.comparison import as_printed, compare, relative_deviation
from paper_verdict.files import half_unit
from paper_verdict.findings import Finding

READ_OFF = {"reading": True, "sigma": 0.1}
FINDINGS = [  # finding, measure, limit, changes of the claim (printed: 2.0), agreement
    (Finding(2.05), "relative", 0.1, {}, "exact"),  # the edge of half a unit
    (Finding(2.0501), "relative", 0.1, {}, "close"),
    (Finding(2.2), "relative", 0.1, {}, "close"),  # the edge of the class
    (Finding(2.2001), "relative", 0.1, {}, None),
    (Finding(1.7999), "relative", 0.1, {}, None),
    (Finding(2.06), "absolute", 0.05, {}, None),
    (Finding(1.0), "relative", 0.1, {"sense": "at_most"}, "exact"),
    (Finding(2.2), "relative", 0.1, {"sense": "at_most"}, "close"),
    (Finding(2.3), "relative", 0.1, {"sense": "at_most"}, None),
    (Finding(3.0), "relative", 0.1, {"sense": "at_least"}, "exact"),
    (Finding(1.8), "relative", 0.1, {"sense": "at_least"}, "close"),
    (Finding(1.7), "relative", 0.1, {"sense": "at_least"}, None),
    (Finding(2.5), "sigma", 0.1, {"sigma": 5.0}, "close"),
    (Finding(2.6), "sigma", 0.1, {"sigma": 5.0}, None),
    (Finding(24.0), "relative", 0.0, {"printed": "20", "digits": 1}, "exact"),
    (Finding(0.205), "relative", 0.0, {"printed": "20", "scale": 0.01}, "exact"),
    (Finding(-2.05), "relative", 0.0, {"printed": "-2.0"}, "exact"),
    (Finding(0.1), "log10", 0.1, {"sense": "at_most"}, "exact"),
    (Finding(0.11), "log10", 0.1, {"sense": "at_most"}, None),
    (Finding(0.11), "log10", 0.1, {"sense": "at_least"}, "exact"),
    (Finding(-0.2), "log10", 0.1, {"sense": "at_least"}, None),
    (Finding(0.0118), "relative", 0.02, {"printed": "0.0108", "floor": 0.001}, "close"),
    # The larger of the two, not the sum.
    (Finding(0.0119), "relative", 0.02, {"printed": "0.0108", "floor": 0.001}, None),
    (Finding(2.2), "sigma", 3.0, READ_OFF, "exact"),  # off a figure: within two sigma, close within three
    (Finding(2.21), "sigma", 3.0, READ_OFF, "close"),
    (Finding(2.31), "sigma", 3.0, READ_OFF, None),
    (Finding(2.09, swing=10.0), "swing", 0.01, {}, "close"),
    (Finding(2.11, swing=10.0), "swing", 0.01, {}, None),
    (Finding(low=2.3, high=3.0), "relative", 0.1, {}, None),
    (Finding(low=1.0, high=3.0), "relative", 0.1, {}, "close"),  # the paper does not say which run
    (Finding(low=1.0, high=3.0, allowed=True), "relative", 0.1, {}, "exact"),
    (Finding(holds=True), "truth", 0.0, {}, "exact"),
    (Finding(holds=False), "truth", 0.0, {}, None),
    (Finding(shown="×"), "absolute", 0.0, {"printed": "×"}, "exact"),
    (Finding(shown="✓"), "absolute", 0.0, {"printed": "×"}, None),
]
SEEDS = {"seed_deviation": 0.2, "seeds": 0.25}
SIGNED = {"printed": "-0.1", "sigma": 10.0, "seed_deviation": 2.0, "seeds": 0.25, "signed": True}
BY_SEEDS = [
    (Finding(2.10), "relative", 0.1, SEEDS, "close"),  # half a unit, 0.05, and a quarter of 0.2
    (Finding(2.11), "relative", 0.1, SEEDS, None),
    (Finding(2.07), "relative", 0.01, SEEDS, None),  # never beyond the class
    (Finding(-0.4), "sigma", 0.1, SIGNED, "close"),
    (Finding(0.2), "sigma", 0.1, SIGNED, None),
    # One step of n is close where it costs little.
    (Finding(2.0, margin=0.0), "index", 0.05, SEEDS | {"printed": "2.00"}, "exact"),
    (Finding(2.05, margin=0.04), "index", 0.05, SEEDS | {"printed": "2.00"}, "close"),
    (Finding(2.05, margin=0.06), "index", 0.05, SEEDS | {"printed": "2.00"}, None),
    (Finding(2.10, margin=0.0), "index", 0.05, SEEDS | {"printed": "2.00"}, None),
    # A statement that other seeds could turn over is close.
    (Finding(holds=True, margin=0.06), "truth", 0.0, SEEDS, "exact"),
    (Finding(holds=True, margin=0.04), "truth", 0.0, SEEDS, "close"),
    (Finding(0.06), "log10", 0.1, SEEDS | {"sense": "at_most"}, "close"),
    (Finding(0.16), "log10", 0.1, SEEDS | {"sense": "at_least"}, "exact"),
]


def claim(**changes) -> Claim:
    fields = {"id": "X", "where": "", "printed": "2.0", "basis": "measured"}
    fields |= {"tolerance": "x", "compute": "x", "evidence": {"path": "results/x", "select": ""}}
    return Claim(**fields | changes)


@pytest.mark.parametrize(("finding", "measure", "limit", "changes", "expected"), FINDINGS + BY_SEEDS)
def test_agreement(finding, measure, limit, changes, expected):
    of_class = {name: changes[name] for name in ("floor", "seeds", "signed") if name in changes}
    of_claim = {name: value for name, value in changes.items() if name not in of_class}
    tolerance = ToleranceClass(measure=measure, limit=limit, **of_class)
    assert compare(claim(**of_claim), tolerance, finding) == expected


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


@pytest.mark.parametrize(
    ("finding", "measure", "changes", "expected"),
    [
        (Finding(value=2.5), "relative", {}, 0.25),
        (Finding(value=-1.5), "relative", {"printed": "-2.0"}, 0.25),
        (Finding(value=2.5), "sigma", {"sigma": 5.0}, 0.1),
        (Finding(value=2.5), "sigma", {"sigma": 5.0, "reading": True}, 0.25),
        (Finding(value=3.0), "absolute", {"unit": "log10"}, 9.0),  # ten times the printed number
        (Finding(low=1.0, high=1.5), "relative", {}, -0.25),  # from the nearest of a range
        (Finding(low=1.0, high=3.0), "relative", {}, 0.0),
        (Finding(value=2.5), "truth", {}, None),
        (Finding(holds=True), "relative", {}, None),
        (Finding(value=2.5), "relative", {"printed": "0.0"}, None),
    ],
)
def test_deviation_as_a_fraction_of_the_printed_number(finding, measure, changes, expected):
    tolerance = ToleranceClass(measure=measure, limit=0.1)
    assert relative_deviation(claim(**changes), tolerance, finding) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("text", "digits", "expected"),
    [
        *(("1.02e4", None, 50.0), ("140", None, 0.5), ("-0.047", None, 0.0005), ("1.571e-6", None, 5e-10)),
        *(("3000", 2, 50.0), ("-110", 2, 5.0), ("46.0", 2, 0.5), ("2.37", 2, 0.005), ("0", 2, 0.5)),
    ],
)
def test_half_unit(text, digits, expected):
    assert half_unit(text, digits) == expected
