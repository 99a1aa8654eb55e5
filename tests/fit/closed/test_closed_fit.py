"""Closed chambers in `pneumo fit`: what made a record is found, and what cannot be seen is said."""

import numpy as np
import pytest
import xarray as xr
from closed_truth import Truth, measured, pressures

from pneumo.configuration.parameters import load, study
from pneumo.errors import InputError
from pneumo.fit.closed.closed_fit import HELD, fit_closed
from pneumo.fit.closed.closed_warnings import closed_warnings
from pneumo.fit.closed.thermal_time_constant import transient
from pneumo.fit.fit_result import Estimate
from pneumo.fit.fitted_yaml import fitted_configuration
from pneumo.fit.record.measurement import Measurement
from pneumo.fit.residuals import Residual
from pneumo.publish.pages.fit_page import fit_page
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.plants import configured_plant

pytestmark = pytest.mark.xdist_group("closed fit")  # its fixtures take seconds
EXACT = "wall heat, area and root of PT"  # the law of the truth
PERIOD = 5e-3
TIME = PERIOD * np.arange(1600)
TRUTH = Truth((0.25, 0.18), (5e-6, 6e-6), T=(300.0, 288.0), leak=2e-10)


@pytest.fixture(scope="module")
def plant():
    return configured_plant(study(load(TEMPLATE)), "mine", 1.0)


def moving(t):
    return 0.055 * np.sin(2.2 * t) * np.cos(0.3 * t) + 0.01 * np.sin(7 * t)


def compressed(t):
    """Position of a piston that is pushed by 60 mm in 0.2 s and held."""
    return -0.03 * np.tanh((t - 0.3) / 0.05)


@pytest.fixture(scope="module")
def record(plant):
    return measured(moving(TIME), pressures(TRUTH, plant, moving, TIME), PERIOD, 1)


@pytest.fixture(scope="module")
def closed_fit(record, plant):
    return fit_closed(record, plant)


@pytest.fixture(scope="module")
def held(plant):
    """A fast compression of chambers as configured, then a piston that is held."""
    truth = TRUTH._replace(V_d=(plant.cylinder.V_d_A,) * 2, T=(293.15, 293.15))
    return measured(compressed(TIME), pressures(truth, plant, compressed, TIME), PERIOD, 2)


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
    assert not any("held" in note for note in closed_fit.notes)
    assert any("k_0 of A and of B do not overlap" in text for text in closed_fit.warnings)


def test_the_k_0_of_a_configuration_is_the_mean_by_what_each_interval_says_of_its_logarithm(closed_fit):
    cells = closed_fit.data.sel(model=EXACT)
    both, k_0 = cells.sel(parameter=["k_0_A", "k_0_B"]), cells.sel(parameter="k_0")
    weights = 1 / np.log(both["high"] / both["low"]).values ** 2
    assert weights.max() > 1.1 * weights.min()  # else a plain mean is as good
    mean = np.average(np.log(both["estimate"].values), weights=weights)
    assert np.log(k_0["estimate"].item()) == pytest.approx(mean, rel=1e-9)
    assert (k_0["low"], k_0["high"]) == (both["low"].min(), both["high"].max())


def test_a_law_without_wall_heat_has_no_first_temperature(closed_fit):
    """There a first pressure is fitted in place of it."""
    for name in ("T_A", "T_B", "k_A", "k_0", "k_0_B"):
        for law in ("isothermal", "adiabatic", "free n"):
            assert np.isnan(closed_fit.data["estimate"].sel(model=law, parameter=name)), (law, name)


def test_k_0_is_the_laws_own_at_P_0(closed_fit):
    """A constant conductance is its mean; converted by the root of PT it was another."""
    constant = closed_fit.data["estimate"].sel(model="wall heat, constant")
    for side in "AB":
        k_0, mean = (constant.sel(parameter=f"{name}_{side}").item() for name in ("k_0", "k"))
        assert k_0 == pytest.approx(mean, rel=1e-12)


def test_a_mean_conductance_is_that_of_the_law_over_the_part_fitted(closed_fit, record, plant):
    """The law's k_0 times the means of area ratio and root of P T, from the true volumes, masses and leak."""
    c, fitted = plant.cylinder, round(0.6 * (len(TIME) - 1)) + 1
    x, P = moving(TIME[:fitted]), record.P[:, :fitted]
    leaked = TRUTH.leak * PERIOD * np.cumsum(P[0] - P[1])
    estimates = closed_fit.data["estimate"].sel(model=EXACT)
    for side, (sign, area) in enumerate(((1, c.A_A), (-1, c.A_B))):
        length = c.stroke / 2 + sign * x
        V = TRUTH.V_d[side] + area * length
        m = P[side, 0] * V[0] / (plant.gas.R * TRUTH.T[side]) - sign * leaked
        T = P[side] * V / (m * plant.gas.R)
        wall = (c.bore / 2 + length) / (c.bore / 2 + c.stroke / 2)
        at_0 = plant.conditions.P_0 * plant.conditions.T_0
        mean = np.mean(wall * (P[side] * T / at_0) ** 0.5)
        k, k_0 = (estimates.sel(parameter=f"{name}_{'AB'[side]}").item() for name in ("k", "k_0"))
        # The fit's volumes and first temperature are known to 0.1 %, noise of one first pressure is 0.07 %.
        assert k / k_0 == pytest.approx(mean, rel=2e-3)


