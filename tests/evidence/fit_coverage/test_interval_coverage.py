"""Coverage of `pneumo fit`: random cylinders as drawn, cases fitted, intervals counted."""

import numpy as np
import pytest
import xarray as xr

from pneumo.evidence.fit_coverage import interval_coverage as coverage
from pneumo.evidence.fit_coverage.synthetic_records import sensed, synthetic_record
from pneumo.publish.text.markdown_tables import coverage_tables


def test_sensors_are_noisy_and_quantised_and_cases_as_drawn():
    readings = sensed(np.random.default_rng(0), np.zeros(4000), 8.0, 0.01, 10)
    np.testing.assert_array_equal(readings / (8 / 1024), np.round(readings / (8 / 1024)))
    assert np.std(readings) == pytest.approx(0.08, rel=0.05)  # 4000 samples: 1.1 %
    known = synthetic_record(8, "M7")
    half = known.truth.cylinder.stroke / 2
    assert np.ptp(known.x_exact) > 0.2 * half and np.abs(known.x_exact).max() < half
    assert known.truth.cylinder.V_d_A == known.V_d[0] != known.V_d[1]
    assert known.configured.valve.k_xu != known.truth.valve.k_xu
    np.testing.assert_array_equal(synthetic_record(8, "M7").P, known.P)
    assert np.std(known.P - known.P_exact) == pytest.approx(known.noise * 1e6, rel=0.05)
    assert np.std(known.x - known.x_exact) == pytest.approx(known.noise * 2 * half, rel=0.05)
    told = coverage.true_parameters(known)
    assert (told["n"], told["k_0"], told["V_d_B"]) == (known.n, known.truth.k_0, known.V_d[1])
    assert told["k_xu"] == known.truth.valve.k_xu
    assert coverage.record_properties(known)["noise"] == known.noise


@pytest.mark.slow
def test_a_case_is_fitted_by_the_model_that_made_it():
    case = coverage.fit_same_model(1032)  # little noise, long in motion: k_0 is seen
    assert case["fitted_model"].item() == coverage.FITTED_MODELS[1032 % 4]
    assert list(case["parameter"].values) == list(coverage.JUDGED_PARAMETERS)
    np.testing.assert_allclose(case["estimate"] / case["truth"], 1.0, atol=0.6)
    assert np.all(case["low"] < case["estimate"]) and np.all(case["estimate"] < case["high"])
    # The truth of the valve's coefficient is within ten of its standard errors.
    spread = (case["high"] - case["low"]).sel(parameter="k_xu")
    assert abs(case["estimate"] - case["truth"]).sel(parameter="k_xu") < 2.5 * spread


def test_intervals_held_are_counted_and_open_ends_set_no_limit():
    nan = np.nan
    by_parameter = {"truth": [1.2, 1.2, 1.2, 1.2], "low": [1.1, nan, 1.3, 1.1], "high": [1.3, 1.25, 1.4, nan]}
    by_model = {"full_k_0": [[nan, 0.5], [nan, 1.0], [nan, 2.0], [nan, 1.0]], "full_seconds": np.ones((4, 2))}
    by_model |= {"full_low": [[nan, nan]] * 4, "full_high": [[nan, 3.0], [nan, 0.9], [nan, nan], [nan, nan]]}
    by_model["full_held_out"] = 1e3 * np.array([[1.0, 2.0]] * 4)
    fits = xr.Dataset(coords={"parameter": ["n"], "model": ["M6", "M7"]})
    fits = fits.assign({name: (("case", "parameter"), np.c_[v]) for name, v in by_parameter.items()})
    fits = fits.assign({name: (("case", "model"), values) for name, values in by_model.items()})
    fits["full_true_k_0"] = ("case", [1.0, 1.0, 1.0, 0.5])
    row = coverage.intervals_that_hold(fits).loc["n"]
    assert (row["held"], row["cases"], row["closed_held"], row["closed"]) == (3, 4, 1, 2)
    M7 = coverage.full_order_truth(fits).loc["M7"]
    assert (M7["k_0_median"], M7["held"], M7["closed"]) == (1.5, 3, 0)
    text = coverage_tables(coverage.intervals_that_hold(fits), coverage.full_order_truth(fits))
    assert "| n | 3 of 4 |" in text and "| M6 |  |  |  | 1.0 |" in text
    assert "| M7 | 1.50 (" in text and "| 3 of 4 | 0 of 0 |" in text
