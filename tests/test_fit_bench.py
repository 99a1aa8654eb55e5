"""The bench of the fit: its rig shares no code with pneumo, and its counts follow its rules."""

import numpy as np
import pytest
from brief import in_brief

from benchmarks import bench_rig
from benchmarks.bench_rig import bench_record, drawn_rig
from benchmarks.fit_bench import judged


def test_records_differ_by_seed_and_stay_within_what_is_possible():
    for seed in range(3):
        rng = np.random.default_rng(seed)
        rig = drawn_rig(rng)
        c = bench_record(rig, rng, 2.0)
        assert len(c["t"]) == 2001
        assert np.abs(c["x"]).max() < rig.stroke / 2
        assert c["P_A"].min() > bench_rig.P_ATM and c["P_A"].max() < 1.3 * rig.P_s


@pytest.mark.parametrize("name", in_brief(["gauge", "unit"], ["unit"]))
def test_records_with_a_mistake_of_units_are_refused(name):
    outcome = judged(name, 1, [])
    assert outcome.refused and outcome.warned and not outcome.found