def test_a_driven_record_is_refused(record, plant):
    driven = record._replace(u=np.where(TIME < 1.0, 5.0, 0.0))
    with pytest.raises(InputError, match=r"column u: beyond 2 % of u_max in 12 % of samples.*--closed-from"):
        fit_closed(driven, plant)


@pytest.mark.slow
def test_the_walls_temperature_scales_k_and_the_gas_and_changes_no_prediction(record, closed_fit, plant):
    warm = fit_closed(record._replace(T=1.1 * 293.15), plant)
    for name, power in (("k_A", -1), ("T_A", 1), ("V_d_A", 0)):
        ratio = (warm.data["estimate"] / closed_fit.data["estimate"]).sel(model=EXACT, parameter=name).item()
        assert ratio == pytest.approx(1.1**power, rel=1e-4), name  # where least squares end
    before, after = (fit.data["pressure"].sel(model=EXACT) for fit in (closed_fit, warm))
    np.testing.assert_allclose(after, before, rtol=1e-5)


@pytest.mark.slow
def test_a_compression_and_a_hold_give_what_the_transient_alone_gives(held, plant):
    assert_found(fit_closed(held, plant), k_0_A=0.25, k_0_B=0.18, leak=2e-10, V_d_A=plant.cylinder.V_d_A)
    still = held.since(0.6)
    alone = fit_closed(still, plant)
    assert set(alone.models) == set(HELD) and "the piston is held" in alone.notes[0]
    assert_found(alone, k_0_A=0.25, k_0_B=0.18, leak=2e-10)
    assert np.isnan(alone.data["estimate"].sel(parameter="V_d_A")).all()
    decay = transient(still, plant, "B")
    # One exponential, without leakage, at mean P and T: within some per cent of the balance itself.
    k_0 = alone.data["estimate"].sel(model=EXACT, parameter="k_0_B").item()
    assert decay.k_0 == pytest.approx(k_0, rel=0.1)


def test_a_piston_moves_where_the_first_and_last_third_differ_by_a_fiftieth_of_the_stroke(plant):
    pressure = 2e5 + 5e4 * np.exp(-TIME / 0.7)

    def sliding(by: float) -> Measurement:
        x = np.linspace(0.0, by * plant.cylinder.stroke, len(TIME))  # thirds differ by two thirds of it
        return Measurement("bench.csv", PERIOD, 0 * TIME, x, np.stack([pressure, pressure]))

    assert transient(sliding(0.029), plant, "A").tau == pytest.approx(0.7, rel=1e-6)
    with pytest.raises(InputError, match=r"bench\.csv: the piston moves by .* it must be held, within"):
        transient(sliding(0.031), plant, "A")


def test_k_0_that_is_open_and_an_n_that_no_gas_has_are_said(plant):
    errors, nothing = np.full(2, 200.0), np.empty((2, 0))
    no_n = Estimate({"n": 0.9}, {}, {}, 9 * errors, 9 * errors, nothing)
    values = {"k_0_A": 0.2, "k_0_B": 0.2, "V_d_A": 2.5 * plant.cylinder.V_d_A}
    low = values | {"k_0_A": np.nan, "k_0_B": 0.199}
    wall = Estimate(values, low, values | {"k_0_B": 0.201}, errors, errors, nothing)
    left = {EXACT: {"A": Residual(900.0, 800.0, 100.0), "B": Residual(100.0, 0.0, 100.0)}}
    said = closed_warnings({EXACT: wall, "free n": no_n}, left, plant)
    words = ["P_A: ", "does not determine k_0 of A", "dead volume of A is 2.5", "n = 0.9 is outside"]
    assert len(said) == len(words)
    assert all(any(word in text for text in said) for word in words), said


def test_a_chamber_that_is_open_is_left_out_and_takes_what_leaks(plant):
    # Open to a tank of 2 L at 1 bar, whose pressure hardly moves.
    truth = TRUTH._replace(V_d=(5e-6, 2e-3), P=(4e5, 101325.0), T=(293.15, 293.15))
    fit = fit_closed(measured(moving(TIME), pressures(truth, plant, moving, TIME), PERIOD, 5), plant)
    assert "P_B hardly follows the piston" in fit.notes[0] and fit.chambers == "A"
    assert_found(fit, k_0_A=0.25, V_d_A=5e-6, leak=2e-10)
    assert np.isnan(fit.data["estimate"].sel(parameter="k_0_B")).all()
    assert "hardly follows the piston" in fit_page(fit, "closed.csv") and "nan" not in fitted_text(fit, plant)


def fitted_text(fit, plant):
    return fitted_configuration(load(TEMPLATE), "mine", plant, fit, "closed.csv", np.nan)


def test_nothing_to_see_and_swapped_chambers_are_one_line(record, plant):
    noise = np.random.default_rng(4).normal(4e5, 200.0, record.P.shape)
    nothing = r"P_A .*P_B .*nothing to fit; move the piston fast"
    for P in (np.full_like(noise, 4e5), noise):
        for x in (np.zeros_like(record.x), record.x):
            with pytest.raises(InputError, match=nothing) as caught:
                fit_closed(record._replace(P=P, x=x), plant)
            assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="look swapped"):
        fit_closed(record._replace(P=record.P[::-1]), plant)


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
        assert saved.attrs["closed_chambers"] == "A, B" and saved.attrs["T_wall_K"] == closed_fit.T_wall
        for name, texts in (("notes", closed_fit.notes), ("warnings", closed_fit.warnings)):
            assert saved.attrs[name] == "\n".join(texts)
    page = fit_page(closed_fit, "closed.csv")
    assert "position alone" in page and "every k scales" in page
