"""The Snakefile's configuration: checked, or refused in one line that names the source."""

from pathlib import Path

import pytest
from checkout import ROOT

from pneumo.configuration.parameters import read_yaml
from pneumo.jobs.checked_study import checked_study


@pytest.mark.parametrize(("options", "source"), [({"step_s": -1}, "--config"), ({}, "config/paper.yaml")])
def test_a_bad_value_is_refused_with_its_source(monkeypatch, capsys, options, source):
    monkeypatch.chdir(ROOT)
    paper = read_yaml(Path("config/paper.yaml"))
    assert checked_study(paper, [], {}).name == "paper"
    with pytest.raises(SystemExit) as end:
        checked_study(paper | {"step_s": -1}, [], options)
    assert end.value.code == 2
    assert capsys.readouterr().err.startswith(f"pneumo: {source}: step_s = -1: must be")
