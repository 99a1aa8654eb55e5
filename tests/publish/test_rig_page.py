"""Page of `pneumo rig`: the result's numbers, best model first, nothing from outside, texts escaped."""

import re

import numpy as np
import pytest
import xarray as xr
from page_checks import assert_fit_for_a_phone, in_chromium

from pneumo.publish.figures.rig_figure import ranked, rig_figure
from pneumo.publish.pages.rig_page import rig_page

MODELS = ["M1", "M8", "full order", "full order, adiabatic"]


def made(chambers=1, T=False, fitted_until=0.0):
    t, names = np.linspace(0, 0.2, 300), ["n", "C_d"]
    P = 3e5 + 1e5 * np.sin(20 * t)
    nothing = np.full((4, 2), np.nan)
    estimate = nothing.copy()
    estimate[1], estimate[2, 1] = (1.4, 0.8), 0.81
    low = estimate - 0.01
    low[1, 0] = np.nan  # on its bound
    high = np.where(np.isnan(low), np.nan, estimate + 0.01)
    data = {
        "fitted": ("model", [2e3, 1e3, 0.5e3, 0.9e3]),
        "held_out": ("model", [4e3, 1.5e3, 0.6e3, 1e3]),
        "T_error": ("model", [np.nan, np.nan, np.nan, 5.25]),
        "estimate": (("model", "parameter"), estimate),
        "low": (("model", "parameter"), low),
        "high": (("model", "parameter"), high),
        "measured_P": (("chamber", "t"), [P] * chambers),
        "replayed_P": (
            ("model", "chamber", "t"),
            [[P + error] * chambers for error in (4e3, 1.5e3, 600.0, 1e3)],
        ),
    }
    if T:
        data |= {"measured_T": ("t_T", [300.0, 280]), "replayed_T": (("model", "t_T"), [[300.0, 290]] * 4)}
    coords = {"model": MODELS, "parameter": names, "t": t, "chamber": ["A", "B"][:chambers]}
    coords |= {"t_T": [0.0, 0.1]} if T else {}
    return xr.Dataset(data, coords, {"fitted_until": fitted_until})


def page(result, **more):
    about = {
        "name": "<b>rig</b>.csv",
        "warnings": ["a <i>"],
        "unphysical": {"M1": "n = <3>"},
        "several": True,
    }
    return rig_page(result, **about | more)


def test_page_has_the_results_numbers_best_first_and_stands_alone():
    text = page(made())
    rows = re.findall(r'<tr><th scope="row">(.*?)</th>(.*?)</tr>', text)
    assert [name for name, _ in rows[:4]] == ranked(made()) == [MODELS[k] for k in (2, 3, 1, 0)]
    assert "<td>0.600</td><td>0.500</td><td>–</td><td>none</td>" in rows[0][1]
    assert "<td>5.25</td>" in rows[1][1] and "<td>n on its bound</td>" in rows[2][1]
    assert "<td>n = &lt;3&gt;</td>" in rows[3][1]
    assert ("M8", "<td>n</td><td>1.400</td><td>on its bound</td>") in rows
    assert ("full order", "<td>C_d</td><td>0.810</td><td>0.800 to 0.820</td>") in rows
    assert "<b>rig" not in text and "&lt;b&gt;rig" in text and "a &lt;i&gt;" in text
    assert not re.search(r"(?:src|href)=\"(?!data:)", text)


def test_what_a_record_does_not_determine_has_no_numbers_as_its_ends():
    result = made().assign_coords(parameter=["n", "valve_opening_delay_ms"])
    result["low"][2, 1], result["high"][2, 1] = -np.inf, np.inf
    assert "<td>0.810</td><td>not determined</td>" in page(result)
    result["low"][2, 1], result["high"][2, 1] = -0.5, 2.5
    assert "<td>0.810</td><td>-0.500 to 2.50</td>" in page(result)


def test_an_estimate_on_a_bound_of_zero_is_zero():
    result = made().assign_coords(parameter=["k_0_W_per_K", "C_d"])
    result["estimate"][1, 0] = 1.004e-14
    assert "<td>k_0_W_per_K</td><td>0</td><td>on its bound</td>" in page(result)
    result["estimate"][1, 0] = 1e-6
    assert "<td>1.000e-06</td>" in page(result)


def test_page_says_how_models_were_judged():
    assert "first quarter of the pulses" in page(made())
    assert "every second point" in page(made(fitted_until=0.2), several=False)
    assert "the run's start" in page(made(fitted_until=0.1), several=False).replace("&#39;", "'")


@pytest.mark.parametrize(("chambers", "T"), [(1, False), (2, False), (1, True)])
def test_figure_has_panels_for_each_chamber_and_the_temperature_and_draws_three_models(chambers, T):
    fig = rig_figure(made(chambers, T, 0.1))
    assert len(fig.axes) == 2 * chambers + T + 1
    pressures = fig.axes[0]
    labels = [line.get_label() for line in pressures.get_lines()]
    assert labels == ["measured", "full order", "full order, adiabatic", "M1"]
    errors = next(ax for ax in fig.axes if ax.get_ylabel().startswith("error"))
    error = errors.get_lines()[-2].get_ydata()
    np.testing.assert_allclose(error, 4.0)  # kPa, of M1
    assert len({str(line.get_linestyle()) + line.get_color() for line in pressures.get_lines()}) == 4


@pytest.mark.slow
@in_chromium
@pytest.mark.xdist_group("chromium")
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_is_readable_on_a_phone_in_both_schemes(scheme, visit, tmp_path):
    assert_fit_for_a_phone(visit, page(made(2)), tmp_path / "rig.html", scheme, least=20)
