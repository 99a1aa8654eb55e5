"""One run in a folder at a time, and files from the future."""

import errno
import os
import tempfile
import time
from pathlib import Path

import pytest

from pneumo.jobs.run_lock import RUN, RUN_LOCK, STATE, check_run_folder, set_damaged_aside, take_run_lock
from pneumo.storage.files import write_json


def refusal(capsys):
    with pytest.raises(SystemExit) as end:
        take_run_lock("results")
    assert end.value.code == 2
    return capsys.readouterr().err


def test_a_second_run_and_results_that_cannot_be_written_are_refused(run_folder, monkeypatch, capsys):
    monkeypatch.setenv(RUN, "")  # so that what is set here does not outlast this test
    take_run_lock("results")
    assert os.environ[RUN] == RUN_LOCK.read_text() != ""
    assert refusal(capsys).startswith("pneumo: another run is active in this folder")
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # whom root may always write
    assert "results: cannot be written" in refusal(capsys)


def test_the_lock_of_another_user_is_refused_in_clear_words(run_folder, capsys):
    RUN_LOCK.unlink()
    RUN_LOCK.mkdir()  # as little to be opened, for root too
    assert "pneumo.run: cannot be written; each user needs a checkout of their own" in refusal(capsys)


def folder_refusal(checkout, capsys):
    with pytest.raises(SystemExit) as end:
        check_run_folder(checkout)
    line = capsys.readouterr().err
    assert end.value.code == 2 and line.startswith("pneumo: ") and len(line.splitlines()) == 1
    return line


def test_a_run_needs_its_checkout_and_a_state_that_can_be_written(run_folder, monkeypatch, capsys):
    (STATE / "log").mkdir()
    before = set(STATE.iterdir())
    check_run_folder(run_folder)
    assert set(STATE.iterdir()) == before
    assert "the study runs in its checkout only" in folder_refusal(run_folder.parent, capsys)
    with monkeypatch.context() as another:
        another.setattr(
            os, "access", lambda path, mode: Path(path).name != "log"
        )  # whom root may always write
        assert ".snakemake/log: Permission denied; each user needs" in folder_refusal(run_folder, capsys)
    for number, words in ((errno.ENOSPC, "No space left on device"), (errno.EROFS, "Read-only file system")):
        error = OSError(number, os.strerror(number), ".snakemake/tmp123")

        def failing(*_arguments, error=error, **_options):
            raise error

        monkeypatch.setattr(tempfile, "_mkstemp_inner", failing)
        assert f".snakemake: {words}; each user needs" in folder_refusal(run_folder, capsys)


@pytest.mark.parametrize("shift", [-1000, 1000])
def test_a_file_from_the_future_is_named_and_not_changed(run_folder, monkeypatch, capsys, shift):
    monkeypatch.setenv(RUN, "")
    file, date = run_folder / "results" / "E01.nc", time.time() + shift
    file.parent.mkdir()
    file.touch()
    os.utime(file, (date, date))
    take_run_lock("results")
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
    set_damaged_aside("results")
    left = {str(file.relative_to(results)) for file in results.rglob("*") if not file.is_dir()}
    assert left == {"parameters.json.damaged", "verdict.json", "datum/E01.nc.damaged", "table7.md", "pipe.nc"}
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3 and "parameters.json: does not end with its SHA-256" in "".join(lines)
    assert "results/pipe.nc: not a regular file" in "".join(lines)
    assert (results / "parameters.json.damaged").read_text() == '{"a": '  # nothing is lost
