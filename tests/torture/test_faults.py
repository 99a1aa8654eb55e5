# pyright: standard
"""Faults on the smoke study; `make torture` does it all."""

import random
import signal
import time

import pytest

from tests.torture.compare import compared_files
from tests.torture.faults import FAULTS, Bench
from tests.torture.study import stop

pytestmark = [pytest.mark.slow, pytest.mark.workflow, pytest.mark.xdist_group("workflow")]


def test_a_spoilt_file_is_refused_by_name_and_made_again(smoke_study):
    hashes, size = smoke_study.hashes(), smoke_study.size()
    bench = Bench(smoke_study, hashes, 0.0, size, random.Random(1), kills=0, tries=1)
    same, outcome = next(FAULTS["damage"](bench))
    assert same, outcome


def test_two_kills_then_one_job_at_a_time_give_the_same_bytes(smoke_study):
    expected = smoke_study.hashes()
    smoke_study.clear()
    for with_jobs in (True, False):  # left to themselves, jobs go on writing for a while
        run, count = smoke_study.start(), len(compared_files(smoke_study.results))
        while len(compared_files(smoke_study.results)) == count and run.poll() is None:
            time.sleep(0.1)
        assert stop(run, signal.SIGKILL, with_jobs=with_jobs, after=0)
    assert smoke_study.hashes() != expected
    done = smoke_study.run("-j1")
    assert done.code == 0, done.output
    assert smoke_study.hashes() == expected
