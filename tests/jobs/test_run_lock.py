"""One run in a folder at a time, and dates from the future."""

import os
import time

import pytest

from pneumo.jobs.run_lock import RUN, RUN_LOCK, take_run_lock


def refusal(capsys):
    with pytest.raises(SystemExit) as end:
        take_run_lock()
    assert end.value.code == 2
    return capsys.readouterr().err


def test_a_second_run_and_results_that_cannot_be_written_are_refused(run_folder, monkeypatch, capsys):
    monkeypatch.setenv(RUN, "")  # so that what is set here does not outlast this test
    take_run_lock()
    assert os.environ[RUN] == RUN_LOCK.read_text() != ""
    assert refusal(capsys).startswith("pneumo: another run is at work in this folder")
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # whom root may always write
    assert "results: cannot be written" in refusal(capsys)


def test_the_lock_of_another_user_is_refused_in_clear_words(run_folder, capsys):
    RUN_LOCK.unlink()
    RUN_LOCK.mkdir()  # as little to be opened, for root too
    assert "pneumo.run: cannot be written; is it mounted read-only, or another user's?" in refusal(capsys)


def test_files_from_the_future_are_dated_back_in_their_order(run_folder, monkeypatch):
    monkeypatch.setenv(RUN, "")
    dates = {"old": -1000, "first": 1000, "second": 2000, "with_second": 2000, "third": 3000}  # s from now
    now = time.time()
    (run_folder / "results").mkdir()
    for name, shift in dates.items():
        (run_folder / "results" / name).touch()
        os.utime(run_folder / "results" / name, (now + shift, now + shift))
    take_run_lock()
    after = {name: (run_folder / "results" / name).stat().st_mtime_ns for name in dates}
    assert after["old"] == pytest.approx((now - 1000) * 1e9, abs=1e3)
    assert after["first"] < after["second"] == after["with_second"] < after["third"] <= time.time_ns()
    assert after["first"] > (now - 1) * 1e9
