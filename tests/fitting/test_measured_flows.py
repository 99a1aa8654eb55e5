"""Measured mass flows in place of the command: the replay by hand, read, fitted, and mistakes named."""

import numpy as np
import pandas as pd
import pytest

from pneumo import simulate
from pneumo.configuration.valve_conversions import ANR_RHO
from pneumo.errors import InputError
from pneumo.fitting.measurement_fit import fit_measurement
from pneumo.fitting.mistaken_columns import check_columns
from pneumo.fitting.record.measurement import Measurement, read_measurement
from pneumo.physics.valve import chamber_flows
from pneumo.publish.pages.fit_page import fit_page

H = 1e-3


@pytest.fixture(scope="module")
def measured(plant):
    """Full-order run with noise in the pressures, and the flows that its valve lets through."""
    ticks = np.arange(2500)
    command = 0.8 * np.sign(np.sin(ticks / 150) + np.sin(ticks / 57)) + 0.3 * np.sin(ticks / 23)
    run = simulate(plant, H, command=command)
    rest = plant.valve, plant.gas, plant.conditions
    sides = ((run.u, run.P_A, run.T_A), (-run.u, run.P_B, run.T_B))
    m = -np.diff([[chamber_flows(*at, *rest) for at in zip(*side, strict=True)] for side in sides])[..., 0]
    P = np.array([run.P_A, run.P_B]) + np.random.default_rng(7).normal(0, 200.0, (2, len(ticks)))
    return Measurement("m.csv", H, np.zeros(len(ticks)), run.x, P, m=m)


@pytest.mark.slow
def test_full_order_pressures_are_followed(plant, measured):
    found = fit_measurement(measured, plant, ["M8", "M5"])
    assert found.models == ["M8", "M5"]  # mixing and wall heat are in the truth
    assert "m" in found.data and "u" not in found.data
    assert np.isnan(found.data["estimate"].sel(parameter="k_xu")).all()
    # Noise has 200 Pa; M8 lacks little of the truth, and sampled flows miss the valve's corners.
    assert float(found.data["rms_held_out"].sel(model="M8").max()) < 3000
    assert "k<sub>x</sub> k<sub>u</sub>" in fit_page(found, "m.csv")


def test_columns_of_flow_are_read_in_their_units_or_refused(plant, measured, tmp_path):
    columns = {"t_s": measured.t, "x_m": measured.x, "P_A_Pa": measured.P[0], "P_B_Pa": measured.P[1]}
    columns |= {"m_A_g_per_s": 1e3 * measured.m[0], "m_B [l/min(ANR)]": measured.m[1] / ANR_RHO * 6e4}

    def read(chosen):
        pd.DataFrame(chosen).to_csv(tmp_path / "m.csv", index=False)
        return read_measurement(tmp_path / "m.csv", plant)

    found = read(columns)
    np.testing.assert_allclose(found.m, measured.m, rtol=1e-13, atol=1e-18)
    assert not found.u.any() and found.notes == ()
    assert "column u: not used" in read(columns | {"u_V": measured.t}).notes[0]
    for last, missing in ((-1, "m_B"), (-2, "u")):
        with pytest.raises(InputError, match=f"no column {missing}"):
            read({name: columns[name] for name in list(columns)[:last]})
    check_columns(measured, plant)
    for confused, words in (
        (measured._replace(m=-measured.m), "m_A and m_B seem to have the wrong sign"),
        (measured._replace(x=-measured.x), "column x"),
    ):
        with pytest.raises(InputError, match=words):
            check_columns(confused, plant)
    with pytest.raises(InputError, match="models: none given"):
        fit_measurement(measured, plant, [])
