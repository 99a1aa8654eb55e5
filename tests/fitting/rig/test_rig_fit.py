"""Fits to a rig: parameters of an independent simulation come back, and what a rig lacks is named."""

import numpy as np
import pytest
from independent_rig import BORE, CLOSES, OPENS

from paper.study.measured_air import as_skin, as_store
from pneumo.configuration.valve_conversions import area_per_conductance
from pneumo.fitting.fit_result import Estimate
from pneumo.fitting.rig.rig_file import key, rig
from pneumo.fitting.rig.rig_fit import fit_rig, fitted_names, judged_models, parted, unphysical
from pneumo.fitting.rig.rig_record import Points, Run, vessel_run
from pneumo.fitting.rig.rig_replay import replay_run, run_errors
from pneumo.fitting.settings import PART
from pneumo.physics.valve import GASES, choked_flow

ABOUT = {
    "bore_mm": 1e3 * BORE,
    "dead_volume_mL": [1, 100],
    "k_0_W_per_K": [0, 5],
    "valve_C_in_dm3_per_sbar": [0.1, 5],
    "valve_C_out_dm3_per_sbar": [0.1, 5],
    "valve_b": 0.5283,
    "valve_opening_ms": 1e3 * OPENS,
    "valve_closing_ms": 1e3 * CLOSES,
    "P_s_bar": [4, 9],
}
HOSE = {"hose_volume_mL": [0.5, 50], "hose_C_dm3_per_sbar": [0.1, 5], "hose_b": 0.5283}
TANK = {"volume_L": 10, "orifice_mm": 2, "C_d": [0.5, 1], "k_0_W_per_K": [0, 20], "P_start_bar": 8}


KNOWN = {name: value for name, value in ABOUT.items() if not isinstance(value, list)}
KNOWN |= {"dead_volume_mL": 12, "valve_C_in_dm3_per_sbar": 1, "valve_C_out_dm3_per_sbar": 1, "P_s_bar": 6}


def replayed(content, run, model="full order"):
    """Pressures of a run as a rig replays it whose quantities are all known, by chamber."""
    known = rig(content, "test")
    replay = replay_run(known, model, {name: low for name, (low, _) in known.ends.items()}, run)
    return np.array([P.values for P in replay.pressures])


def driven(count=120, travel=0.08):
    points = Points(np.arange(count) * 1e-3, np.full(count, 1e5))
    return Run(1e-3, np.linspace(0, travel, count), 0.02, 0.08, points, P_B=points, travel=travel)


def test_of_the_other_chamber_what_is_not_named_is_as_of_the_first():
    about = KNOWN | HOSE | {"hose_volume_mL": 6, "hose_C_dm3_per_sbar": 0.9, "dead_volume_B_mL": 20}

    def both(**more):
        return replayed(about | more, driven())

    usual = both()
    assert usual[0, 0] == 101325.0 and usual[1, 0] == 6e5  # vented, and filled from the supply
    assert usual[1, 15] > 5.9e5  # until the valve switches
    assert usual[0].max() > 4e5 and usual[1].min() < 4e5
    same = both(hose_volume_B_mL=6, hose_C_B_dm3_per_sbar=0.9, valve_C_in_B_dm3_per_sbar=1, rod_B_mm=0)
    np.testing.assert_array_equal(same, usual)
    for name, value in (("hose_volume_B_mL", 12), ("rod_B_mm", 16), ("P_start_B_bar", 5)):
        other = both(**{name: value})
        np.testing.assert_array_equal(other[0], usual[0])
        assert np.abs(other[1] - usual[1]).max() > 1e3, name


def test_a_supply_that_sags_is_shared_by_both_chambers():
    about = KNOWN | {"supply_volume_L": 0.2, "regulator_C_dm3_per_sbar": 0.05, "k_0_W_per_K": 0.5}
    alone = replayed(about, driven())[0]
    with_other = replayed(about | {"dead_volume_B_mL": 20}, driven())[0]
    # What the other chamber drew before the valve switched, and draws after, is missing in this one.
    assert np.abs(with_other - alone).max() > 1e3
    narrow = replayed(about | {"regulator_C_dm3_per_sbar": 0.02}, driven())[0]
    assert np.abs(narrow - alone).max() > 1e3  # less is drawn from the source


@pytest.mark.parametrize(("gas", "R", "gamma"), [("helium", 2077.3, 5 / 3), ("CO2", 188.92, 1.291)])
def test_a_valve_has_its_area_in_every_gas_whose_C_was_measured_with_air(gas, R, gamma):
    def choked(R, gamma):  # flow of an ideal nozzle, over area and pressure, at one temperature
        return (gamma / R) ** 0.5 * (2 / (gamma + 1)) ** ((gamma + 1) / (2 * gamma - 2))

    about = KNOWN | {"gas": gas, "dead_volume_mL": 1000}
    P = replayed(about, driven(200, travel=0.0)._replace(P_B=None))[0]
    flow = 1e-8 * 1.185 * 6e5 * choked(R, gamma) / choked(287.0, 1.4)  # kg/s
    assert (P[60] - P[40]) / 20e-3 == pytest.approx(gamma * R * 293.15 * flow / 1e-3, rel=1e-4)
    of_plant = choked_flow(area_per_conductance(GASES[gas]), 6e5, 293.15, GASES[gas])
    assert of_plant == pytest.approx(flow, rel=1e-4)


