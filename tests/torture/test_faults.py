# pyright: standard
"""Faults on the smoke study: after a rerun the bytes are the same."""

import signal
import time

import pytest

from tests.torture.study import compared_files, stop

pytestmark = [pytest.mark.slow, pytest.mark.workflow, pytest.mark.xdist_group("workflow")]


def test_a_spoilt_file_is_refused_by_name_and_made_again(smoke_study):
    expected, damaged = smoke_study.hashes(), smoke_study.results / "datum/E06.nc"
    content = bytearray(damaged.read_bytes())
    content[len(content) // 2] ^= 1
    damaged.write_bytes(content)
    verified = smoke_study.pneumo("paper", "verify", smoke_study.results.name)
    assert f"{smoke_study.results.name}/datum/E06.nc" in verified.output
    damaged.unlink()
    done = smoke_study.run()
    assert done.code == 0 and smoke_study.hashes() == expected, done.output


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
