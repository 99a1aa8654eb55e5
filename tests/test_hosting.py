"""Files that hosts, catalogs and archives read: well formed, of one mind, and naming only what there is."""

import json
import re
import tomllib

import pytest
import yaml
from checkout import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
JOBS = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())["jobs"]


def loaded(name):
    text = (ROOT / name).read_text(encoding="utf-8")
    return json.loads(text) if name.endswith(".json") else yaml.safe_load(text)


@pytest.mark.parametrize("job", sorted({*JOBS} - {"platforms"}))  # its commands are an engineer's
def test_each_job_calls_one_make_target_that_exists(job):
    (command,) = [step["run"] for step in JOBS[job]["steps"] if "run" in step]
    target = re.fullmatch(r"make ([a-z-]+) PYTHON=python", command)
    assert target and re.search(rf"^{target[1]}:", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert set(JOBS[job].get("needs", "").split()) <= set(JOBS)


def test_version_description_licence_and_paper_are_the_same_everywhere():
    citation, codemeta, zenodo = map(loaded, ("CITATION.cff", "codemeta.json", ".zenodo.json"))
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    released = re.search(r"^## (\S+) - (\S+)$", changelog, re.MULTILINE)
    assert {d["version"] for d in (PROJECT, citation, codemeta, zenodo)} == {released[1]}
    assert {citation["date-released"], codemeta["datePublished"]} == {released[2]}
    descriptions = {d["description"] for d in (PROJECT, codemeta, zenodo)} | {citation["abstract"].strip()}
    assert len(descriptions) == 1
    assert PROJECT["keywords"] == citation["keywords"] == codemeta["keywords"] == zenodo["keywords"]
    licences = {PROJECT["license"], citation["license"], zenodo["license"]}
    assert licences | {codemeta["license"].split("/")[-1]} == {"MIT"}
    doi, check = citation["references"][0]["doi"], loaded("codecheck.yml")
    assert doi == zenodo["related_identifiers"][0]["identifier"]
    for address in (codemeta["referencePublication"]["identifier"], check["paper"]["reference"]):
        assert address == f"https://doi.org/{doi}"
    assert check["paper"]["title"] == citation["references"][0]["title"]
