"""Measured mass flows in place of the command: the replay by hand, read, fitted, and mistakes said."""

import numpy as np
import pandas as pd
import pytest

from pneumo import simulate
from pneumo.configuration.parameters import load, study
from pneumo.engineer.confused_columns import check_columns
from pneumo.engineer.estimate import fit_measurement
from pneumo.engineer.fit_parameters import Problem, replayed_pressures
from pneumo.engineer.least_squares import fit
from pneumo.engineer.record import ANR, Measurement, read_measurement
from pneumo.engineer.stage_signals import stage_signals, stage_times
from pneumo.errors import InputError
from pneumo.physics.cylinder import volume
from pneumo.physics.models import MODELS, lane, lane_array
from pneumo.physics.valve import chamber_flows
from pneumo.publish.pages.fit_page import fit_page
from pneumo.simulation.given_inputs import pressures_on_flows

PLANT = study(load("config/paper.yaml")).experiments["E10"].plant
C, GAS = PLANT.cylinder, PLANT.gas
H = 1e-3


def full_order(steps=2500):
    """A full-order run: time, position, pressures, and the flows that its valve lets through."""
    ticks = np.arange(steps)
    command = 0.8 * np.sign(np.sin(ticks / 150) + np.sin(ticks / 57)) + 0.3 * np.sin(ticks / 23)
    run = simulate(PLANT, H, command=command)
    flows = []
    for sign, P, T in ((1, run.P_A, run.T_A), (-1, run.P_B, run.T_B)):
        both = [
            chamber_flows(sign * u, p, t, PLANT.valve, GAS, PLANT.conditions)
            for u, p, t in zip(run.u, P, T, strict=True)
        ]
        flows.append([m_in - m_out for m_in, m_out in both])
    return run, np.array(flows)


@pytest.fixture(scope="module")
def measured():
    run, m = full_order()
    noise = np.random.default_rng(7).normal(0, 200.0, (2, len(run.t)))
    P = np.array([run.P_A, run.P_B]) + noise
    return Measurement("m.csv", H, np.zeros(len(run.t)), run.x, P, None, np.nan, (), m)


def test_a_constant_flow_into_a_still_chamber_raises_pressure_on_a_line():
    steps, m = 400, np.array([2e-5, -1e-5])  # kg/s
    inputs, flow = np.zeros((steps, 6, 3)), np.broadcast_to(m, (steps, 6, 2))
    start = np.full((1, 2), 4e5)
    adiabatic = lane_array([lane(MODELS["M3"], 1.4, GAS.gamma)])
    found = pressures_on_flows(inputs, flow, adiabatic, PLANT, H, 1, start)[0]
    c = PLANT.conditions
    rate = GAS.gamma * GAS.R * c.T_0 * m / volume(0.0, C.A_A, C)  # (10) with dV_dt = 0 and T = T_0
    np.testing.assert_allclose(found, 4e5 + rate[:, None] * H * np.arange(steps + 1), rtol=1e-11)


def test_a_closed_chamber_keeps_P_V_to_the_n():
    steps, n = 1000, 1.3
    at = stage_times(steps, H)
    x, v = 0.03 * np.sin(8 * at), 0.24 * np.cos(8 * at)
    inputs, flow = np.stack([0 * x, x, v], axis=-1), np.zeros((steps, 6, 2))
    start = np.full((1, 2), 4e5)
    found = pressures_on_flows(
        inputs, flow, lane_array([lane(MODELS["M5"], n, GAS.gamma)]), PLANT, H, 1, start
    )
    V = np.array([volume(0.03 * s * np.sin(8 * H * np.arange(steps + 1)), C.A_A, C) for s in (1, -1)])
    # The step is 1e-3 of a radian's time: a fifth-order method leaves some (8e-3)^5 = 3e-11 per step at most.
    np.testing.assert_allclose(found[0] * V**n, np.broadcast_to(4e5 * V[:, :1] ** n, V.shape), rtol=1e-8)


def test_a_chamber_that_empties_gives_nan():
    steps = 50
    flow = np.full((steps, 6, 2), -1.0)
    lanes = lane_array([lane(MODELS["M3"], 1.4, GAS.gamma)])
    found = pressures_on_flows(np.zeros((steps, 6, 3)), flow, lanes, PLANT, H, 1, np.full((1, 2), 4e5))
    assert np.isnan(found[..., -1]).all()


@pytest.mark.parametrize("model", ["M6", "M9"])
def test_a_models_own_pressures_give_its_parameters_back(measured, model):
    s = stage_signals(H, measured.u, measured.x, measured.P, 10.0, m=measured.m)
    problem = Problem(MODELS[model], PLANT, s, {})
    assert "k_xu" not in problem.names
    theta = problem.guess()
    theta[problem.names.index("n")] += 0.05
    theta[problem.names.index("V_d_A")] += 0.1
    P = replayed_pressures(problem, theta[None], s.inputs)[0]
    assert np.isfinite(P).all()
    found = fit(problem._replace(signals=s._replace(P=P)), tolerance=1e-12)
    np.testing.assert_allclose(found.theta, theta, atol=1e-4)  # the step of the differences


def test_full_order_pressures_are_followed(measured):
    found = fit_measurement(measured, PLANT, ["M8", "M5"])
    assert list(found["model"].values) == ["M8", "M5"]  # mixing and wall heat are in the truth
    assert {"m"} <= set(found.data_vars) and "u" not in found.data_vars
    assert np.isnan(found["estimate"].sel(parameter="k_xu")).all()
    # Noise has 200 Pa; M8 lacks little of the truth, and sampled flows miss the valve's corners.
    assert float(found["rms_held_out"].sel(model="M8").max()) < 3000
    assert "k_x k_u" in fit_page(found, "m.csv")


@pytest.mark.parametrize(
    ("confuse", "words"),
    [
        (lambda m: m._replace(m=-m.m), "m_A and m_B seem to have the wrong sign"),
        (lambda m: m._replace(x=-m.x), "column x"),
    ],
)
def test_confused_flows_are_refused(measured, confuse, words):
    check_columns(measured, PLANT)
    with pytest.raises(InputError, match=words):
        check_columns(confuse(measured), PLANT)


def table(measured):
    return {
        "t_s": measured.t,
        "x_m": measured.x,
        "P_A_Pa": measured.P[0],
        "P_B_Pa": measured.P[1],
        "m_A_g_per_s": 1e3 * measured.m[0],
        "m_B [l/min(ANR)]": measured.m[1] / ANR * 6e4,
    }


def test_columns_of_flow_are_read_in_their_units(measured, tmp_path):
    file = tmp_path / "m.csv"
    pd.DataFrame(table(measured)).to_csv(file, index=False)
    found = read_measurement(file, PLANT)
    np.testing.assert_allclose(found.m, measured.m, rtol=1e-13, atol=1e-18)
    assert not found.u.any() and found.notes == ()
    pd.DataFrame(table(measured) | {"u_V": measured.t}).to_csv(file, index=False)
    assert "column u: not used" in read_measurement(file, PLANT).notes[0]


@pytest.mark.parametrize(
    ("left_out", "words"),
    [(("m_B [l/min(ANR)]",), "no column m_B"), (("m_A_g_per_s", "m_B [l/min(ANR)]"), "u")],
)
def test_missing_flow_columns_are_named(measured, tmp_path, left_out, words):
    file = tmp_path / "m.csv"
    pd.DataFrame({k: v for k, v in table(measured).items() if k not in left_out}).to_csv(file, index=False)
    with pytest.raises(InputError, match=f"no column {words.removeprefix('no column ')}"):
        read_measurement(file, PLANT)
