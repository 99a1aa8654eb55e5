"""A finished study as a Workflow Run RO-Crate."""

import shutil
import sys
from hashlib import sha256
from pathlib import Path

import pytest
import xarray as xr
import yaml
from checkout import ROOT

pytest.importorskip("rocrate")
sys.path.insert(0, str(ROOT / "workflow"))
from crate import HASHES, PROFILES, crate_of_run
from rocrate.rocrate import ROCrate

from pneumo.errors import DamagedError
from pneumo.storage.files import write, write_json
from pneumo.storage.seal import hashes_without_seal

MANIFEST = [entry["file"] for entry in yaml.safe_load((ROOT / "codecheck.yml").read_text())["manifest"]]


@pytest.fixture
def checkout(tmp_path):
    for name in ("Snakefile", "codecheck.yml", "config/paper.yaml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    for name in MANIFEST:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        if name.endswith(".nc"):
            write(xr.Dataset({"a": 1.0}), tmp_path / name, {"title": name})
        elif name.endswith(".json"):
            write_json(f'{{\n "name": "{name}"\n}}\n', tmp_path / name)
        else:
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
    for name in MANIFEST:
        assert (checkout / "out" / name).read_bytes() == (checkout / name).read_bytes()


def test_it_has_the_hashes_of_all_results_also_of_those_that_it_does_not_hold(checkout, monkeypatch):
    monkeypatch.chdir(checkout)
    write(xr.Dataset({"a": 2.0}), "results/datum/E01.nc", {"title": "not in the crate"})
    page = Path("results/report.html")
    page.write_text("a page")
    Path("results/logs").mkdir()
    Path("results/logs/report.log").write_text(f"report: 0.10 s\n{hashes_without_seal([page])}")
    crate_of_run(checkout).write(checkout / "out")
    lines = (checkout / "out" / HASHES).read_text().splitlines()
    names = [*MANIFEST, "results/datum/E01.nc", str(page)]
    assert lines == [f"{sha256(Path(name).read_bytes()).hexdigest()}  {name}" for name in sorted(names)]
    for file in (page, Path("results/datum/E01.nc"), Path("results/verdict.json")):
        good = file.read_bytes()
        file.write_bytes(good.replace(b"a", b"b", 1))
        with pytest.raises(DamagedError, match=file.name):
            crate_of_run(checkout)
        file.write_bytes(good)


def test_a_study_that_is_not_finished_is_refused(checkout):
    (checkout / "results/verdict.json").unlink()
    with pytest.raises(FileNotFoundError, match=r"verdict\.json"):
        crate_of_run(checkout)
