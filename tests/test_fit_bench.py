"""The bench of the fit: its rig shares no code with pneumo, and its counts follow its rules."""

import numpy as np
import pytest
from brief import in_brief

from benchmarks import bench_rig
from benchmarks.bench_rig import bench_record, drawn_rig
from benchmarks.fit_bench import judged
from benchmarks.fit_counts import Outcome


def test_records_differ_by_seed_and_stay_within_what_is_possible():
    for seed in range(3):
        rng = np.random.default_rng(seed)
        rig = drawn_rig(rng)
        c = bench_record(rig, rng, 2.0)
        assert len(c["t"]) == 2001
        assert np.abs(c["x"]).max() < rig.stroke / 2
        assert c["P_A"].min() > bench_rig.P_ATM and c["P_A"].max() < 1.3 * rig.P_s


def test_a_case_is_silent_where_a_parameter_is_wrong_in_green_without_a_warning():
    wrong = {"V_A": [1.0, 1.5, 1.4, 1.6]}
    for light, silent in (("green", True), ("yellow", False), ("red", False)):
        assert Outcome("zero", 1, 1.0, "", [], wrong, {"V_A": light}).silent == silent
    assert Outcome("zero", 1, 1.0, "", [], wrong).silent
    assert not Outcome("zero", 1, 1.0, "", ["the stops are elsewhere"], wrong, {"V_A": "green"}).silent


@pytest.mark.parametrize("name", in_brief(["gauge", "unit"], ["unit"]))
def test_records_with_a_mistake_of_units_are_refused(name):
    outcome = judged(name, 1, [])
    assert outcome.refused and outcome.warned and not outcome.found
