"""Leaks past the piston and through the valve's paths, as a rig has them that shares no code with the fit."""

import numpy as np
import pytest

from benchmarks.bench_rig import bench_record, purpose_rig
from benchmarks.fit_bench import believed_plant
from pneumo.fitting.fit_problem import FULL, Problem, replayed_pressures
from pneumo.fitting.stage_signals import stage_signals

RIG = purpose_rig()


@pytest.mark.parametrize("leak", ["piston_leak", "valve_leak"])
def test_a_replay_with_a_leak_follows_a_rig_that_has_it(leak, tmp_path):
    plant, part = believed_plant(RIG, tmp_path), 0.02
    c = bench_record(RIG._replace(**{leak: part}), np.random.default_rng(4), 1.5, 2e-3, noise=(0.0, 0.0))
    record = stage_signals(2e-3, c["u"], c["x"], np.array([c["P_A"], c["P_B"]]), plant)
    assert record.stride > 1  # leaks follow the pressures at the times of the steps
    known = {"k_0": RIG.k_0, "k_xu": plant.valve.k_xu, "V_d_A": RIG.V_A, "V_d_B": RIG.V_B}
    known |= dict.fromkeys(("lag", "dead_time", "null"), 0.0)
    known |= {f"start_{side}": record.P[i, 0] for i, side in enumerate("AB")}
    known |= {"start_T_A": RIG.T_amb, "start_T_B": RIG.T_amb}

    def error(value: float) -> float:
        problem = Problem(FULL, plant, record, {}, also=(leak,))
        theta = problem.inner(known | {leak: value})
        # The first temperatures are not known: they no longer matter after half a second.
        return float(np.std((record.P - replayed_pressures(problem, theta[None])[0])[:, 250:]))

    assert error(part) < 0.2 * error(0.0)
    assert error(part) < error(0.5 * part) and error(part) < error(1.5 * part)  # samples are 2 ms apart
