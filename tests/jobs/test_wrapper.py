"""What stands around the work of a job, and around the Snakefile: logs, exit codes, and sources of errors."""

import errno
import json
import os
import re
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
import xarray as xr

from pneumo.configuration.parameters import load, study
from pneumo.errors import DamagedError, ResultError, RunError
from pneumo.jobs.snakefile import checked_study, evidence_for, fingerprints, sole_run
from pneumo.jobs.wrapper import RUN, RUN_LOCK, logged
from pneumo.storage.files import write, write_json

ROOT = Path(__file__).parents[2]


@pytest.fixture
def run_folder(tmp_path, monkeypatch):
    """Where runs have been, and none of them started this process."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(RUN, raising=False)
    (tmp_path / RUN_LOCK).parent.mkdir()
    (tmp_path / RUN_LOCK).touch()
    return tmp_path


@pytest.fixture
def job(run_folder, tmp_path):
    return SimpleNamespace(log=[str(tmp_path / "job.log")], rule="rule")


def log_of(job):
    return Path(job.log[0]).read_text(encoding="utf-8")


def test_a_job_says_how_long_it_took(job):
    with logged(job):
        pass
    assert re.fullmatch(r"rule: 0\.0\d s\n", log_of(job))


@pytest.mark.parametrize(
    "error",
    [
        ResultError("E01.nc: broken"),
        RunError("not settled"),
        OSError(errno.ENOSPC, "no space left on device"),
    ],
)
def test_an_error_to_mend_is_one_line_and_exit_2(job, error, capsys):
    with pytest.raises(SystemExit) as end, logged(job):
        raise error
    assert end.value.code == 2
    assert capsys.readouterr().err == f"pneumo: {error}\n"
    assert log_of(job) == f"{error}\n"


def test_any_other_error_is_in_the_log(job):
    with pytest.raises(ZeroDivisionError), logged(job):
        _ = 1 / 0
    assert "Traceback" in log_of(job)


def test_a_damaged_file_is_removed(job, run_folder, capsys):
    (run_folder / "E01.nc").write_text("spoilt")
    with pytest.raises(SystemExit), logged(job):
        raise DamagedError(Path("E01.nc"), "damaged")
    assert not (run_folder / "E01.nc").exists()
    assert "E01.nc: damaged; removed, the next run makes it again" in capsys.readouterr().err


def test_a_job_of_a_killed_run_ends_when_another_has_begun(job, run_folder, monkeypatch):
    RUN_LOCK.write_text("another")
    monkeypatch.setenv(RUN, "killed")
    with pytest.raises(SystemExit, match="was killed, and another has begun"), logged(job):
        pytest.fail("it went to work")
    monkeypatch.setenv(RUN, "another")
    with logged(job):
        pass
    assert "rule: " in log_of(job)


# A folder to itself


def test_the_second_of_two_runs_is_refused(run_folder, monkeypatch, capsys):
    monkeypatch.setenv(RUN, "")  # so that what is set here does not outlast this test
    sole_run()
    assert os.environ[RUN] == RUN_LOCK.read_text() != ""
    with pytest.raises(SystemExit) as end:
        sole_run()
    assert end.value.code == 2
    assert capsys.readouterr().err.startswith("pneumo: another run is at work in this folder")


def test_results_that_cannot_be_written_are_refused(run_folder, monkeypatch, capsys):
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # whom root may always write
    with pytest.raises(SystemExit) as end:
        sole_run()
    assert end.value.code == 2
    assert "results: cannot be written" in capsys.readouterr().err


def test_files_from_the_future_are_dated_back_in_their_order(run_folder, monkeypatch):
    monkeypatch.setenv(RUN, "")
    dates = {"old": -1000, "first": 1000, "second": 2000, "with_second": 2000, "third": 3000}  # s from now
    now = time.time()
    (run_folder / "results").mkdir()
    for name, shift in dates.items():
        (run_folder / "results" / name).touch()
        os.utime(run_folder / "results" / name, (now + shift, now + shift))
    sole_run()
    after = {name: (run_folder / "results" / name).stat().st_mtime_ns for name in dates}
    assert after["old"] == pytest.approx((now - 1000) * 1e9, abs=1e3)
    assert after["first"] < after["second"] == after["with_second"] < after["third"] <= time.time_ns()
    assert after["first"] > (now - 1) * 1e9


# A configuration


@pytest.fixture
def paper(monkeypatch):
    monkeypatch.chdir(ROOT)
    from pneumo.configuration.parameters import read_yaml

    return read_yaml(Path("config/paper.yaml"))


def test_a_checked_study(paper):
    assert checked_study(paper, [], {}).name == "paper"


def test_a_bad_option_is_named(paper, capsys):
    with pytest.raises(SystemExit) as end:
        checked_study(paper | {"step_s": -1}, [], {"step_s": -1})
    assert end.value.code == 2
    assert capsys.readouterr().err.startswith("pneumo: --config: step_s = -1: must be")


def test_a_bad_value_of_the_papers_file_is_named(paper, capsys):
    with pytest.raises(SystemExit):
        checked_study(paper | {"step_s": -1}, [], {})
    assert capsys.readouterr().err.startswith("pneumo: config/paper.yaml: step_s = -1: must be")


def test_evidence_counts_for_the_configuration_that_made_it_only(tmp_path):
    paper = study(load(ROOT / "config/paper.yaml"))
    file = tmp_path / "assumptions.nc"
    assert evidence_for(paper, str(file)) == []
    write(xr.Dataset({"x": 1.0}), file, {"config_sha256": paper.config_sha256})
    assert evidence_for(paper, str(file)) == [str(file)]
    assert evidence_for(paper._replace(config_sha256="another"), str(file)) == []
    file.write_bytes(b"damaged")
    assert evidence_for(paper, str(file)) == [str(file)]  # so that the job which reads it refuses it


@pytest.mark.parametrize("damage", [b"", b"{", b"[]", b"{}", b"\xff"])
def test_evidence_in_json_too(tmp_path, damage):
    paper = study(load(ROOT / "config/paper.yaml"))
    file = tmp_path / "findings.json"
    assert evidence_for(paper, str(file)) == []
    write_json(json.dumps({"config_sha256": paper.config_sha256}), file)
    assert evidence_for(paper, str(file)) == [str(file)]
    assert evidence_for(paper._replace(config_sha256="another"), str(file)) == []
    before = fingerprints([str(file)])
    file.write_bytes(damage)
    assert evidence_for(paper, str(file)) == [str(file)]
    assert list(before) == [str(file)] and fingerprints([str(file)]) != before
