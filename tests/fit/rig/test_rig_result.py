"""A rig's fit as it is shown: a run replayed by every model, and estimates that are not physical."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from pneumo.errors import InputError
from pneumo.fit.rig.rig_file import rig
from pneumo.fit.rig.rig_fit import judged_models, values_of
from pneumo.fit.rig.rig_record import Points, read_runs, vessel_run
from pneumo.fit.rig.rig_replay import run_errors
from pneumo.fit.rig.rig_result import unphysical, with_replays

TANK = {"volume_L": 10, "orifice_mm": 2, "C_d": [0.1, 2], "k_0_W_per_K": 3, "P_start_bar": 8, "n": [0.5, 6]}


def known(**more):
    return rig(TANK | more, "test")


@pytest.fixture(scope="module")
def vessel():
    made = known(C_d=0.8)
    t = np.linspace(0.2, 60, 20)
    nothing = vessel_run(Points(t, np.zeros(20)), Points(t, np.zeros(20)))
    P, T = run_errors(made, "full order", {name: low for name, (low, _) in made.ends.items()}, nothing)
    return nothing._replace(P=Points(t, P), T=Points(t, T))


@pytest.fixture(scope="module")
def result(vessel):
    return judged_models(known(), [vessel], ["M5", "full order"])


def test_a_fit_outside_of_physics_is_named_and_one_inside_is_not(result):
    odd = unphysical(known(), result)
    # A free n and C_d of a model without wall heat take up the heat that the vessel's gas was given.
    assert set(odd) == {"M5"} and "n = " in odd["M5"] and "is not from 1 to 1.4" in odd["M5"]
    assert not unphysical(known(), result.sel(model=["full order"]))
    poor = result.assign(estimate=result["estimate"].where(result["parameter"] != "C_d", 0.5))
    assert "C_d = 0.5 is not from 0.7 to 0.9" in unphysical(known(), poor)["full order"]


def test_a_result_has_the_run_as_each_model_replays_it(result, vessel):
    shown = with_replays(result, known(), [vessel])
    np.testing.assert_array_equal(shown["measured_P"].sel(chamber="A"), vessel.P.values)
    for model in ("M5", "full order"):
        error = shown["replayed_P"].sel(model=model, chamber="A") - shown["measured_P"].sel(chamber="A")
        off, _ = run_errors(known(), model, values_of(result, known(), model), vessel)
        np.testing.assert_allclose(error.values, off, atol=1e-6)
    assert shown["replayed_T"].sizes == {"model": 2, "t_T": 20}
    assert shown.attrs["fitted_until"] == vessel.P.t[-1]  # of few points every second is held out


@pytest.mark.parametrize("late", [0.0, 1e-3])
def test_a_valves_record_is_read_where_its_samples_are_equally_spaced(late, tmp_path):
    t = 1e-3 * np.arange(400)
    on = (t > 0.05) & (t < 0.2)
    t[200:] += late  # s, one sample that is a whole period late
    columns = {"t_s": t, "u_V": 5.0 * on, "x_mm": np.full(400, 10.0), "P_A_bar": 1.0 + 2.0 * on}
    file = tmp_path / "valve.csv"
    pd.DataFrame(columns).to_csv(file, index=False)
    valve = {"valve_C_in_dm3_per_sbar": 1, "valve_C_out_dm3_per_sbar": 1, "P_s_bar": 6}
    chamber = rig({"bore_mm": 25, "dead_volume_mL": 5} | valve, "test")
    if late:
        with pytest.raises(InputError, match=r"valve\.csv: t: samples must be equally spaced, within 2 %"):
            read_runs(file, chamber)
    else:
        (pulse,) = read_runs(file, chamber)
        assert pulse.P.values.max() == pytest.approx(3e5)


def test_estimates_are_read_back_in_SI_units_and_known_values_where_none_was_fitted():
    made = rig(TANK | {"volume_L": [1, 20], "C_d": [0.1, 2]}, "test")
    estimate = ("model", "parameter"), [[7.0, np.nan]]
    result = xr.Dataset({"estimate": estimate}, {"model": ["M1"], "parameter": ["volume_L", "C_d"]})
    values = values_of(result, made, "M1")
    assert (values["volume"], values["C_d"], values["P_start"]) == pytest.approx((7e-3, 0.1, 8e5), rel=1e-12)
