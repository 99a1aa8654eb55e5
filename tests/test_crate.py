"""A finished study as a Workflow Run RO-Crate."""

import shutil
import sys

import pytest
import yaml
from checkout import ROOT

pytest.importorskip("rocrate")
sys.path.insert(0, str(ROOT / "workflow"))
from crate import PROFILES, crate_of_run
from rocrate.rocrate import ROCrate

MANIFEST = [entry["file"] for entry in yaml.safe_load((ROOT / "codecheck.yml").read_text())["manifest"]]


@pytest.fixture
def checkout(tmp_path):
    for name in ("Snakefile", "codecheck.yml", "config/paper.yaml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    for name in MANIFEST:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(f"content of {name}")
    return tmp_path


def test_it_says_what_ran_on_what_and_what_came_out(checkout):
    crate_of_run(checkout).write_zip(checkout / "crate.zip")
    crate = ROCrate(checkout / "crate.zip")
    assert {entity.id for entity in crate.root_dataset["conformsTo"]} == set(PROFILES)
    assert crate.mainEntity.id == "Snakefile" and "ComputationalWorkflow" in crate.mainEntity.type
    (run,) = crate.root_dataset["mentions"]
    assert run.type == "CreateAction" and run["instrument"] == crate.mainEntity
    assert [entity.id for entity in run["object"]] == ["config/paper.yaml"]
    assert [entity.id for entity in run["result"]] == MANIFEST
    assert run["startTime"] <= run["endTime"]
    crate.write(checkout / "out")
    assert all((checkout / "out" / name).read_text() == f"content of {name}" for name in MANIFEST)


def test_a_study_that_is_not_finished_is_refused(checkout):
    (checkout / "results/verdict.json").unlink()
    with pytest.raises(FileNotFoundError, match=r"verdict\.json"):
        crate_of_run(checkout)
