"""Files that hosts, catalogs and archives read: well formed, of one mind, and naming only what there is."""

import json
import re
import tomllib

import pytest
import yaml
from checkout import ROOT, sources

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
JOBS = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())["jobs"]
PAGES = yaml.safe_load((ROOT / ".github/workflows/pages.yml").read_text())["jobs"]
FORMS = sorted((ROOT / ".github/ISSUE_TEMPLATE").glob("*.yml"))


def loaded(name):
    text = (ROOT / name).read_text(encoding="utf-8")
    return json.loads(text) if name.endswith(".json") else yaml.safe_load(text)


@pytest.mark.parametrize("job", JOBS)
def test_each_job_calls_one_make_target_that_exists(job):
    (command,) = [step["run"] for step in JOBS[job]["steps"] if "run" in step]
    target = re.fullmatch(r"make ([a-z-]+) PYTHON=python", command)
    assert target and re.search(rf"^{target[1]}:", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert set(JOBS[job].get("needs", "").split()) <= set(JOBS)


def test_the_pages_are_made_by_targets_that_exist():
    (command,) = (step["run"] for step in PAGES["build"]["steps"] if step.get("run", "").startswith("make"))
    targets = command.removeprefix("make ").removesuffix(" PYTHON=python").split()
    assert targets == ["reproduce", "docs"]
    assert all(re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE) for target in targets)


def test_hooks_before_a_commit_are_commands_of_lint():
    (repository,) = loaded(".pre-commit-config.yaml")["repos"]
    lint = (ROOT / "Makefile").read_text().partition("\nlint:")[2]
    for hook in repository["hooks"]:
        program = hook["entry"].removeprefix(".venv/bin/").partition(" --")[0]
        assert re.search(rf"^\t{program}\b", lint, re.MULTILINE), hook["id"]


def test_the_article_cites_what_the_bibliography_holds():
    article = ROOT / "paper/joss/paper.md"
    _, head, text = article.read_text(encoding="utf-8").split("---\n", 2)
    held = re.findall(
        r"^@\w+\{(\w+),", (article.parent / yaml.safe_load(head)["bibliography"]).read_text(), re.MULTILINE
    )
    assert set(re.findall(r"\[@(\w+)\]", text)) <= set(held)
    assert {"# Statement of need", "# State of the field"} <= set(text.splitlines())


def test_version_licence_and_paper_are_the_same_everywhere():
    citation, codemeta, zenodo = map(loaded, ("CITATION.cff", "codemeta.json", ".zenodo.json"))
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    released = re.search(r"^## (\S+) - (\S+)$", changelog, re.MULTILINE)
    assert {d["version"] for d in (PROJECT, citation, codemeta, zenodo)} == {released[1]}
    assert {citation["date-released"], codemeta["datePublished"]} == {released[2]}
    licences = {PROJECT["license"], citation["license"], zenodo["license"]}
    assert licences | {codemeta["license"].split("/")[-1]} == {"MIT"}
    doi, check = citation["references"][0]["doi"], loaded("codecheck.yml")
    assert doi == zenodo["related_identifiers"][0]["identifier"]
    for address in (codemeta["referencePublication"]["identifier"], check["paper"]["reference"]):
        assert address == f"https://doi.org/{doi}"
    assert check["paper"]["title"] == citation["references"][0]["title"]


@pytest.mark.results
@pytest.mark.parametrize("entry", loaded("codecheck.yml")["manifest"], ids=lambda entry: entry["file"])
def test_the_manifest_names_results(entry):
    assert (ROOT / entry["file"]).is_file() and entry["comment"]


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.stem)
def test_forms_of_issues_ask_for_something(form):
    content = yaml.safe_load(form.read_text())
    if form.stem != "config":
        assert content["name"] and content["description"]
        assert any(field.get("validations", {}).get("required") for field in content["body"])


def test_the_catalog_finds_what_it_looks_for_and_no_file_names_an_index_or_a_machine():
    assert loaded(".snakemake-workflow-catalog.yml")["usage"]["report"] is True
    assert 'include: "../Snakefile"' in (ROOT / "workflow/Snakefile").read_text()
    pattern = re.compile(rb"index-url|files\.pythonhosted|/(home|root|Users)/[a-z]")
    names = [name for name in sources() if not name.endswith((".png", ".js", ".py"))]
    leaks = {n: m.group() for n in names if (m := pattern.search((ROOT / n).read_bytes()))}
    assert leaks == {"Makefile": b"index-url"}  # of --no-emit-index-url
