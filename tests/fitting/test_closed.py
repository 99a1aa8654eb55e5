"""`pneumo fit --closed`: what made a record is found, and what cannot be seen is refused or named.

The contract judges estimates, intervals and causes of more records.
"""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from closed_truth import Truth, measured, moving, pressures

import pneumo
from pneumo.configuration.parameters import load, study
from pneumo.errors import InputError
from pneumo.fitting.closed.closed_fit import fit_closed
from pneumo.fitting.fitted_yaml import fitted_configuration
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
    assert any("k_0 of A and of B do not overlap" in text for text in closed_fit.warnings)


def test_one_chamber_filled_and_the_other_vented_and_then_shut_show_k_0(plant):
    """The search for the law of the truth must not end at a conductance that settles within a sample."""
    cylinder = plant.cylinder._replace(x_min=-1e-4, x_max=1e-4)
    shut = np.where(np.arange(6000) < 100, 10.0, 0.0)
    run = pneumo.simulate(plant._replace(k_0=0.5, cylinder=cylinder), 1e-3, command=shut)
    still = measured(run.x, np.array([run.P_A, run.P_B]), 1e-3, 2, 100.0).part(200)
    fit = fit_closed(still, plant)
    assert fit.models[0] == EXACT
    assert_found(fit, k_0_A=0.5, k_0_B=0.5)
    assert fit.data["low"].sel(model=EXACT, parameter="leak") == 0  # not NaN, which is an open end


def fitted_text(fit, plant):
    record = measured(np.zeros(9), np.zeros((2, 9)), 1e-3, 1, 0.0)
    return fitted_configuration(load(TEMPLATE), "mine", plant, fit, "closed.csv", record)


def test_a_chamber_that_is_open_is_left_out_and_takes_what_leaks(plant):
    # Open to a tank of 2 L at 1 bar, whose pressure hardly moves.
    truth = TRUTH._replace(V_d=(5e-6, 2e-3), P=(4e5, 101325.0), T=(293.15, 293.15))
    fit = fit_closed(measured(moving(TIME), pressures(truth, plant, moving, TIME), PERIOD, 5), plant)
    assert "P_B hardly follows the piston" in fit.notes[0]
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
        for name, texts in (("notes", closed_fit.notes), ("warnings", closed_fit.warnings)):
            assert saved.attrs[name] == "\n".join(texts)
    page = fit_page(closed_fit, "closed.csv")
    assert "position alone" in page and "scales with its inverse" in page
