"""What stands around the work of a job, and around the Snakefile: logs, exit codes, and sources of errors."""

import re
from pathlib import Path
from types import SimpleNamespace

import pytest

from pneumo.job import logged
from pneumo.store import ResultError
from pneumo.workflow import checked_study

ROOT = Path(__file__).parents[1]


@pytest.fixture
def job(tmp_path):
    return SimpleNamespace(log=[str(tmp_path / "job.log")], rule="rule")


def log_of(job):
    return Path(job.log[0]).read_text(encoding="utf-8")


def test_a_job_says_how_long_it_took(job):
    with logged(job):
        pass
    assert re.fullmatch(r"rule: 0\.0\d s\n", log_of(job))


@pytest.mark.parametrize("error", [ResultError("E01.nc: broken"), ArithmeticError("not settled")])
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


@pytest.fixture
def paper(monkeypatch):
    monkeypatch.chdir(ROOT)
    from pneumo.physics.parameters import read_yaml

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
