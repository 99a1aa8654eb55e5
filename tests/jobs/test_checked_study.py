"""The Snakefile's configuration: checked, or refused in one line that names the source."""

from pathlib import Path

import pytest
from checkout import ROOT

from pneumo.configuration.parameters import read_yaml
from workflow.jobs.checked_study import as_written, checked_study, results_folder


@pytest.mark.parametrize(
    ("files", "options", "folder"),
    [
        ([], {}, "results"),
        (["config/paper.yaml"], {}, "results"),
        (["config/smoke.yaml"], {}, "results-smoke"),
        (["one/my.yaml", "more.yaml"], {"step_s": 0.002}, "results-my-more"),
        (["a {b} ü<.yaml"], {}, "results-a__b__ü_"),
        ([], {"step_s": 0.002}, "results-config"),
    ],
)
def test_only_the_papers_study_fills_the_folder_results(monkeypatch, files, options, folder):
    monkeypatch.chdir(ROOT)
    assert results_folder([Path(file) for file in files], options) == folder


@pytest.mark.parametrize(("options", "source"), [({"step_s": -1}, "--config"), ({}, "config/paper.yaml")])
def test_a_bad_value_is_refused_with_its_source(monkeypatch, capsys, options, source):
    monkeypatch.chdir(ROOT)
    paper = read_yaml(Path("config/paper.yaml"))
    assert checked_study(paper, [], {}).name == "paper"
    with pytest.raises(SystemExit) as end:
        checked_study(paper | {"step_s": -1}, [], options)
    assert end.value.code == 2
    assert capsys.readouterr().err.startswith(f"pneumo: {source}: step_s = -1: must be")


def test_files_are_read_by_the_rules_of_pneumo_and_not_of_yaml_1_1(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(ROOT)
    (tmp_path / "mine.yaml").write_text("step_s: 1:30\nrun: {seeds: 010}\n")
    content = as_written([tmp_path / "mine.yaml"], {"name": "other"})
    assert content["step_s"] == "1:30" and content["run"]["seeds"] == 10 and content["name"] == "other"
    assert content["gas"] == read_yaml(Path("config/paper.yaml"))["gas"]
    with pytest.raises(SystemExit):
        as_written([tmp_path / "none.yaml"], {})
    assert "none.yaml: cannot be read" in capsys.readouterr().err
