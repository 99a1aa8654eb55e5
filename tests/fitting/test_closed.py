"""`pneumo fit --closed`: what made a record is found, and what cannot be seen is refused or named.

The contract judges estimates, intervals and causes of more records.
"""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from closed_truth import Truth, compressed, measured, moving, pressures

import pneumo
from pneumo.configuration.parameters import load, study
from pneumo.errors import InputError
from pneumo.fitting.closed.closed_fit import HELD, fit_closed
from pneumo.fitting.closed.thermal_time_constant import transient
from pneumo.fitting.fitted_yaml import fitted_configuration
from pneumo.fitting.record.measurement import Measurement
from pneumo.publish.pages.fit_page import fit_page
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.plants import configured_plant

pytestmark = pytest.mark.xdist_group("closed fit")
EXACT = "wall heat, area and root of PT"  # the law of the truth
PERIOD = 5e-3
TIME = PERIOD * np.arange(1600)
TRUTH = Truth((0.25, 0.18), (5e-6, 6e-6), T=(300.0, 288.0), leak=2e-10)


@pytest.fixture(scope="module")
def plant():
    return configured_plant(study(load(TEMPLATE)), "mine", 1.0)


@pytest.fixture(scope="module")
def record(plant):
    return measured(moving(TIME), pressures(TRUTH, plant, moving, TIME), PERIOD, 1)


@pytest.fixture(scope="module")
def closed_fit(record):
    columns = {"t_s": record.t, "x_m": record.x, "P_A_Pa": record.P[0], "P_B_Pa": record.P[1]}
    return pneumo.fit(pd.DataFrame(columns), TEMPLATE, "mine", closed=True).result


def assert_found(fit, **truth):
    for name, value in truth.items():
        cell = fit.data.sel(model=EXACT, parameter=name)
        low, best, high = (cell[key].item() for key in ("low", "estimate", "high"))
        # 95 % intervals, of which some miss: three times their half-width.
        assert low < best < high, name
        assert abs(best - value) < 3 * (high - low) / 2, name
        assert high - low < 0.1 * value, name


def test_what_made_the_record_of_a_moving_piston_is_found(closed_fit):
    assert closed_fit.models[0] == EXACT
    # Noise of 200 Pa, and of 10 um in positions down to 15 mm from the end: 300 Pa, mostly smoothed away.
    assert closed_fit.data["rms_held_out"].values[0] == pytest.approx(200, rel=0.2)
    truth = {"k_0_A": 0.25, "k_0_B": 0.18, "V_d_A": 5e-6, "V_d_B": 6e-6, "leak": 2e-10}
    assert_found(closed_fit, **truth, T_A=300.0, T_B=288.0)
    # One k_0 for a configuration: between those of the chambers, within an interval that holds both.
    cells = closed_fit.data.sel(model=EXACT)
    both, k_0 = cells.sel(parameter=["k_0_A", "k_0_B"]), cells.sel(parameter="k_0")
    assert both["estimate"].min() < k_0["estimate"] < both["estimate"].max()
    assert (k_0["low"], k_0["high"]) == (both["low"].min(), both["high"].max())
    # A law without wall heat has no first temperature: a first pressure is fitted in place of it.
    assert closed_fit.data["estimate"].sel(model="adiabatic", parameter=["T_A", "k_A", "k_0"]).isnull().all()
    assert not any(
        "held" in note or "are not noise" in note for note in closed_fit.notes + closed_fit.warnings
    )
    assert any("k_0 of A and of B do not overlap" in text for text in closed_fit.warnings)


def test_a_held_piston_needs_no_dead_volumes_and_agrees_with_the_transient_alone(plant):
    truth = TRUTH._replace(V_d=(plant.cylinder.V_d_A,) * 2, T=(293.15, 293.15))
    whole = measured(compressed(TIME), pressures(truth, plant, compressed, TIME), PERIOD, 2)
    still = whole.since(0.6)
    alone = fit_closed(still, plant)
    assert set(alone.models) == set(HELD) and "the piston is held" in alone.notes[0]
    assert_found(alone, k_0_A=0.25, k_0_B=0.18, leak=2e-10)
    assert np.isnan(alone.data["estimate"].sel(parameter="V_d_A")).all()
    # One exponential, without leakage, at mean P and T: within some per cent of the balance itself.
    k_0 = alone.data["estimate"].sel(model=EXACT, parameter="k_0_B").item()
    assert transient(still, plant, "B").k_0 == pytest.approx(k_0, rel=0.1)


def fitted_text(fit, plant):
    return fitted_configuration(load(TEMPLATE), "mine", plant, fit, "closed.csv", np.nan)


def test_a_chamber_that_is_open_is_left_out_and_takes_what_leaks(plant):
    # Open to a tank of 2 L at 1 bar, whose pressure hardly moves.
    truth = TRUTH._replace(V_d=(5e-6, 2e-3), P=(4e5, 101325.0), T=(293.15, 293.15))
    fit = fit_closed(measured(moving(TIME), pressures(truth, plant, moving, TIME), PERIOD, 5), plant)
    assert "P_B hardly follows the piston" in fit.notes[0] and fit.conventions["closed_chambers"] == "A"
    assert_found(fit, k_0_A=0.25, V_d_A=5e-6, leak=2e-10)
    assert np.isnan(fit.data["estimate"].sel(parameter="k_0_B")).all()
    assert "hardly follows the piston" in fit_page(fit, "closed.csv") and "nan" not in fitted_text(fit, plant)


