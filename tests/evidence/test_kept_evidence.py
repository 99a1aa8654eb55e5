"""Files of evidence: those kept with the source, and which count for a configuration."""

import json
from pathlib import Path

import pytest
import xarray as xr
from paper_study import STUDY

from paper.study import kept_evidence
from paper.study.kept_evidence import KEPT, evidence_for, kept_or_made
from pneumo.storage.files import write, write_text
from workflow.jobs.checksums import unlike_sums

OWN = {"config_sha256": STUDY.config_sha256}


def test_kept_files_are_those_of_their_list():
    listed, unlike = unlike_sums(KEPT)
    assert unlike == [] and listed == len([*KEPT.glob("*.nc"), *KEPT.glob("*.json")])


@pytest.fixture
def empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(kept_evidence, "KEPT", tmp_path / "kept")


@pytest.mark.parametrize("name", ["assumptions.nc", "findings.json"])
@pytest.mark.parametrize("damage", [b"", b"{", b"[]", b"{}", b"\xff"])
def test_evidence_counts_for_the_configuration_that_made_it_only(empty_folder, name, damage):
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


def test_kept_evidence_serves_where_results_lack_it_and_of_no_configuration_every_study(
    empty_folder, tmp_path
):
    write(xr.Dataset({"x": 1.0}), tmp_path / "kept/floor.nc", OWN)
    another = STUDY._replace(config_sha256="another")
    assert kept_or_made("results", STUDY, "floor.nc") == "kept/floor.nc"
    assert kept_or_made("results-another", another, "floor.nc") == "results-another/floor.nc"
    write(xr.Dataset({"x": 2.0}), tmp_path / "results/floor.nc", OWN)
    assert kept_or_made("results", STUDY, "floor.nc") == "results/floor.nc"
    write(xr.Dataset({"x": 1.0}), tmp_path / "kept/cylinders.nc", {"config_sha256": "none: drawn"})
    assert kept_or_made("results", STUDY, "cylinders.nc") == "kept/cylinders.nc"


@pytest.mark.parametrize("name", ["floor.nc", "findings.json"])
def test_evidence_says_when_and_from_what_it_was_made(empty_folder, tmp_path, name):
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
