"""The bench: every contender on a tiny slice, the bound's count, and what is written. No timing is judged."""

import json

import numpy as np
import pytest

from benchmarks import bench, probe, report, timing
from benchmarks.contenders import CONTENDERS, Outcome, installed
from benchmarks.study_runs import work_of_jobs

HERE = {name: contender for name, contender in CONTENDERS.items() if installed(contender)}
TINY = {name: contender._replace(seconds=0.02) for name, contender in HERE.items()}
STUDY = {"wall_s": {"cold": 40.0, "warm": 30.0, "noop": 2.0}, "replay_wall_s": 10.0, "job_overhead": 0.3}
STUDY |= {"peak_memory_gib": 1.0, "results_mb": 300.0, "cpu": "a processor"}


@pytest.fixture(scope="module")
def measured():
    return timing.compare(TINY, repeats=2)


@pytest.mark.slow
def test_all_contenders_agree_are_timed_and_shown(measured, tmp_path):
    assert set(measured["ns_per_lane_evaluation"]) == set(measured["checks"]) == set(HERE)
    assert {"kernel", "scalar", "numpy", "solve_ivp"} <= set(HERE)
    assert all(value > 0 for value in measured["ns_per_lane_evaluation"].values())
    kernel = measured["ns_per_lane_evaluation"]["kernel"]
    assert measured["fraction_of_bound"] == measured["bound_ns"] / kernel
    everything = {**measured, **STUDY, "instruction_sets": {"AVX2": measured}}
    text = report.markdown(everything)
    assert all(contender.label in text for contender in CONTENDERS.values())
    assert (report.NOT_INSTALLED in text) == (len(HERE) < len(CONTENDERS))
    report.chart(everything, tmp_path / "bench")
    assert {file.suffix for file in tmp_path.iterdir()} == {".svg", ".png"}
    assert np.isfinite(json.loads(json.dumps(everything))["bound_ns"])
    assert bench.cpu()


def test_a_contender_with_other_numbers_stops_the_bench():
    def prepare(case):
        outcome = CONTENDERS["kernel"].prepare(case)()
        return lambda: Outcome(outcome.mse * 1.001, outcome.calls)

    wrong = TINY["kernel"]._replace(prepare=prepare)
    with pytest.raises(timing.DisagreementError, match=r"fast kernel: MSE differs .* by 1\.0e-03"):
        timing.compare({"kernel": wrong}, repeats=1)


def test_count_of_operations_follows_the_needs_of_the_lanes():
    lanes = timing.case_of("E14", 1).lanes[:66]  # of the paper's models
    constant = lanes[probe.needs(lanes) == 0]
    assert probe.operations(constant).roots == 1
    assert probe.operations(constant).fused < probe.operations(lanes).fused
    costs = {"fused": 1.0, "divisions": 2.0, "roots": 3.0, "cycle": 1.0}
    twice = np.concatenate([lanes, lanes])  # of lanes that are the same one is replayed
    assert probe.bound(costs, twice).ns == probe.bound(costs, lanes).ns / 2
    most = probe.MOST_CYCLES * 8 / probe.vector_width()
    assert probe.bound(costs, lanes).cycles_per_8_lanes == most * 63 / 66


def test_work_is_what_the_logs_of_scripts_say_and_an_empty_log_says_nothing(tmp_path):
    logs = tmp_path / "results" / "logs"
    logs.mkdir(parents=True)
    (logs / "replay.log").write_text("replay: 12.50 s\n")
    (logs / "statistics.log").write_text("")
    assert work_of_jobs(tmp_path) == {"replay": 12.5}
