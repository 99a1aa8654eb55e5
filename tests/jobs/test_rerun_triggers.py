"""Evidence found in results: only what this configuration made counts."""

import json
from pathlib import Path

import pytest
import xarray as xr

from pneumo.configuration.parameters import load, study
from pneumo.jobs.rerun_triggers import evidence_for, fingerprints
from pneumo.storage.files import write, write_json

ROOT = Path(__file__).parents[2]


def test_evidence_counts_for_the_configuration_that_made_it_only(tmp_path):
    paper = study(load(ROOT / "config/paper.yaml"))
    file = tmp_path / "assumptions.nc"
    assert evidence_for(paper, str(file)) == []
    write(xr.Dataset({"x": 1.0}), file, {"config_sha256": paper.config_sha256})
    assert evidence_for(paper, str(file)) == [str(file)]
    assert evidence_for(paper._replace(config_sha256="another"), str(file)) == []
    file.write_bytes(b"damaged")
    assert evidence_for(paper, str(file)) == [str(file)]  # so that the job which reads it refuses it


@pytest.mark.parametrize("damage", [b"", b"{", b"[]", b"{}", b"\xff"])
def test_evidence_in_json_too(tmp_path, damage):
    paper = study(load(ROOT / "config/paper.yaml"))
    file = tmp_path / "findings.json"
    assert evidence_for(paper, str(file)) == []
    write_json(json.dumps({"config_sha256": paper.config_sha256}), file)
    assert evidence_for(paper, str(file)) == [str(file)]
    assert evidence_for(paper._replace(config_sha256="another"), str(file)) == []
    before = fingerprints([str(file)])
    file.write_bytes(damage)
    assert evidence_for(paper, str(file)) == [str(file)]
    assert list(before) == [str(file)] and fingerprints([str(file)]) != before
