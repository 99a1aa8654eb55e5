"""Measured wall conductances of catalogue cylinders, and the default for a cylinder with unknown k_0."""

import csv
from functools import cache
from math import exp, log
from pathlib import Path
from statistics import fmean, stdev
from typing import NamedTuple

from pneumo.physics.cylinder import Cylinder, Side, chamber_of, volume, wetted_area

FILE = Path(__file__).parent / "conductances.csv"
LEVEL = 0.95  # of the prediction interval
# Beyond the measured bores the factor of the interval grows as the ratio of the bores to this power: walls of
# 127 and 273 mm, which the project measured from records, lie within (docs/measurements.md).
GROWTH = 0.6


class Measured(NamedTuple):
    """One measured conductance, in SI units, with the source that printed it."""

    cylinder: str
    type: str  # of the catalogue
    bore: float
    rod: float
    stroke: float
    material: str
    P_f: float  # absolute pressure at rest
    V_f: float
    A_q: float  # heat transfer area, by `wetted_area`
    k_0: float  # W/K, at 5.65e5 Pa and 293 K
    lambda_0: float  # W/(m^2 K), there
    source: str


class Default(NamedTuple):
    """Conductance of a cylinder that was not measured, with a 95 per cent prediction interval."""

    lambda_0: float  # W/(m^2 K), over `wetted_area`
    k_0: float  # W/K, in mid-stroke
    k_0_low: float
    k_0_high: float


@cache
def measured_conductances() -> tuple[Measured, ...]:
    """Return the published measurements: three cylinders, two each."""
    with FILE.open(encoding="utf-8", newline="") as file:
        rows = [dict(zip(Measured._fields, row, strict=True)) for row in list(csv.reader(file))[1:]]
    numbers = [name for name, kind in Measured.__annotations__.items() if kind is float]
    scales = {"bore": 1e-3, "rod": 1e-3, "stroke": 1e-3, "P_f": 1e5}  # mm and bar in the file
    converted = [{name: float(row[name]) * scales.get(name, 1.0) for name in numbers} for row in rows]
    return tuple(Measured(**row | in_SI) for row, in_SI in zip(rows, converted, strict=True))  # type: ignore[arg-type]


@cache
def measured_cylinders() -> str:
    """Number and bores of the measured cylinders, in words."""
    bores = sorted({f"{1e3 * measured.bore:.0f}" for measured in measured_conductances()})
    count = len({measured.cylinder for measured in measured_conductances()})
    return f"{count} measured cylinders, {' and '.join(bores)} mm bore"


@cache
def coefficient_times_length() -> tuple[float, float]:
    """Mean of lambda_0 V / A_q over cylinders, W/(m K), and the factor of its prediction interval.

    lambda_0 in inverse proportion to V / A_q is a Nusselt number that is the same for all cylinders. The mean
    is geometric. The measurements of one cylinder count as one, so the interval has two degrees of freedom.
    """
    by_cylinder: dict[str, list[float]] = {}
    for measured in measured_conductances():
        product = measured.lambda_0 * measured.V_f / measured.A_q
        by_cylinder.setdefault(measured.cylinder, []).append(log(product))
    logs = [fmean(values) for values in by_cylinder.values()]
    assert len(logs) == 3  # else Student's t has another closed form, or none
    quantile = LEVEL * (2 / (1 - LEVEL**2)) ** 0.5
    half = quantile * stdev(logs) * (1 + 1 / len(logs)) ** 0.5
    return exp(fmean(logs)), exp(half)


def measured_bores() -> tuple[float, float]:
    """Smallest and largest bore of the measured cylinders, m."""
    bores = [measured.bore for measured in measured_conductances()]
    return min(bores), max(bores)


def conductance_factor(bore: float) -> float:
    """Factor of the default's 95 per cent interval for a bore, m; beyond the measured ones it is larger."""
    smallest, largest = measured_bores()
    return coefficient_times_length()[1] * max(smallest / bore, bore / largest, 1.0) ** GROWTH


def default_conductance(cylinder: Cylinder) -> Default:
    """Return the conductance to use if that of a cylinder is unknown, for chamber A in mid-stroke.

    From six measurements on three cylinders of 20 and 32 mm bore (`measured_conductances`); the interval is
    wide, and wider beyond these sizes (`conductance_factor`), where the default is an extrapolation.
    """
    V = volume(0.0, chamber_of(cylinder, Side.A), cylinder)
    A_q = wetted_area(V, cylinder.bore)
    product, factor = coefficient_times_length()[0], conductance_factor(cylinder.bore)
    lambda_0 = product * A_q / V
    k_0 = lambda_0 * A_q
    return Default(lambda_0, k_0, k_0 / factor, k_0 * factor)