def spoilt(record, plant):
    """Records that are refused, by a word of the message."""
    noise = np.random.default_rng(4).normal(4e5, 200.0, record.P.shape)
    return {
        "beyond 2 % of u_max in 12 %": record._replace(u=np.where(TIME < 1.0, 5.0, 0.0)),
        "look swapped": record._replace(P=record.P[::-1]),
        "nothing to fit": record._replace(P=np.full_like(noise, 4e5)),
        "P_A .*P_B .*beyond its noise": record._replace(P=noise),
        "P_A does not change": record._replace(P=noise, x=np.zeros_like(record.x)),
    }


def test_records_that_show_nothing_are_refused_in_one_line(record, plant):
    for words, bad in spoilt(record, plant).items():
        with pytest.raises(InputError, match=words) as caught:
            fit_closed(bad, plant)
        assert "\n" not in str(caught.value)


def test_the_configuration_gets_k_0_and_dead_volumes_and_the_page_stands_alone(closed_fit, plant, tmp_path):
    file = tmp_path / "fitted.yaml"
    file.write_text(fitted_text(closed_fit, plant), encoding="utf-8")
    k_0 = closed_fit.data["estimate"].sel(model=EXACT, parameter="k_0").item()
    for experiment in study(load(file)).experiments.values():
        assert experiment.plant.k_0 == pytest.approx(k_0, rel=1e-5)  # six digits are written
        cylinder = experiment.plant.cylinder
        V_d = closed_fit.data["estimate"].sel(model=EXACT, parameter=["V_d_A", "V_d_B"]).values.tolist()
        assert (cylinder.V_d_A, cylinder.V_d_B) == pytest.approx(V_d, rel=1e-5)
    text = file.read_text(encoding="utf-8")
    assert "no key for k_0 of A, k_0 of B, leakage A to B" in text and "reduced model" not in text
    closed_fit.save("0" * 64, tmp_path / "fit.nc")
    with xr.open_dataset(tmp_path / "fit.nc") as saved:
        assert saved.attrs["closed_chambers"] == "A, B" and saved.attrs["T_wall_K"] == 293.15
        for name, texts in (("notes", closed_fit.notes), ("warnings", closed_fit.warnings)):
            assert saved.attrs[name] == "\n".join(texts)
    page = fit_page(closed_fit, "closed.csv")
    assert "position alone" in page and "every k scales" in page


def decay(tau, span=3.0, change=5e4, noise=0.0, x=None, samples=601):
    t = np.linspace(0.0, span, samples)
    P = 2e5 + change * np.exp(-t / tau) + noise * np.random.default_rng(1).normal(size=samples)
    x = np.zeros(samples) if x is None else x
    return Measurement("m.csv", t[1], 0 * t, x, np.array([P, P]))


@pytest.mark.parametrize(
    ("begin", "words", "record"),
    [
        (0.0, "does not settle within the record's 3 s", {"tau": 9.3}),
        (0.0, r"changes by .* Pa at a noise of \d+ Pa: too little", {"change": 300.0, "noise": 300.0}),
        (2.76, "leaves 49 samples of 3 s: must be at least 50", {}),
        (0.0, "the piston moves by .* it must be held", {"x": np.linspace(0.0, 0.01, 601)}),
    ],
)
def test_a_transient_that_shows_no_time_constant_is_refused(begin, words, record, plant):
    with pytest.raises(InputError, match=words):
        transient(decay(**({"tau": 0.5} | record)), plant, "A", begin=begin)


def test_an_interval_of_a_time_constant_holds_the_truth_and_shrinks_with_the_noise(plant):
    wide, narrow = (transient(decay(0.5, noise=noise), plant, "A") for noise in (500.0, 50.0))
    for found in (wide, narrow):
        assert found.tau_low < 0.5 < found.tau_high and found.k_0_low < found.k_0 < found.k_0_high
        assert found.k_0 / found.k_0_low == pytest.approx(found.tau / found.tau_low, rel=1e-9)
    ratio = np.log(wide.tau_high / wide.tau_low) / np.log(narrow.tau_high / narrow.tau_low)
    assert ratio == pytest.approx(10.0, rel=0.05)  # the same noise, but for a curve that is not straight
    assert (wide.rms, narrow.rms) == pytest.approx((500.0, 50.0), rel=0.1)  # 601 samples know it to 3 %


@pytest.mark.parametrize(("side", "sign", "other"), [("A", 1, "B"), ("B", -1, "A")])
def test_a_conductance_is_that_of_mass_area_and_mean_pressure_of_a_chamber_off_mid_stroke(
    side, sign, other, plant
):
    """By hand: k = m c_v / tau, over the area ratio and the root of P T at their means."""
    c, gas, at = plant.cylinder, plant.gas, plant.conditions
    tau, x = 0.5, 0.2 * c.stroke
    found = transient(decay(tau, x=np.full(601, x)), plant, side)
    V = getattr(c, f"V_d_{side}") + getattr(c, f"A_{side}") * (c.stroke / 2 + sign * x)
    m = 2e5 * V / (gas.R * at.T_amb)
    k_av = m * gas.R / (gas.gamma - 1) / tau
    P = 2e5 + 5e4 * (1 - 0.01) / np.log(100)  # mean over the settling time to 1 %
    PT = P * at.T_amb * P / 2e5
    area = (c.bore / 2 + c.stroke / 2 + sign * x) / (c.bore / 2 + c.stroke / 2)
    k_0 = k_av / (area * (PT / (at.P_0 * at.T_0)) ** 0.5)
    assert (found.k_av, found.k_0) == pytest.approx((k_av, k_0), rel=1e-6)
