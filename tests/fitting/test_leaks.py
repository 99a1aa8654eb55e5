"""Leaks past the piston and through the valve's paths, as a rig has them that shares no code with the fit."""

import numpy as np
import pytest

from benchmarks.bench_rig import bench_record, purpose_rig
from benchmarks.fit_bench import believed_plant
from pneumo.fitting.fit_problem import FULL, Problem, leaked_volume, replayed_pressures, sagging_supply
from pneumo.fitting.stage_signals import stage_signals

RIG = purpose_rig()


@pytest.mark.parametrize("leak", ["piston_leak", "valve_leak"])
def test_a_replay_with_a_leak_follows_a_rig_that_has_it(leak, tmp_path):
    plant, part = believed_plant(RIG, tmp_path), 0.02
    c = bench_record(RIG._replace(**{leak: part}), np.random.default_rng(4), 1.5, noise=(0.0, 0.0))
    record = stage_signals(1e-3, c["u"], c["x"], np.array([c["P_A"], c["P_B"]]), plant)
    known = {"k_0": RIG.k_0, "k_xu": plant.valve.k_xu, "V_d_A": RIG.V_A, "V_d_B": RIG.V_B}
    known |= dict.fromkeys(("lag", "dead_time", "null"), 0.0)
    known |= {f"start_{side}": record.P[i, 0] for i, side in enumerate("AB")}
    known |= {"start_T_A": RIG.T_amb, "start_T_B": RIG.T_amb}

    def error(value: float) -> float:
        problem = Problem(FULL, plant, record, {}, also=(leak,))
        theta = problem.inner(known | {leak: value})
        # The first temperatures are not known: they no longer matter after half a second.
        return float(np.std((record.P - replayed_pressures(problem, theta[None])[0])[:, 500:]))

    assert error(part) < 0.2 * error(0.0)
    assert error(part) < error(0.8 * part) and error(part) < error(1.2 * part)


def test_a_leak_flows_by_the_pressures_at_its_own_time(plant):
    """From a chamber whose pressure rises on a line into one at a small constant pressure: sonic, (1)."""
    count, period, part = 200, 2e-3, 0.02
    P_A, P_B = np.linspace(4e5, 6e5, count), np.full(count, 1.2e5)
    zero = np.zeros(count)
    signals = stage_signals(period, zero, zero, np.array([P_A, P_B]), plant)
    assert signals.stride == 2
    found = leaked_volume(signals, plant, {"piston_leak": part})
    area, T, R = part * plant.valve.k_xu * plant.valve.u_max, plant.conditions.T_amb, plant.gas.R
    upstream = np.interp(signals.h * np.arange(len(found)), period * np.arange(count), P_A)
    flow = plant.gas.sonic_coefficient * area * upstream / T**0.5
    np.testing.assert_allclose(found[:, 0], flow * R * T / upstream, rtol=1e-12)
    np.testing.assert_allclose(found[:, 1], -flow * R * T / P_B[0], rtol=1e-12)


def test_a_supply_sags_by_the_pressures_at_its_own_time(plant):
    """No flow into a full chamber from the middle of the record on: there the supply is lowest."""
    count = 200
    P = np.where(np.arange(count) < count // 2, plant.conditions.P_atm, plant.conditions.P_s)
    zero = np.zeros(count)
    signals = stage_signals(2e-3, zero, zero, np.array([P, P]), plant)
    u = np.full_like(signals.u, plant.valve.u_max)
    P_s = sagging_supply(signals, u, plant, 0.2)[:, 0]
    assert signals.stride == 2 and abs(int(np.argmin(P_s)) - count) <= signals.stride
