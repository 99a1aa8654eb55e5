"""`make template`: the repository that it writes judges its paper, and notices a change."""

import subprocess
import sys

import pytest
import yaml
from checkout import ROOT


def written(folder):
    command = [sys.executable, "workflow/template.py", str(folder), "pneumo @ git+ADDRESS"]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True)


@pytest.fixture(scope="module")
def repository(tmp_path_factory):
    folder = tmp_path_factory.mktemp("template") / "my-paper"
    assert written(folder).returncode == 0
    return folder


def judged(folder, *options):
    command = [sys.executable, "judge.py", *options]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


@pytest.mark.slow
def test_its_workflow_judges_the_paper_as_recorded_and_notices_a_change(repository):
    (job,) = yaml.safe_load((repository / ".github/workflows/verdict.yml").read_text())["jobs"].values()
    commands = [step["run"] for step in job["steps"] if "run" in step]
    assert commands == ["pip install -r requirements.txt", "python judge.py"]
    assert all(len(s["uses"].partition("@")[2]) == 40 for s in job["steps"] if "uses" in s)
    assert (repository / "requirements.txt").read_text() == "pneumo @ git+ADDRESS\n"
    first = judged(repository)
    assert first.returncode == 0 and "contradicted  T1.isothermal.mass_left" in first.stdout, first.stderr
    assert "Emptying a chamber" in (repository / "out/verdict.html").read_text(encoding="utf-8")

    table = repository / "paper/published/table1.csv"
    table.write_text(table.read_text().replace("0.17", "0.14"))
    changed = judged(repository)
    assert changed.returncode == 1 and "not as recorded: T1.isothermal.mass_left,exact" in changed.stderr
    assert judged(repository, "--record").returncode == 0 and judged(repository).returncode == 0


def test_a_folder_that_holds_files_is_left_alone(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    refused = written(tmp_path)
    assert refused.returncode == 1 and "must be a new or an empty folder" in refused.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["mine.txt"]
