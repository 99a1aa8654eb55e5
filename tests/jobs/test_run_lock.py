"""One run in a folder at a time, in a folder that can be written."""

import errno
import os
import tempfile
import threading
from pathlib import Path

import pytest

from workflow.jobs.run_lock import RUN_LOCK, STATE, check_run_folder, job_lock, take_run_lock


def refusal(capsys, check, *arguments):
    with pytest.raises(SystemExit) as end:
        check(*arguments)
    line = capsys.readouterr().err
    assert end.value.code == 2 and line.startswith("pneumo: ") and len(line.splitlines()) == 1
    return line


def test_a_second_run_and_results_that_cannot_be_written_are_refused(run_folder, monkeypatch, capsys):
    RUN_LOCK.mkdir()  # as little to be opened as that of another user, for root too
    assert "pneumo.run: Is a directory; each user needs a checkout" in refusal(
        capsys, take_run_lock, "results"
    )
    RUN_LOCK.rmdir()
    take_run_lock("results")
    assert "another run is active in this folder" in refusal(capsys, take_run_lock, "results")
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # whom root may always write
    assert "results: Permission denied; each user" in refusal(capsys, take_run_lock, "results")


def test_a_run_waits_for_the_jobs_of_a_killed_one(run_folder, capsys):
    run = threading.Thread(target=take_run_lock, args=("results",))
    with job_lock(), job_lock():  # jobs run side by side
        run.start()
        run.join(0.2)
        assert run.is_alive()
    run.join(10)
    assert not run.is_alive() and "waiting for a job of a killed run" in capsys.readouterr().err


def test_a_run_needs_its_checkout_and_a_state_that_can_be_written(run_folder, monkeypatch, capsys):
    (STATE / "log").mkdir()
    before = set(STATE.iterdir())
    check_run_folder(run_folder)
    assert set(STATE.iterdir()) == before
    parent = run_folder.parent
    assert "the study runs in its checkout only" in refusal(capsys, check_run_folder, parent)
    with monkeypatch.context() as another:
        another.setattr(os, "access", lambda path, mode: Path(path).name != "log")
        line = refusal(capsys, check_run_folder, run_folder)
    assert ".snakemake/log: Permission denied; each user needs" in line
    for number, words in ((errno.ENOSPC, "No space left on device"), (errno.EROFS, "Read-only file system")):
        error = OSError(number, os.strerror(number), ".snakemake/tmp123")

        def failing(*_arguments, error=error, **_options):
            raise error

        monkeypatch.setattr(tempfile, "_mkstemp_inner", failing)
        line = refusal(capsys, check_run_folder, run_folder)
        assert f".snakemake: {words}; each user needs" in line
