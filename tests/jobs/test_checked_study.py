"""The Snakefile's configuration: checked, or refused in one line that names the source."""

from pathlib import Path

import pytest

from pneumo.configuration.parameters import read_yaml
from pneumo.jobs.checked_study import checked_study

ROOT = Path(__file__).parents[2]


@pytest.fixture
def paper(monkeypatch):
    monkeypatch.chdir(ROOT)
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
