"""Faults and other processors on the smoke study; `make torture` and `make determinism` take it whole."""

import random
import time
from pathlib import Path

import pytest

from torture.determinism import VARIANTS, compared
from torture.faults import FAULTS, Bench
from torture.study import Study

SMOKE = "config/smoke.yaml"

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("torture")]


@pytest.fixture(scope="module")
def bench(tmp_path_factory) -> Bench:
    study = Study(tmp_path_factory.mktemp("torture") / "checkout", SMOKE)
    start = time.perf_counter()
    done = study.run()
    assert done.code == 0, done.output
    seconds = time.perf_counter() - start
    return Bench(study, study.hashes(), seconds, study.size(), random.Random(1), kills=2, tries=1)


@pytest.mark.parametrize("fault", ["bit_flip", "truncated", "foreign"])
def test_a_spoilt_file_is_refused_by_name_and_made_again(bench, fault):
    same, outcome = next(FAULTS[fault](bench))
    assert same, outcome


def test_nothing_is_lost_by_a_kill_with_jobs_or_without(bench):
    for same, outcome in FAULTS["sigkill"](bench):
        assert same, outcome


def test_the_second_of_two_runs_is_refused(bench):
    for same, outcome in FAULTS["two_runs"](bench):
        assert same, outcome


@pytest.mark.parametrize("name", ["one_replay_thread", "sse2"])
def test_threads_and_processors_change_no_more_than_is_stated(bench, tmp_path: Path, name):
    variant = VARIANTS[name]
    study = Study(tmp_path / "checkout", SMOKE, variant.environment)
    done = study.run(*variant.arguments)
    assert done.code == 0, done.output
    result = compared(bench.study, study)
    assert result["largest_difference"] <= variant.bound, result["where"]
    assert result["same_statuses"]
    assert variant.bound or result["identical"] == result["files"]
