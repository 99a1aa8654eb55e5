"""Evidence found in results: only what this configuration made counts."""

import json

import pytest
import xarray as xr
from paper_study import STUDY

from pneumo.jobs.rerun_triggers import evidence_for, fingerprints
from pneumo.storage.files import write, write_json

OWN = {"config_sha256": STUDY.config_sha256}


@pytest.mark.parametrize("name", ["assumptions.nc", "findings.json"])
@pytest.mark.parametrize("damage", [b"", b"{", b"[]", b"{}", b"\xff"])
def test_evidence_counts_for_the_configuration_that_made_it_only(tmp_path, name, damage):
    file = tmp_path / name
    assert evidence_for(STUDY, str(file)) == []
    if name.endswith(".nc"):
        write(xr.Dataset({"x": 1.0}), file, OWN)
    else:
        write_json(json.dumps(OWN), file)
    assert evidence_for(STUDY, str(file)) == [str(file)]
    assert evidence_for(STUDY._replace(config_sha256="another"), str(file)) == []
    before = fingerprints([str(file)])
    file.write_bytes(damage)
    assert evidence_for(STUDY, str(file)) == [str(file)]  # so that the job which reads it refuses it
    assert list(before) == [str(file)] and fingerprints([str(file)]) != before
