"""Measured conductances are those that were printed, and the default lies among them."""

import re
from math import exp, log, pi
from pathlib import Path
from statistics import fmean, stdev

import pytest
from scipy.stats import t

from paper.study.paper_2007.printed_tables import COLUMNS
from paper.study.paper_2007.results import Results
from pneumo.catalogue import (
    coefficient_times_length,
    conductance_factor,
    default_conductance,
    measured_conductances,
)
from pneumo.physics.cylinder import Cylinder, chamber_of, volume, wetted_area

PAPER = Path(__file__).parents[2] / "paper" / "2007"


def cylinder(bore: float, stroke: float, V_d: float) -> Cylinder:
    area = pi / 4 * bore**2
    return Cylinder(bore, stroke, area, area, V_d, V_d, 1.0, 1.0, -stroke / 2, stroke / 2)


def test_data_are_the_printed_numbers_with_their_source():
    results = Results(Path(), PAPER)
    for column, measurement in zip(COLUMNS, measured_conductances(), strict=True):
        for name in ("P_f", "V_f", "A_q", "k_0", "lambda_0"):
            assert getattr(measurement, name) == pytest.approx(
                results.printed[column, name].value, rel=1e-12
            ), name
        sizes = {
            name: 1e-3 * float(results.table_1[measurement.cylinder, name])
            for name in ("bore", "rod", "stroke")
        }
        assert {name: getattr(measurement, name) for name in sizes} == pytest.approx(sizes)
        assert (
            measurement.type == results.table_1[measurement.cylinder, "type"]
            and "10.1243/09596518JSCE188" in measurement.source
        )


def test_interval_holds_every_measured_conductance_and_the_default_scales_as_said():
    for measurement in measured_conductances():
        product, factor = coefficient_times_length()
        predicted = product * measurement.A_q**2 / measurement.V_f
        assert predicted / factor < measurement.k_0 < predicted * factor
    small, large = cylinder(0.02, 0.1, 1.6e-6), cylinder(0.04, 0.2, 8 * 1.6e-6)
    measurement, other = default_conductance(small), default_conductance(large)
    # Twice the size: V / A_q doubles, lambda_0 halves, A_q is four times as large.
    assert other.lambda_0 == pytest.approx(measurement.lambda_0 / 2) and other.k_0 == pytest.approx(
        2 * measurement.k_0
    )
    V = volume(0.0, chamber_of(small, 0), small)
    assert measurement.k_0 == pytest.approx(measurement.lambda_0 * wetted_area(V, 0.02))
    assert measurement.k_0_low < measurement.k_0 < measurement.k_0_high


def test_measurements_of_one_cylinder_count_as_one():
    logs = [log(c.lambda_0 * c.V_f / c.A_q) for c in measured_conductances()]
    means = [fmean(pair) for pair in zip(logs[:3], logs[3:], strict=True)]  # A, B, C of both experiments
    expected = exp(t.ppf(0.975, 2) * stdev(means) * (1 + 1 / 3) ** 0.5)
    assert coefficient_times_length()[1] == pytest.approx(expected, rel=1e-9)
    of_six = exp(t.ppf(0.975, 5) * stdev(logs) * (1 + 1 / 6) ** 0.5)
    assert coefficient_times_length()[1] > 1.5 * of_six


# Walls measured elsewhere in the project (docs/measurements.md): bore, mm, and lambda V/A, W/(m K). That of
# the nitrogen vessel, 8.24 at 150 bar, is brought to 5.65 bar by the square root of eq (8).
ELSEWHERE = [
    (25, 0.23),
    (127, 0.21),
    (127, 0.58),
    (127, 1.10),
    (200, 0.32),
    (273, 8.24 * (5.65 / 150) ** 0.5),
]


@pytest.mark.parametrize(("bore", "product"), ELSEWHERE)
def test_walls_measured_elsewhere_lie_within_the_interval(bore, product):
    mean, narrow = coefficient_times_length()
    factor = conductance_factor(bore * 1e-3)
    assert mean / factor < product < mean * factor
    assert factor > narrow if bore > 32 else factor == narrow
    default = default_conductance(cylinder(bore * 1e-3, 0.1, 1e-6))
    assert default.k_0_high / default.k_0 == pytest.approx(factor)


def test_the_template_gives_the_factor_of_the_interval():
    page = "pneumo/selection/templates/cylinder.yaml"
    text = " ".join((PAPER.parents[1] / page).read_text(encoding="utf-8").replace("#", " ").split())
    stated = re.findall(r"within a factor of (\d+\.\d+)", text)
    assert stated and set(stated) == {f"{coefficient_times_length()[1]:.1f}"}
