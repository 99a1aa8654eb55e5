"""Reproduced numbers in CSV, JSON and NetCDF files: by label, what is done with the rest, errors."""

import json
import math
import statistics

import pytest

from paper_verdict.chi_square import exceeded_probability
from paper_verdict.errors import PaperError
from paper_verdict.values import Cell, Values, percentile

RUNS = [("a", 1.0, 3.0), ("a", 2.0, -4.0), ("b", 1.0, 5.0), ("b", 2.0, 7.5)]


@pytest.fixture
def values(tmp_path):
    rows = [f"{name},{t},{y}" for name, t, y in RUNS]
    (tmp_path / "runs.csv").write_text("\n".join(["case,t [s],y [Pa]", *rows, ""]))
    records = [{"case": name, "t": t, "y": y} for name, t, y in RUNS]
    nested = {"records": records, "of": {"1.35": {"mean": 2.5}, "list": [1, 2, 3, 4]}, "text": "x"}
    (tmp_path / "runs.json").write_text(json.dumps(nested))
    return Values(tmp_path)


def number(values, file, variable, reduce="", factor=1.0, unit="", **select):
    cell = Cell(file=file, variable=variable, select=select, reduce=reduce, factor=factor)
    return values.number(cell, unit, "claims.yaml:1")


@pytest.mark.parametrize("file", ["runs.csv", "runs.json", "runs.nc"])
def test_cells_by_label_and_reductions(values, file):
    if file == "runs.nc":
        netcdf = pytest.importorskip("netCDF4")
        with netcdf.Dataset(values.folder / file, "w") as dataset:
            dataset.createDimension("case", 2)
            dataset.createDimension("t", 2)
            dataset.createVariable("case", str, "case")[:] = __import__("numpy").array(["a", "b"], object)
            dataset.createVariable("t", "f8", "t")[:] = [1.0, 2.0]
            y = dataset.createVariable("y", "f8", ("case", "t"))
            y[:] = [[3.0, -4.0], [5.0, 7.5]]
            y.units = "Pa"
    of = "records.y" if file == "runs.json" else "y"
    assert number(values, file, of, case="a", t=2) == -4.0
    assert number(values, file, of, case="b", t="2.0", factor=1e-3) == 7.5e-3
    assert number(values, file, of, "mean", case="a") == -0.5
    assert number(values, file, of, "rms", case="a") == pytest.approx(math.sqrt(12.5))
    assert number(values, file, of, "max") == 7.5
    assert number(values, file, of, "p50") == 4.0
    assert number(values, file, of, "std") == pytest.approx(statistics.stdev(y for *_, y in RUNS))
    with pytest.raises(PaperError, match="give reduce"):
        number(values, file, of, case="a")
    with pytest.raises(PaperError, match="case = c"):
        number(values, file, of, case="c")
    with pytest.raises(PaperError, match="'kase'"):
        number(values, file, of, kase="a")
    if file != "runs.json":
        with pytest.raises(PaperError, match="is in Pa, the print in bar; give factor"):
            number(values, file, of, case="a", t=1, unit="bar")
        assert number(values, file, of, case="a", t=1, unit="bar", factor=1e-5) == pytest.approx(3e-5)


def test_paths_of_keys_in_json(values):
    assert number(values, "runs.json", "of.1.35.mean") == 2.5  # a key with a point
    assert number(values, "runs.json", "of.list", "sum") == 10
    for variable, words in (("of.1.3.mean", "no key '1'"), ("text", "is no number"), ("off", "'of'")):
        with pytest.raises(PaperError, match=words):
            number(values, "runs.json", variable)


@pytest.mark.parametrize("percent", [0, 10, 37.5, 90, 100])
def test_percentiles_are_those_of_numpy(percent):
    numpy = pytest.importorskip("numpy")
    numbers = [3.0, -1.0, 4.0, 1.5, 9.25, 2.0, 6.0]
    assert percentile(numbers, percent) == pytest.approx(numpy.percentile(numbers, percent), rel=1e-14)


@pytest.mark.parametrize("freedom", [0.5, 1, 3, 29.8, 96, 1000])
def test_the_tail_of_chi_square_is_that_of_scipy(freedom):
    special = pytest.importorskip("scipy.special")
    for value in (0.0, 1e-3, 0.3 * freedom, freedom, 1.7 * freedom, 4 * freedom, 20 * freedom):
        expected = special.chdtrc(freedom, value)
        assert exceeded_probability(value, freedom) == pytest.approx(expected, rel=1e-10, abs=1e-300)


def test_without_degrees_of_freedom_there_is_no_probability():
    assert math.isnan(exceeded_probability(3.0, 0.0)) and math.isnan(exceeded_probability(3.0, -2.0))
