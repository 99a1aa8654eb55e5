"""What makes Snakemake run a rule again: edits of what it uses, evidence of its configuration."""

import json
import re
from pathlib import Path

import grimp
import pytest
import xarray as xr
from checkout import ROOT
from paper_study import STUDY
from workflow_scripts import SCRIPTS

from pneumo.jobs.rerun_triggers import ASSESSMENT, SIMULATION, evidence_for, kept_or_made, sha256_of
from pneumo.storage import kept_evidence
from pneumo.storage.files import write, write_text

OWN = {"config_sha256": STUDY.config_sha256}
RULE = re.compile(r"code=sha256_of\(([^)]*)\).*?scripts/(\w+\.py)", re.DOTALL)
IMPORTED = re.compile(r"^from ((?:pneumo|paper)\.[\w.]+) import", re.MULTILINE)
WITHOUT_NUMBERS = ("pneumo/errors", "pneumo/regular_file", "pneumo/jobs")


def test_every_rule_names_the_folders_of_all_that_its_script_imports():
    graph = grimp.build_graph("pneumo", "paper", cache_dir=None)
    text = "".join(file.read_text() for file in sorted((ROOT / "workflow/rules").glob("*.smk")))
    rules = RULE.findall(text)
    assert {script for _, script in rules} == {file.name for file in SCRIPTS.glob("*.py")} - {"schemes.py"}
    for named, script in rules:
        folders = re.findall(r'"([^"]+)"', named)
        folders += ASSESSMENT if "ASSESSMENT" in named else SIMULATION if "SIMULATION" in named else ()
        imported = IMPORTED.findall((SCRIPTS / script).read_text())
        behind = {*imported}.union(*map(graph.find_upstream_modules, imported))
        covered = tuple(f"{folder.removesuffix('.py')}/" for folder in (*folders, *WITHOUT_NUMBERS))
        paths = {module.replace(".", "/") + "/" for module in behind - {"paper.study"}}
        assert not {path for path in paths if not path.startswith(covered)}, script


def test_an_edit_of_a_source_changes_its_hash_and_a_compiled_file_does_not(tmp_path):
    def made():
        sha256_of.cache_clear()
        return sha256_of("room", "file.csv")

    (tmp_path / "room/deep").mkdir(parents=True)
    for name in ("file.csv", "room/a.py", "room/deep/b.c"):
        (tmp_path / name).write_text("1")
    seen = {made()}
    for name in ("file.csv", "room/a.py", "room/deep/b.c", "room/new.py"):
        (tmp_path / name).write_text("2")
        seen.add(made())
    (tmp_path / "room/a.pyc").write_text("compiled")
    assert made() in seen and len(seen) == 5


@pytest.fixture(autouse=True)
def empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(kept_evidence, "KEPT", tmp_path / "kept")


@pytest.mark.parametrize("name", ["assumptions.nc", "findings.json"])
@pytest.mark.parametrize("damage", [b"", b"{", b"[]", b"{}", b"\xff"])
def test_evidence_counts_for_the_configuration_that_made_it_only(name, damage):
    file = Path("results") / name
    assert evidence_for("results", STUDY, name) == []
    if name.endswith(".nc"):
        write(xr.Dataset({"x": 1.0}), file, OWN)
    else:
        write_text(json.dumps(OWN), file)
    assert evidence_for("results", STUDY, name) == [str(file)]
    assert evidence_for("results", STUDY._replace(config_sha256="another"), name) == []
    file.write_bytes(damage)
    assert evidence_for("results", STUDY, name) == [str(file)]  # so that the job which reads it refuses it


def test_kept_evidence_serves_where_results_lack_it_and_that_of_no_configuration_every_study(tmp_path):
    write(xr.Dataset({"x": 1.0}), tmp_path / "kept/floor.nc", OWN)
    another = STUDY._replace(config_sha256="another")
    assert kept_or_made("results", STUDY, "floor.nc") == "kept/floor.nc"
    assert kept_or_made("results-another", another, "floor.nc") == "results-another/floor.nc"
    write(xr.Dataset({"x": 2.0}), tmp_path / "results/floor.nc", OWN)
    assert kept_or_made("results", STUDY, "floor.nc") == "results/floor.nc"
    write(xr.Dataset({"x": 1.0}), tmp_path / "kept/cylinders.nc", {"config_sha256": "none: drawn"})
    assert kept_or_made("results", STUDY, "cylinders.nc") == "kept/cylinders.nc"


@pytest.mark.parametrize("name", ["floor.nc", "findings.json"])
def test_evidence_says_when_and_from_what_it_was_made(tmp_path, name):
    def told(about):
        if name.endswith(".nc"):
            write(xr.Dataset({"x": 1.0}), tmp_path / name, about)
        else:
            write_text(json.dumps(about), tmp_path / name)
        return kept_evidence.made(tmp_path / name)

    configuration = f"from the configuration {STUDY.config_sha256[:8]}"
    assert told(OWN) == f"{name}: made in this folder {configuration}"
    kept = OWN | {"date_created": "2026-11-22"}
    assert told(kept) == f"{name}: made on 2026-11-22 {configuration}"
    assert told(kept | {"config_sha256": "none: drawn"}) == f"{name}: made on 2026-11-22"
