"""One run in a folder at a time, and files from the future."""

import os
import time

import pytest

from pneumo.jobs.run_lock import RUN, RUN_LOCK, set_damaged_aside, take_run_lock
from pneumo.storage.files import write_json


def refusal(capsys):
    with pytest.raises(SystemExit) as end:
        take_run_lock()
    assert end.value.code == 2
    return capsys.readouterr().err


def test_a_second_run_and_results_that_cannot_be_written_are_refused(run_folder, monkeypatch, capsys):
    monkeypatch.setenv(RUN, "")  # so that what is set here does not outlast this test
    take_run_lock()
    assert os.environ[RUN] == RUN_LOCK.read_text() != ""
    assert refusal(capsys).startswith("pneumo: another run is active in this folder")
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # whom root may always write
    assert "results: cannot be written" in refusal(capsys)


def test_the_lock_of_another_user_is_refused_in_clear_words(run_folder, capsys):
    RUN_LOCK.unlink()
    RUN_LOCK.mkdir()  # as little to be opened, for root too
    assert "pneumo.run: cannot be written; each user needs a checkout of their own" in refusal(capsys)


@pytest.mark.parametrize("shift", [-1000, 1000])
def test_a_file_from_the_future_is_named_and_not_changed(run_folder, monkeypatch, capsys, shift):
    monkeypatch.setenv(RUN, "")
    file, date = run_folder / "results" / "E01.nc", time.time() + shift
    file.parent.mkdir()
    file.touch()
    os.utime(file, (date, date))
    take_run_lock()
    warned = capsys.readouterr().err.startswith("pneumo: results/E01.nc: modified in the future; correct the")
    assert warned == (shift > 0)
    assert file.stat().st_mtime == pytest.approx(date)


def test_damaged_results_are_set_aside_and_good_ones_stay(run_folder, capsys):
    results = run_folder / "results"
    for name in ("parameters.json", "verdict.json"):
        write_json('{"a": 1}', results / name)
    (results / "parameters.json").write_text('{"a": ')  # half written
    (results / "datum").mkdir()
    (results / "datum/E01.nc").write_bytes(b"cut")
    (results / "table7.md").write_text("has no seal")
    os.mkfifo(results / "pipe.nc")
    set_damaged_aside()
    left = {str(file.relative_to(results)) for file in results.rglob("*") if not file.is_dir()}
    assert left == {"parameters.json.damaged", "verdict.json", "datum/E01.nc.damaged", "table7.md", "pipe.nc"}
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3 and "parameters.json: does not end with its SHA-256" in "".join(lines)
    assert "results/pipe.nc: not a regular file" in "".join(lines)
    assert (results / "parameters.json.damaged").read_text() == '{"a": '  # nothing is lost
