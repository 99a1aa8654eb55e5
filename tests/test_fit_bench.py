"""The bench of the fit: its rig shares no code with pneumo, and its counts follow its rules."""

import ast
from pathlib import Path

import numpy as np
import pytest
from brief import in_brief

from benchmarks import bench_rig
from benchmarks.bench_rig import bench_record, drawn_rig, purpose_rig
from benchmarks.disturbances import DISTURBANCES
from benchmarks.fit_bench import judged
from benchmarks.fit_counts import TOLERANCE, Outcome, markdown, summary


def test_the_rig_imports_nothing_of_pneumo():
    tree = ast.parse(Path(bench_rig.__file__).read_text(encoding="utf-8"))
    modules = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    modules |= {a.name for node in ast.walk(tree) if isinstance(node, ast.Import) for a in node.names}
    assert modules == {"ctypes", "functools", "math", "pathlib", "subprocess", "tempfile", "typing", "numpy"}


def test_chambers_of_a_held_piston_go_to_supply_and_atmosphere():
    held = purpose_rig()._replace(mass=1e9)
    for target, ends in (10.0, (7e5, 101325.0)), (-10.0, (101325.0, 7e5)), (0.0, (5.6e5, 5.6e5)):
        rows = bench_rig.run_bench(held, np.full(5001, target), 1.0, 0, 1e-3)  # 5 s are many times m c_v / k
        np.testing.assert_allclose(rows[-1, 2:4], ends, rtol=1e-3)


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


def test_counts_follow_the_rules():
    def outcome(k_0, low, high, warnings=()):
        return Outcome("none", 1, 1.0, "", list(warnings), {"k_0": [1.0, k_0, low, high]})

    cases = [
        outcome(1.1, 0.9, 1.2),  # holds
        outcome(1.1, 1.05, 1.2),  # outside, but off by less than one minds
        outcome(2.0, 1.5, 2.5),  # wrong in silence
        outcome(2.0, 1.5, 2.5, ["k_0 is odd"]),
        outcome(2.0, 0.5, np.inf),  # an open end sets no limit
        Outcome("none", 2, 1.0, "no column x", [], {}),
    ]
    row = summary(cases).loc["none"]
    counts = {"records": 6, "refused": 1, "warned": 1, "outside": 3, "wrong": 2, "silent": 1}
    assert {name: row[name] for name in counts} == counts
    text = markdown(cases, ["M8"])
    assert "Wrong in silence: 1 of 6." in text
    assert DISTURBANCES["none"].text in text and TOLERANCE["k_0"] == 0.25
