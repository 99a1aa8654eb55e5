"""The object of a fit in a notebook."""

import json
import re

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import pneumo
from benchmarks.bench_rig import bench_record, purpose_rig
from benchmarks.fit_bench import believed_plant
from pneumo.errors import InputError

pytestmark = pytest.mark.xdist_group("fit doubts")
RIG = purpose_rig()


def table(seed, seconds=3.0):
    columns = bench_record(RIG, np.random.default_rng(seed), seconds)
    units = {"t": "t_s", "u": "u_V", "x": "x_m", "P_A": "P_A_Pa", "P_B": "P_B_Pa"}
    return pd.DataFrame({header: columns[name] for name, header in units.items()})


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rig")
    believed_plant(RIG, folder)
    return folder / "cylinder.yaml"


@pytest.fixture(scope="module")
def fit(file):
    return pneumo.fit(table(3), file, models=["M8"])


def test_tables_have_the_fits_numbers(fit):
    k_0 = fit.estimates.loc[("full", "k_0")]
    assert k_0["low"] < RIG.k_0 < k_0["high"] and k_0["unit"] == "W K-1"
    C = fit.result.C_per_k_xu * fit.result.estimates("full")["k_xu"].value  # dm^3/(s bar)
    assert pytest.approx(1e8 * RIG.C, rel=0.05) == C
    assert fit.errors.shape == (2, 4) and isinstance(fit.warnings, list)
    residuals = fit.residuals.sel(model="full").values
    assert np.sqrt(np.mean(residuals**2)) == pytest.approx(1e3, rel=0.1)  # the sensors' noise
    correlation = fit.correlation
    assert list(correlation.index) == list(correlation.columns)
    np.testing.assert_allclose(np.diag(correlation), 1.0, rtol=1e-9)
    assert correlation.loc["k_xu", "b"] < -0.5  # a smaller b and a larger C carry the same flow
    assert fit._repr_html_().count("<tr") > 10
    picture, size = fit.plot()._repr_png_()
    assert picture.startswith(b"\x89PNG") and size["width"] > size["height"] / 2
    assert fit.plot().get_axes() and fit.to_xarray().sizes["model"] == 2


def test_a_fitted_model_is_exported_with_its_estimates(fit, tmp_path):
    source, *_ = fit.export(tmp_path / "fitted.c")
    (k_0,) = re.findall(r"([0-9.]+), /\* k_0 \*/", source.read_text())
    assert float(k_0) == pytest.approx(fit.result.estimates("full")["k_0"].value, rel=1e-3)


def test_another_record_judges_the_models(fit, file):
    errors = fit.validate(table(4))
    assert errors.loc["full"].to_numpy() == pytest.approx([1e3, 1e3], rel=0.15)
    assert (errors.loc["M8"] > errors.loc["full"]).all()
    stronger = table(4).assign(P_A_Pa=lambda t: t["P_A_Pa"] + 2e4)
    assert fit.validate(stronger).loc["full", "A"] > 1e4


def test_records_may_be_datasets(file):
    frame = table(3)
    data = xr.Dataset({name: ("row", values) for name, values in frame.items()})
    read = pneumo.read_record(data, file)
    np.testing.assert_array_equal(read.P, pneumo.read_record(frame, file).P)
    with pytest.raises(InputError, match=r"^record: no column x"):
        pneumo.read_record(frame.drop(columns="x_m"), file)


def test_files_are_written(fit, tmp_path):
    fit.save(tmp_path)
    assert {"fit.html", "fit.nc", "fitted.yaml"} == {path.name for path in tmp_path.iterdir()}
    summary = json.loads(json.dumps(fit.result.summary()))
    full = summary["models"]["full"]["parameters"]["k_0"]
    assert full["value"] == pytest.approx(fit.estimates.loc[("full", "k_0"), "value"])


def test_a_fit_shows_itself_in_ten_lines(fit):
    text = repr(fit).splitlines()
    assert len(text) <= 10 and "RMS error held out (kPa): full " in text[0] and "  k_0 = " in repr(fit)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"command": "foo"}, "command = 'foo': must be one of held, linear"),
        ({"x_from": "foo"}, "x_from = 'foo': must be one of mid, end"),
        *(({"part": part}, "part = ") for part in (1.5, 0.0, np.nan, "half")),
        ({"models": "M6"}, "models = 'M6': must be a list, ['M6']"),
        ({"also": "b"}, "also = 'b': must be a list, ['b']"),
        ({"record": []}, "record: an empty list: must have at least one record"),
        ({"also": ["b"]}, "also: the fit of closed chambers has no such choice"),
    ],
)
def test_a_wrong_argument_is_one_line_that_names_it(file, change, said):
    with pytest.raises(InputError) as error:
        pneumo.fit(**{"record": table(3).assign(u_V=0.0), "configuration": file} | change)
    assert str(error.value).startswith(said) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        *(({"seeds": n}, f"seeds = {n}: must be a whole number, 1 to 1000") for n in (0, -3, 1.5, 10**9)),
        ({"cylinders": "mine"}, "cylinders = 'mine': must be a list, ['mine']"),
        ({"experiments": 3}, "experiments = 3: must be a list"),
        ({"cylinders": [3]}, "cylinder = 3: no such cylinder in this study; there are mine"),
    ],
)
def test_impossible_options_of_a_study_are_one_line(inside, tmp_path, options, said):
    inside("init", "my.yaml")
    with pytest.raises(pneumo.InputError) as error:
        pneumo.study(tmp_path / "my.yaml", **options)
    assert str(error.value) == said
