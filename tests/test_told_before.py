"""A decision with a criterion is committed alone, before the run that its outcome names: decision 69."""

import re
import subprocess
from pathlib import Path

import pytest
from checkout import ROOT, edit

FOLDER = "paper/decisions"
FIRST = 62  # the rule is later; 62 obeys it
CRITERION = re.compile(r"\*\*Criterion|before any run")
OUTCOME = re.compile(r"\*\*Outcome")
RUN = re.compile(r"\brun at ([0-9a-f]{7,40})\b")


def git(checkout: Path, *arguments: str) -> str:
    """Output of a git command; CalledProcessError if it fails."""
    done = subprocess.run(("git", *arguments), cwd=checkout, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def fault(checkout: Path, file: str) -> str:
    """Way in which a decision breaks the order criterion, run, outcome; empty if it keeps it."""
    text = (checkout / file).read_text(encoding="utf-8")
    if not CRITERION.search(text) or not OUTCOME.search(text):
        return ""
    run = RUN.search(text)
    if run is None:
        return "the outcome names no commit as 'run at ...'"
    added = git(checkout, "log", "--follow", "--diff-filter=A", "--format=%H", "--", file).split()
    if not added:
        return "not committed"
    criterion = added[-1]
    beside = git(checkout, "show", "--name-only", "--format=", criterion).split()
    if not all(name.startswith(FOLDER) for name in beside):
        return f"{criterion[:7]} has more than decisions"
    try:
        commit = git(checkout, "rev-parse", "--verify", f"{run[1]}^{{commit}}")
        git(checkout, "merge-base", "--is-ancestor", commit, "HEAD")
    except subprocess.CalledProcessError:
        return f"{run[1]}: not a commit of this history"
    before = git(checkout, "rev-list", commit).split()
    return "" if criterion in before[1:] else f"{criterion[:7]} does not come before the run at {run[1]}"


def test_criteria_were_committed_before_their_first_run():
    if not (ROOT / ".git").exists() or git(ROOT, "rev-parse", "--is-shallow-repository") == "true":
        pytest.skip("no history")
    files = [
        f"{FOLDER}/{file.name}" for file in (ROOT / FOLDER).glob("[0-9]*.md") if int(file.name[:4]) >= FIRST
    ]
    told = [file for file in files if CRITERION.search((ROOT / file).read_text(encoding="utf-8"))]
    assert f"{FOLDER}/0062-open-loop-by-one-likelihood.md" in told
    assert {file: fault(ROOT, file) for file in told if fault(ROOT, file)} == {}


@pytest.fixture
def checkout(tmp_path):
    """A repository with a criterion, committed alone, the code of its run, and a function that commits."""
    names = ("-c", "user.name=A", "-c", "user.email=a@b.c", "-c", "commit.gpgsign=false")

    def commit(**files: str) -> str:
        for name, text in files.items():
            path = tmp_path / (f"{FOLDER}/0070-rule.md" if name == "rule" else "run.py")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        git(tmp_path, "add", "-A")
        git(tmp_path, *names, "commit", "-q", "--allow-empty", "-m", "x")
        return git(tmp_path, "rev-parse", "HEAD")

    git(tmp_path, "init", "-q")
    return tmp_path, commit


TOLD = "# 70. A rule, before any run\n"


def test_a_criterion_before_its_run_and_one_after_it(checkout):
    folder, commit = checkout
    file = f"{FOLDER}/0070-rule.md"
    start = commit(code="start")
    told = commit(rule=TOLD)
    assert fault(folder, file) == ""  # no outcome yet
    run = commit(code="run")
    commit(rule=f"{TOLD}**Outcome** (run at {run[:10]}): yes\n")
    assert fault(folder, file) == ""
    for other, words in (
        (start, "does not come before"),
        (told, "does not come before"),
        ("f" * 40, "not a commit"),
    ):
        was = edit(folder / file, run[:10], other)
        assert words in fault(folder, file)
        (folder / file).write_text(was, encoding="utf-8")
    edit(folder / file, "run at", "run with")
    assert "names no commit" in fault(folder, file)


def test_a_criterion_that_came_with_its_code(checkout):
    folder, commit = checkout
    commit(rule=TOLD, code="run")
    run = commit(code="again")
    commit(rule=f"{TOLD}**Outcome** (run at {run}): yes\n")
    assert "more than decisions" in fault(folder, f"{FOLDER}/0070-rule.md")
