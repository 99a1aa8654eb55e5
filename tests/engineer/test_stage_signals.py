"""Signals between sensors and replay: limits, stages, noise made again; random cylinders as drawn."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pneumo.engineer.stage_signals import stage_signals, with_added_noise
from pneumo.evidence.fit_coverage import (
    FITTED,
    JUDGED,
    full_order_truth,
    held,
    labels,
    same_model,
    summary,
    truth_of,
)
from pneumo.evidence.synthetic_records import case, sensed

PERIOD = 2e-3


@pytest.fixture(scope="module")
def record():
    t = PERIOD * np.arange(400)
    u = np.where(np.arange(400) % 40 < 20, 12.0, -3.0)
    x = 0.05 * np.sin(8 * t) + np.random.default_rng(5).normal(0, 2e-4, 400)
    return t, u, x, stage_signals(PERIOD, u, x, np.zeros((2, 400)), 10.0)


def test_stages_have_the_limited_command_and_a_motion_with_its_derivative(record):
    t, u, _, found = record
    assert found.h == pytest.approx(1e-3) and found.stride == 2
    assert found.inputs.shape == (798, 6, 3)
    np.testing.assert_array_equal(found.inputs[::2, 0, 0], np.clip(u[:-1], -10, 10))
    np.testing.assert_array_equal(found.inputs[1::2, 5, 0], np.clip(u[:-1], -10, 10))
    at = np.repeat(t[:-1], 2) + np.tile([0.0, 1e-3], 399)
    # Smoothing leaves less of the noise than was there, and the derivative's is that times a frequency.
    assert np.std(found.inputs[:, 0, 1] - 0.05 * np.sin(8 * at)) < 1e-4
    assert np.std(found.inputs[:, 0, 2] - 0.4 * np.cos(8 * at)) < 0.02


def test_linear_command_is_between_samples(record):
    _, u, x, _ = record
    found = stage_signals(PERIOD, u, x, np.zeros((2, 400)), 20.0, held=False)
    np.testing.assert_allclose(found.inputs[1::2, 0, 0], (u[:-1] + u[1:]) / 2, rtol=1e-12)


def test_noise_is_made_again_as_it_was(record):
    *_, found = record
    made = with_added_noise(found, 4, seed=1)
    assert len(made) == 8
    for plus, minus in zip(made[::2], made[1::2], strict=True):
        np.testing.assert_array_equal(plus[:, :, 0], found.inputs[:, :, 0])
        middle = (plus + minus) / 2
        # Smoothing what is smooth changes it by far less than the noise.
        assert np.std(middle[:, :, 1] - found.inputs[:, :, 1]) < 0.3 * found.noise
        half = (plus - minus)[:, :, 1] / 2
        assert 0.05 * found.noise < np.std(half) < 0.8 * found.noise  # smoothed, too
        slope = np.gradient(half[:, 0], found.h)
        assert np.corrcoef(slope, (plus - minus)[:, 0, 2])[0, 1] > 0.99


def test_sensors_are_noisy_and_quantised():
    found = sensed(np.random.default_rng(0), np.zeros(4000), 8.0, 0.01, 10)
    np.testing.assert_array_equal(found / (8 / 1024), np.round(found / (8 / 1024)))
    assert np.std(found) == pytest.approx(0.08, rel=0.05)  # 4000 samples: 1.1 %


def test_cases_are_as_drawn():
    known = case(8, "M7")
    half = known.truth.cylinder.stroke / 2
    assert np.ptp(known.x_exact) > 0.2 * half and np.abs(known.x_exact).max() < half
    assert known.truth.cylinder.V_d == known.V_d[0] != known.V_d[1]
    assert known.configured.valve.k_xu != known.truth.valve.k_xu
    np.testing.assert_array_equal(case(8, "M7").P, known.P)
    assert np.std(known.P - known.P_exact) == pytest.approx(known.noise * 1e6, rel=0.05)
    assert np.std(known.x - known.x_exact) == pytest.approx(known.noise * 2 * half, rel=0.05)
    told = truth_of(known)
    assert (told["n"], told["k_0"], told["V_d_B"]) == (known.n, known.truth.k_0, known.V_d[1])
    assert told["k_xu"] == known.truth.valve.k_xu
    assert labels(known)["noise"] == known.noise


def test_a_case_is_fitted_by_the_model_that_made_it():
    found = same_model(1032)  # little noise, long in motion: k_0 is seen
    assert found["fitted_model"].item() == FITTED[1032 % 4]
    assert list(found["parameter"].values) == list(JUDGED)
    np.testing.assert_allclose(found["estimate"] / found["truth"], 1.0, atol=0.6)
    assert np.all(found["low"] < found["estimate"]) and np.all(found["estimate"] < found["high"])
    # The truth of the valve's coefficient is within ten of its standard errors.
    spread = (found["high"] - found["low"]).sel(parameter="k_xu")
    assert abs(found["estimate"] - found["truth"]).sel(parameter="k_xu") < 2.5 * spread


def test_intervals_held_are_counted_and_open_ends_set_no_limit():
    nan = np.nan
    found = xr.Dataset(
        {
            "truth": (("case", "parameter"), [[1.2], [1.2], [1.2], [1.2]]),
            "low": (("case", "parameter"), [[1.1], [nan], [1.3], [1.1]]),
            "high": (("case", "parameter"), [[1.3], [1.25], [1.4], [nan]]),
            "full_k_0": (("case", "model"), [[nan, 0.5], [nan, 1.0], [nan, 2.0], [nan, 1.0]]),
            "full_true_k_0": ("case", [1.0, 1.0, 1.0, 0.5]),
            "full_held_out": (("case", "model"), 1e3 * np.array([[1.0, 2.0]] * 4)),
            "full_seconds": (("case", "model"), np.ones((4, 2))),
        },
        coords={"parameter": ["n"], "model": ["M6", "M7"]},
    )
    row = held(found).loc["n"]
    assert (row["held"], row["cases"], row["closed_held"], row["closed"]) == (3, 4, 1, 2)
    assert full_order_truth(found).loc["M7", "k_0_median"] == 1.5
    text = summary(found)
    assert "| n | 3 of 4 |" in text and "| M6 |  | 1.0 |" in text and "| M7 | 1.50 (" in text


@pytest.mark.results
def test_the_page_shows_the_coverage_that_was_found(results):
    file = results / "fit_coverage.md"
    if not file.exists():
        pytest.skip("no results/fit_coverage.md: `snakemake -j2 fit_coverage` makes it")
    page = (Path(__file__).parents[2] / "docs/fit.md").read_text(encoding="utf-8")
    shown = page.partition("<!-- coverage:")[2].partition("-->")[2].partition("<!-- /coverage -->")[0]
    assert shown.strip() == file.read_text(encoding="utf-8").strip()