@pytest.mark.parametrize("model", ["M8", "full order"])
def test_a_silencer_holds_pressure_back_and_a_wide_one_is_none(model):
    run = driven(200, travel=0.0)._replace(P_B=None)

    def vented(**more):
        return replayed(KNOWN | {"dead_volume_mL": 40} | more, run, model)[0]

    def silenced(volume, C, **more):
        return vented(silencer_volume_mL=volume, silencer_C_dm3_per_sbar=C, **more)

    without = vented()
    # A hundred times as wide as the valve, and 1/40 of the chamber's volume.
    np.testing.assert_allclose(silenced(1, 100), without, rtol=2e-3)
    narrow = silenced(1, 1)
    # Until the valve closes, only what leaves while it opens differs.
    np.testing.assert_allclose(narrow[:80], without[:80], rtol=5e-3)
    assert (narrow[95:140] > 1.05 * without[95:140]).all()
    # Two equal restrictions in series, by ISO 6358: 0.65 to 0.75 of one's C, as b is from 0.5 to 0.2. By the
    # time to fall from 4 to 2 bar, which is inverse to C.
    fall = [np.ptp(np.interp([-4e5, -2e5], -P[80:], np.arange(120))) for P in (without, narrow)]
    assert 0.6 < fall[0] / fall[1] < 0.8
    assert np.abs(silenced(1, 1, silencer_b=0.2) - narrow).max() > 1e3
    assert np.abs(vented(valve_b_out=0.2) - without).max() > 1e3


def test_a_skin_of_the_wall_is_a_store_beside_the_gas_with_other_numbers():
    about = {**TANK, "C_d": 0.8}
    skin = {"store_k": 5.0, "store_back": 3.0, "store_c": 40.0, "k_0": 0.0}
    store = as_store(skin)
    assert store["store_back"] == 0 and store["k_0"] == pytest.approx(15 / 8)  # both in series
    assert as_skin(store) == pytest.approx(skin)
    run = vessel_run(Points(np.linspace(0.2, 60, 20), np.zeros(20)))
    replays = [
        replayed(about | {key(name): value for name, value in values.items()}, run)[0]
        for values in (skin, store, {"k_0": store["k_0"]})
    ]
    # Both are the same linear response; steps are of fifth order.
    np.testing.assert_allclose(replays[0], replays[1], rtol=1e-6)
    assert np.abs(replays[2] - replays[1]).max() > 1e3


@pytest.mark.parametrize(("pulses", "fitted"), [(2, 1), (4, 1), (8, 2)])
def test_of_several_pulses_the_first_quarter_is_fitted_and_the_others_are_held_out(pulses, fitted):
    runs = [driven()] * pulses
    used, ((same, others),), _ = parted(runs)
    assert (len(used), len(same), len(others)) == (fitted, fitted, pulses - fitted)


def test_of_a_run_with_many_points_the_later_ones_are_held_out_and_each_point_counts_once():
    t = np.arange(1001.0)
    _, (((early,), (late,)),), _ = parted([vessel_run(Points(t, t))])
    np.testing.assert_array_equal(np.concatenate([early.P.t, late.P.t]), t)
    assert early.P.t[-1] == 1000 * PART


@pytest.mark.parametrize(("n", "said"), [(0.99, 1), (1.0, 0), (1.4, 0), (1.41, 1)])
def test_an_index_on_its_physical_ends_is_not_doubted(n, said):
    found = Estimate({"n": n}, {}, {}, np.ones(1), np.ones(1), np.empty(0))
    assert len(unphysical(rig(TANK, "test"), {"M5": found})) == said


def tank(k=3.0, C_d=0.8, lag=0.0, T=True):
    known = rig(TANK | {"C_d": C_d, "k_0_W_per_K": k, "T_lag_s": lag}, "test")
    t = np.linspace(0.2, 60, 20)
    run = vessel_run(Points(t, np.zeros(20)), Points(t, np.zeros(20)) if T else None)
    values = {name: low for name, (low, _) in known.ends.items()}
    P, gas = run_errors(known, "full order", values, run)
    return run._replace(P=Points(t, P), T=Points(t, gas) if T else None)


def test_a_thermometers_lag_is_fitted_with_the_temperature():
    run = tank(lag=4.0)
    with_lag = rig(TANK | {"T_lag_s": [0, 20]}, "test")
    assert fit_rig(with_lag, "full order", [run], temperature=True).values["T_lag"] == pytest.approx(
        4, rel=1e-3
    )
    assert "T_lag" not in fitted_names(with_lag, "M8")


def test_a_vessels_own_parameters_come_back_with_the_run_and_its_replay():
    run = tank()
    fit = judged_models(rig(TANK | {"n": [0.5, 6]}, "test"), [run], ["M5", "full order"])
    assert fit.models == ["full order", "M5"]
    # The same model made the points: what is left is where least squares ends.
    estimates = fit.estimates("full order")
    assert estimates["C_d"].value == pytest.approx(0.8, rel=1e-4)
    assert estimates["k_0"].value == pytest.approx(3.0, rel=1e-3)
    best = fit.data.sel(model="full order")
    assert best["rms_held_out"].max() < 10 and best["rms_temperature"] < 0.01
    np.testing.assert_array_equal(fit.data["P"].sel(chamber="A"), run.P.values)
    np.testing.assert_allclose(best["pressure"].sel(chamber="A"), run.P.values, atol=10)
    np.testing.assert_allclose(best["temperature"], run.T.values, atol=0.01)
    assert fit.data["rms_held_out"].sel(model="M5").max() > 1e3
    # A free n and C_d of a model without wall heat take up the heat that the vessel's gas was given.
    assert any(text.startswith("M5: n = ") and "not physical" in text for text in fit.warnings)
    assert not any("full order" in text for text in fit.warnings)
    assert fit.held_out_from == run.P.t[-1] and "every second point" in fit.notes[0]
