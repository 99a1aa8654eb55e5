"""Causes of doubt: each changes the replay as it should, and is named where the rig has it."""

import numpy as np
import pytest

from pneumo.fitting.on_signals import SUPPLY_LINE, as_logged, supply_at_valve
from pneumo.fitting.stage_signals import StageSignals
from pneumo.fitting.valve_signal import behind_valve, valve_signal

VALVE = {"dead_time": 0.0, "lag": 0.0, "null": 0.0}


def test_pressures_behind_a_filter_follow_its_exact_response():
    t = 1e-3 * np.arange(60)
    ramp = np.maximum(t - 0.01, 0.0)
    logged = as_logged(ramp[None], 1e-3, {"filter": 3e-3})[0]
    exact = np.where(ramp > 0, ramp - 3e-3 * -np.expm1(-ramp / 3e-3), 0.0)
    np.testing.assert_allclose(logged, exact, atol=1e-12)
    steady = np.full((1, 5), 7.0)
    np.testing.assert_allclose(as_logged(steady, 1e-3, {"filter": 3e-3}), steady, rtol=1e-12)


def test_pressures_are_earlier_where_x_is_late():
    P = np.arange(20.0)[None]
    late, early = (as_logged(P, 1e-3, {"skew": sign * 2.5e-3}) for sign in (1, -1))
    # Before the first sample and after the last the pressure is taken to hold.
    np.testing.assert_allclose(late, np.minimum(P + 2.5, 19.0))
    np.testing.assert_allclose(early, np.maximum(P - 2.5, 0.0))
    np.testing.assert_array_equal(as_logged(P, 1e-3, {}), P)


def test_a_valve_with_play_and_dead_band_opens_late():
    u = np.array([0.0, 1.0, 2.0, 1.5, 0.0, -1.0])
    stages = np.repeat(u[:, None], 3, axis=1)
    played = behind_valve(stages, 1e-3, VALVE | {"hysteresis": 0.5}, 10.0)[:, 0]
    np.testing.assert_allclose(played, [0.0, 0.5, 1.5, 1.5, 0.5, -0.5], atol=1e-5)  # a lag of none is 1 ns
    banded = behind_valve(stages, 1e-3, VALVE | {"dead_band": 0.5}, 10.0)[:, 0]
    np.testing.assert_allclose(banded, [0.0, 0.5, 1.5, 1.0, 0.0, -0.5], atol=1e-5)


@pytest.mark.parametrize(
    ("dead_time", "expected"),  # steps; means over each step of the command that many steps before
    [(1.5, [1.0, 1.0, 1.5, 3.0]), (-1.5, [3.0, 3.5, 3.0, 3.0])],
)
def test_before_and_after_the_record_the_command_is_taken_to_hold(dead_time, expected):
    u, h = np.array([1.0, 2.0, 4.0, 3.0]), 1e-3
    shifted = valve_signal(u, h, dead_time=dead_time * h, lag=0.0, null=0.0)
    np.testing.assert_allclose(shifted, expected, atol=1e-5)  # a lag of none is 1 ns
    assert valve_signal(u, h, dead_time=0.0, lag=5 * h, null=0.0)[0] == u[0]  # at rest where it begins


def test_a_supply_sags_with_the_flow_by_iso_6358(plant):
    P_s, b, steps = plant.conditions.P_s, plant.gas.critical_ratio, round(20 * SUPPLY_LINE / 1e-3)
    u = np.full((steps, 3), plant.valve.u_max / 2)
    motion, P = np.zeros((steps, 3, 2)), np.full((2, steps + 1), 0.8 * P_s)
    signals = StageSignals(1e-3, 1e-3, u, motion, P, np.ones(P.shape, dtype=bool))
    sagging = supply_at_valve(signals, u, plant, {"sag": 0.1})
    flow = 0.5 * np.sqrt(1 - ((0.8 - b) / (1 - b)) ** 2)  # over the choked one
    assert sagging[-1] == pytest.approx(P_s * (1 - 0.1 * flow**2), rel=1e-6) and sagging[0, 0] > 0.999 * P_s
    measured = signals._replace(P_s=np.full(u.shape, 0.9 * P_s))
    both = supply_at_valve(measured, u, plant, {"sag": 0.1, "offset_P_s": -0.1 * P_s})
    np.testing.assert_allclose(both, sagging)  # of the measured supply, less its sensor's offset


def test_a_valve_lags_and_keeps_the_integral():
    h, u = 1e-3, np.where(np.arange(400) < 100, 0.0, 2.0)
    slow = valve_signal(u, h, dead_time=0.0, lag=5e-3, null=0.5) + 0.5
    # Mean over each step of the exact response, 2 (1 - exp(-t/tau)) from 0.1 s on.
    from_step = np.maximum(h * np.arange(401) - 0.1, 0.0)
    exact = np.diff(2 * (from_step + 5e-3 * np.exp(-from_step / 5e-3))) / h
    np.testing.assert_allclose(slow, exact, atol=1e-9)
